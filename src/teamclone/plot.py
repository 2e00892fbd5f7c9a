"""Pictures of matches, on axes of matplotlib: formations, pass networks, heat maps, shots, moments, fans of futures.

A team that is named attacks to the right. Where both teams are shown they play as in the log, the left one to the
right. Every function draws into `axes` without a pitch, or into a figure of its own, and returns the axes.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import TeamcloneError, UsageError, choose
from teamclone.events.definitions import EventKind, Outcome
from teamclone.events.table import MatchEvents
from teamclone.logs.align import frame_of
from teamclone.logs.match import Match, side_named
from teamclone.logs.read import read_match
from teamclone.plots.style import LIGHT, style
from teamclone.rcss import pitch as field
from teamclone.rcss import state_bits
from teamclone.rcss.players import N_TEAM, TEAM_SLOTS
from teamclone.rcss.playmodes import PlayMode
from teamclone.rcss.reference_frame import rotate_point
from teamclone.world.channels import FLAG_ON_FIELD
from teamclone.world.view import view

try:
    import matplotlib as mpl
    from matplotlib import pyplot
    from matplotlib.lines import Line2D

    from teamclone.plots import maps
    from teamclone.plots.fans import draw_fan
    from teamclone.plots.pitch import draw_pitch
except ModuleNotFoundError as error:
    raise TeamcloneError(f"tc.plot needs {error.name}: pip install 'teamclone[report]'") from error

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["fan", "formation", "heat_map", "moment", "pass_network", "pitch", "shot_map"]

Floats = NDArray[np.float64]
OneMatch: TypeAlias = Match | MatchEvents | Path | str
Matches: TypeAlias = OneMatch | Sequence[OneMatch]
"""A match, its events, the path of its game log; or several, which are taken together."""

UNUMS = range(1, N_TEAM + 1)
_SIZE, _HALF_SIZE = (7.0, 4.8), (5.0, 6.0)
"""Of figures with a whole and with half a pitch, inches."""
_CELLS = (53, 34)
"""Of a heat map, about 2 m wide."""
_COLOURS = (LIGHT.accent, LIGHT.second)
"""Of the left and of the right team where both are shown."""


@mpl.rc_context(style(LIGHT))
def pitch(*, axes: Axes | None = None) -> Axes:
    """Draw an empty pitch: metres, +x to the right, +y downwards.

    Args:
        axes: where; None for a figure of its own.
    """
    axes = _axes(axes)
    draw_pitch(axes, colour=LIGHT.muted)
    return axes


@mpl.rc_context(style(LIGHT))
def formation(
    match: Matches | NDArray[Any],
    *,
    team: str | None = None,
    side: str | None = None,
    with_ball: bool | None = None,
    ball: Literal["own half", "other half"] | None = None,
    spread: bool = True,
    axes: Axes | None = None,
) -> Axes:
    """Draw where players stand on average in play_on.

    Args:
        match: a match, the path of its game log, or several of them; or places (n, 2) m of the numbers from 1.
        team: name of the team. side: "left" or "right", in its place. Neither for both teams of one match.
        with_ball: only while the team has the ball (True), or the other one (False).
        ball: only while the ball is in the team's own half, or in the other one.
        spread: draw standard deviations along and across the pitch, too, as ellipses.
        axes: where; None for a figure of its own.

    Raises:
        UsageError: the team does not play.
        LogError: a log cannot be read.
    """
    if isinstance(match, np.ndarray):
        axes = _axes(axes)
        maps.draw_formation(axes, match, unums=range(1, len(match) + 1), colours=LIGHT)
        return axes
    if ball not in (None, "own half", "other half"):
        raise UsageError(f"expected the ball in the own half or the other half, got {ball!r}")
    phase = {True: "with the ball", False: "without the ball", None: "in play"}[with_ball]
    phase += f", ball in its {ball}" if ball else ""
    both = team is None and side is None
    only = _only(match) if both else None
    teams = [[(only, 1)], [(only, -1)]] if only else [list(_played(match, team, side))]
    seen = [np.concatenate([_standing(_match(one), sign, with_ball, ball) for one, sign in played]) for played in teams]
    axes = _axes(axes)
    draw_pitch(axes, colour=LIGHT.muted, width=maps.LINE)
    for standing, colour, turned in zip(seen, _COLOURS, (False, True), strict=False):
        places = np.ma.masked_invalid(standing)
        mean, deviation = (values.filled(np.nan) for values in (places.mean(0), places.std(0)))
        maps.draw_players(
            axes,
            rotate_point(mean) if turned else mean,
            unums=UNUMS,
            colours=LIGHT,
            colour=colour,
            spread=deviation if spread else None,
        )
    if only:
        _title(axes, f"mean places {phase}")
        _name_sides(axes, only)
    else:
        _title(axes, f"{_name(teams[0])} {phase}", f"{len(seen[0]):,} cycles", _number(teams[0]))
        _towards(axes)
    return axes


@mpl.rc_context(style(LIGHT))
def pass_network(
    match: Matches,
    *,
    team: str | None = None,
    side: str | None = None,
    least: float | None = None,
    axes: Axes | None = None,
) -> Axes:
    """Draw completed passes between players: arrows by how many there were, discs by how many a player made.

    Players stand where they play and receive passes on average; those who do neither are left out.

    Args:
        match: a match, its events, the path of its game log, or several of them, whose passes are added.
        team: name of the team. side: "left" or "right", in its place.
        least: pairs of players with fewer passes are left out; None for none.
        axes: where; None for a figure of its own.

    Raises:
        UsageError: neither a team nor a side is named, or the team does not play.
        LogError: a log cannot be read.
    """
    played = list(_played(match, team, side))
    counts, places, ends = np.zeros((N_TEAM, N_TEAM)), np.zeros((N_TEAM, 2)), np.zeros((N_TEAM, 1))
    for one, sign in played:
        events = _events(one).columns
        these = (
            _of_kinds(events, [EventKind.PASS]) & (events["outcome"] == Outcome.COMPLETED) & (events["side"] == sign)
        )
        these &= (events["unum"] > 0) & (events["other_unum"] > 0)
        passer, receiver = (events[name][these].astype(np.int64) - 1 for name in ("unum", "other_unum"))
        np.add.at(counts, (passer, receiver), 1)
        for player, begin in ((passer, ""), (receiver, "end_")):
            np.add.at(places, player, sign * _points(events, these, begin))
            np.add.at(ends, player, 1)
    axes = _axes(axes)
    with np.errstate(invalid="ignore"):
        maps.draw_pass_network(axes, places / ends, counts, unums=UNUMS, colours=LIGHT, least=least)
    _title(axes, _name(played), f"{counts.sum():,.0f} completed passes", _number(played))
    _towards(axes)
    return axes


@mpl.rc_context(style(LIGHT))
def heat_map(
    match: Matches | NDArray[Any],
    *,
    team: str | None = None,
    side: str | None = None,
    unum: int | None = None,
    kinds: Collection[str] = (),
    axes: Axes | None = None,
) -> Axes:
    """Draw where a team, a player or the ball is in play_on, or where events begin.

    Args:
        match: a match, its events, the path of its game log, or several of them; or points (n, 2) m.
        team: name of the team. side: "left" or "right", in its place. Neither for the ball, or for events of both.
        unum: number of a player, 1 to 11; None for all, the goalkeeper included.
        kinds: of events, such as ``pass``; empty for places in every cycle of play_on.
        axes: where; None for a figure of its own.

    Raises:
        UsageError: the team does not play, or there is no such kind or number.
        LogError: a log cannot be read.
    """
    if isinstance(match, np.ndarray):
        axes = _axes(axes)
        maps.draw_heat(axes, _counted(match), colours=LIGHT)
        return axes
    named = team is not None or side is not None
    if unum is not None and (unum not in UNUMS or not named):
        raise UsageError(f"expected a number from 1 to {N_TEAM} and its team, got {unum}")
    wanted = [_kind(kind) for kind in kinds]
    played = list(_played(match, team, side)) if named else [(_only(match), 0)]
    if wanted:
        points = [_begun(_events(one).columns, wanted, sign, unum) for one, sign in played]
    elif named:
        points = [_standing(_match(one), sign)[:, _slots(unum)] for one, sign in played]
    else:
        points = [_ball(_match(one)) for one, _ in played]
    axes = _axes(axes)
    maps.draw_heat(axes, _counted(np.concatenate([these.reshape(-1, 2) for these in points])), colours=LIGHT)
    who = (_name(played) + (f" {unum}" if unum else "")) if named else "both teams" if wanted else "ball"
    what = " and ".join(kind.value for kind in wanted) if wanted else "in play"
    number = f"{sum(map(len, points)):,} {'events' if wanted else 'cycles'}"
    _title(axes, f"{who}: {what}" if wanted else f"{who} {what}", number, _number(played))
    if named:
        _towards(axes)
    return axes


@mpl.rc_context(style(LIGHT))
def shot_map(
    match: Matches, *, team: str | None = None, side: str | None = None, half: bool = True, axes: Axes | None = None
) -> Axes:
    """Draw from where a team shoots, goals filled; the area of a shot is its expected goals.

    Args:
        match: a match, its events, the path of its game log, or several of them.
        team: name of the team. side: "left" or "right", in its place.
        half: leave out the own half, as far as there is no shot in it.
        axes: where; None for a figure of its own.

    Raises:
        UsageError: neither a team nor a side is named, or the team does not play.
        LogError: a log cannot be read.
    """
    played = list(_played(match, team, side))
    places, goals, expected = [], [], []
    for one, sign in played:
        events = _events(one).columns
        these = _of_kinds(events, [EventKind.SHOT]) & (events["side"] == sign)
        places.append(sign * _points(events, these))
        goals.append(events["outcome"][these] == Outcome.GOAL)
        expected.append(events["expected_goals"][these])
    x, y = np.concatenate(places).T
    # Where the chance of a shot is not known, it has the least size.
    size = np.nan_to_num(np.concatenate(expected))
    axes = _axes(axes, _HALF_SIZE if half else _SIZE)
    maps.draw_shots(axes, x, y, outcome=np.concatenate(goals), size=size, colours=LIGHT, half=half)
    _title(axes, _name(played), f"{len(x)} shots, {size.sum():.1f} goals expected", _number(played))
    return axes


@mpl.rc_context(style(LIGHT))
def moment(match: Match | Path | str, *, cycle: int, stoppage: int = 0, axes: Axes | None = None) -> Axes:
    """Draw one cycle of a match: both teams, where they face, and the ball.

    Args:
        match: a match, or the path of its game log.
        cycle: server time. stoppage: which of the frames with this time, 0 the first.
        axes: where; None for a figure of its own.

    Raises:
        UsageError: the match has no such frame.
        LogError: the log cannot be read.
    """
    found = _match(match)
    frames, players = found.frames, found.players
    at = int(frame_of(frames, np.array([cycle]), np.array([stoppage]), has_stoppage=True)[0])
    if at < 0:
        ends = f"{frames['cycle'][0]} to {frames['cycle'][-1]}" if len(frames["cycle"]) else "none"
        raise UsageError(f"match {found.match_id}: no frame of cycle {cycle}, stoppage {stoppage}; its cycles: {ends}")
    places = np.stack([players["x"][at], players["y"][at]], -1)
    places[(players["state"][at] & state_bits.STAND) == 0] = np.nan
    axes = _axes(axes)
    draw_pitch(axes, colour=LIGHT.muted, width=maps.LINE)
    for slots, colour in zip(TEAM_SLOTS, _COLOURS, strict=True):
        facing = players["body"][at, slots]
        maps.draw_players(axes, places[slots], unums=UNUMS, colours=LIGHT, colour=colour, body=facing)
    maps.draw_ball(axes, [frames["ball_x"][at], frames["ball_y"][at]], colours=LIGHT)
    mode = int(frames["playmode"][at])
    word = PlayMode(mode).name.lower() if mode < len(PlayMode) else f"play mode {mode}"
    score = f"{frames['left_score'][at]} : {frames['right_score'][at]}"
    _title(axes, f"cycle {cycle}", word, score)
    _name_sides(axes, found)
    return axes


@mpl.rc_context(style(LIGHT))
def fan(fan: Mapping[str, Any], *, axes: Axes | None = None) -> Axes:
    """Draw where a clone expects players and ball to go from a moment on, and where they went.

    Args:
        fan: one of the ``fans`` in ``fans.json`` of `teamclone rollout`.
        axes: where; None for a figure of its own.
    """
    axes = _axes(axes)
    draw_fan(axes, fan, colours=LIGHT)
    return axes


def _axes(axes: Axes | None, size: tuple[float, float] = _SIZE) -> Any:
    if axes is not None:
        return axes
    _, made = pyplot.subplots(figsize=size, layout="constrained", facecolor=LIGHT.paper)
    return made


def _each(match: Matches) -> Sequence[OneMatch]:
    return [match] if isinstance(match, OneMatch) else match


def _only(match: Matches) -> Match | MatchEvents:
    """Return the one match of views that show both teams."""
    matches = _each(match)
    if len(matches) != 1:
        raise UsageError(f"expected one match, or a team of these {len(matches)}: name it")
    return _read(matches[0])


def _played(match: Matches, team: str | None, side: str | None) -> Iterator[tuple[Match | MatchEvents, int]]:
    """Yield each match with the side of the team, 1 left or -1 right."""
    for one in map(_read, _each(match)):
        left, right = _names(one)
        yield one, side_named(one.match_id, left, right, team=team, side=side)


def _read(match: OneMatch) -> Match | MatchEvents:
    return read_match(match) if isinstance(match, Path | str) else match


def _match(match: OneMatch) -> Match:
    found = _read(match)
    if isinstance(found, MatchEvents):
        raise UsageError(f"match {found.match_id}: expected the match or its path, got its events, which lack places")
    return found


def _events(match: Match | MatchEvents) -> MatchEvents:
    return match if isinstance(match, MatchEvents) else MatchEvents.of(match)


def _names(match: Match | MatchEvents) -> tuple[str | None, str | None]:
    return (match.left, match.right) if isinstance(match, MatchEvents) else (match.left.name, match.right.name)


def _standing(match: Match, sign: int, with_ball: bool | None = None, ball: str | None = None) -> NDArray[np.float64]:
    """Return the places (n, 11, 2) m of the team on a side in cycles of play_on, NaN off the field; it attacks +x."""
    world = view(match, side=sign)
    kept = world.mode == PlayMode.PLAY_ON
    if with_ball is not None:
        kept &= _has_ball(match, sign if with_ball else -sign)
    if ball is not None:
        kept &= (world.ball[:, 0] < 0) == (ball == "own half")
    there = (world.channel("flags")[kept, :N_TEAM].astype(np.int64) & FLAG_ON_FIELD) != 0
    return np.where(there[..., None], world.players[kept, :N_TEAM, :2].astype(np.float64), np.nan)


def _has_ball(match: Match, sign: int) -> NDArray[np.bool_]:
    """Return (n_frames,) whether the team on a side has the ball."""
    spells = MatchEvents.of(match).select(kinds=[EventKind.POSSESSION]).columns
    own = spells["side"] == sign
    changes = np.zeros(len(match.frames["cycle"]) + 1, np.int64)
    np.add.at(changes, spells["frame"][own], 1)
    np.add.at(changes, spells["end_frame"][own], -1)
    return changes[:-1].cumsum() > 0


def _ball(match: Match) -> Floats:
    """Return the places (n, 2) m of the ball in play_on."""
    frames = match.frames
    places: Floats = np.stack([frames["ball_x"], frames["ball_y"]], -1)[frames["playmode"] == PlayMode.PLAY_ON]
    return places


def _kind(word: str) -> EventKind:
    try:
        return EventKind(word)
    except ValueError:
        raise UsageError(f"no kind of event {word!r}; {choose(word, [kind.value for kind in EventKind])}") from None


def _of_kinds(events: Mapping[str, NDArray[Any]], kinds: Collection[EventKind]) -> NDArray[np.bool_]:
    return np.isin(events["kind"], [kind.value for kind in kinds])


def _points(events: Mapping[str, NDArray[Any]], these: NDArray[np.bool_], begin: str = "") -> Floats:
    """Return the ball's places (n, 2) m as some events begin or, by ``end_``, end."""
    return np.stack([events[f"{begin}{axis}"][these] for axis in "xy"], -1).astype(np.float64)


def _begun(events: Mapping[str, NDArray[Any]], kinds: Collection[EventKind], sign: int, unum: int | None) -> Floats:
    """Return where events of the team on a side, 0 for both, begin, (n, 2) m."""
    these = _of_kinds(events, kinds)
    if sign:
        these &= events["side"] == sign
    if unum is not None:
        these &= events["unum"] == unum
    return (sign or 1) * _points(events, these)


def _slots(unum: int | None) -> slice:
    return slice(0, N_TEAM) if unum is None else slice(unum - 1, unum)


def _counted(points: Floats) -> Floats:
    """Return how many of the points (n, 2) m lie in each of _CELLS; those beside the pitch and NaN in none."""
    ends = ((-field.HALF_LENGTH, field.HALF_LENGTH), (-field.HALF_WIDTH, field.HALF_WIDTH))
    x, y = points[np.isfinite(points).all(1)].T
    counts: Floats = np.histogram2d(x, y, bins=_CELLS, range=ends)[0]
    return counts


def _name(played: Sequence[tuple[Match | MatchEvents, int]]) -> str:
    match, sign = played[0]
    return _names(match)[0 if sign > 0 else 1] or "nobody"


def _number(played: Sequence[Any]) -> str:
    return f"{len(played)} matches" if len(played) > 1 else ""


def _title(axes: Axes, *parts: str) -> None:
    axes.set_title(", ".join(part for part in parts if part), loc="left", parse_math=False)


def _towards(axes: Axes) -> None:
    """Say where the team attacks."""
    axes.annotate(
        "attacks \N{RIGHTWARDS ARROW}", (0.5, 0), (0, -1), xycoords="axes fraction", textcoords="offset points",
        ha="center", va="top", fontsize=8, color=LIGHT.muted,
    )  # fmt: skip


def _name_sides(axes: Axes, match: Match | MatchEvents) -> None:
    """Say which team is which."""
    marks: Any = {"marker": "o", "linestyle": "none", "markersize": 8}
    handles = [
        Line2D([], [], color=colour, label=name or "nobody", **marks)
        for name, colour in zip(_names(match), _COLOURS, strict=True)
    ]
    place: Any = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.02), "ncols": 2}
    for text in axes.legend(handles=handles, frameon=False, labelcolor=LIGHT.ink, **place).get_texts():
        text.set_parse_math(False)
