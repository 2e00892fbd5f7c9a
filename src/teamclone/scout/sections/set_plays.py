"""Set plays of a team: who takes them, where the first ball goes, what becomes of them; a part of transitions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from teamclone.events.definitions import EventKind, Outcome
from teamclone.logs.match import Columns
from teamclone.rcss.players import N_TEAM
from teamclone.scout import figures
from teamclone.scout.findings import Claim, Findings, Picture, Table, claim, claims
from teamclone.scout.measures import Figure, Look, Looks, Measure, Moment, ratio
from teamclone.scout.places import mean_of, summed
from teamclone.scout.sections.turnovers import SHOT_CYCLES
from teamclone.scout.seen import Bools, Floats, Ints, Seen
from teamclone.scout.windows import followed, foremost, until, who

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

KEPT_CYCLES = 50
LEAST = 5
"""Rarer set plays are in the table, but in no sentence."""
RARER = 3
"""A number that does something so much more rarely than the first one is not named beside it."""
OFTEN = 1.0
"""Of rarer ones in a match nobody needs a sentence on who takes them."""
LEAST_DRAWN = 3
MOST_BALLS = 20
"""First balls of a place that are kept of a match."""
SEVERAL_CYCLES = 5
"""For how long after the start of play a player may kick the ball of its set play again."""

KINDS = ("kick off", "kick in", "free kick", "corner kick", "goal kick", "catch")
"""Words of the events, and the free kick that follows a catch of the goalkeeper."""
PLURAL = ("kick-offs", "kick-ins", "free kicks", "corner kicks", "goal kicks", "goalkeeper's balls after a catch")
KICK_IN, FREE_KICK, CORNER_KICK, GOAL_KICK, CATCH = range(1, len(KINDS))
TAKING = (EventKind.PASS, EventKind.SHOT, EventKind.CLEARANCE, EventKind.DRIBBLE)
"""As what the first touch of a set play is found."""
LOSSES = (Outcome.LOST, Outcome.CAUGHT, Outcome.OUT, Outcome.OFFSIDE)
"""Ends of a possession that give the ball away."""

PLACES = (
    "Kick-ins from the left, their half",
    "Kick-ins from the right, their half",
    "Corner kicks from the left",
    "Corner kicks from the right",
    "Goal kicks",
    "After a catch",
)
"""Set plays of which the formation is drawn."""
FACED = (
    "Kick-ins in its half, from their left",
    "Kick-ins in its half, from their right",
    "Corner kicks from their left",
    "Corner kicks from their right",
    "Their goal kicks",
    "After a catch of their goalkeeper",
)
"""The same set plays, as the team sees those of its opponents."""

KEYS = tuple(f"set_{kind.replace(' ', '_')}" for kind in KINDS)
"""Of the measures of each kind."""

MEASURES = tuple(
    measure
    for key, words in zip(KEYS, PLURAL, strict=True)
    for measure in (
        Measure(key=key, name=words, unit="", about="in a match, taken or not"),
        Measure(
            key=f"{key}_kept",
            name=f"{words}: ball kept",
            unit="share",
            about=f"of those taken, those whose ball is not lost in {KEPT_CYCLES} cycles",
            good=1,
        ),
        Measure(
            key=f"{key}_shot",
            name=f"{words}: shot",
            unit="share",
            about=f"of those taken, those with a shot within {SHOT_CYCLES} cycles of play",
            good=1,
        ),
        Measure(
            key=f"{key}_wait",
            name=f"{words}: wait",
            unit="cycles",
            about="from the whistle to the kick",
        ),
    )
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Taken:
    """Set plays of a team in a match, arrays (n,).

    Attributes:
        kind: index of KINDS. start, end: frames of its play mode. unum: who took it, 0 if nobody of the team did or the
            log does not tell it. kick: frame of the first touch.
        ball, to: (n, 2) m, where it was taken, and where the next player touches the ball or play stops; NaN where
            several touched it.
        receiver: the teammate that has the next touch, 0 of none.
        shot, goal: one follows. kept: the ball is not lost soon; ``known`` where the log tells.
    """

    kind: Ints
    start: Ints
    end: Ints
    unum: Ints
    kick: Ints
    ball: Floats
    to: Floats
    receiver: Ints
    shot: Bools
    goal: Bools
    kept: Bools
    known: Bools

    @property
    def taken(self) -> Bools:
        """(n,) whether somebody of the team took it."""
        return self.unum > 0


def set_plays(seen: Seen) -> Taken:
    """Return the set plays of a team."""
    plays = seen.pick(EventKind.SET_PLAY)
    kind = _kinds(seen, plays)
    plays = {name: values[kind >= 0] for name, values in plays.items()}
    kind = kind[kind >= 0]
    start, end, unum = (plays[name].astype(np.int64) for name in ("frame", "end_frame", "unum"))
    kicks = np.append(seen.pick(EventKind.KICK)["frame"], len(seen.ball))
    kick = np.minimum(kicks[np.searchsorted(kicks, start)], np.maximum(end - 1, start))
    to, receiver = _first_balls(seen, start, end, unum)
    last = until(seen, end, SHOT_CYCLES)
    shots, goals = (seen.pick(EventKind.SHOT, *outcome)["frame"] for outcome in ((), (Outcome.GOAL,)))
    kept, known = _kept(seen, end)
    return Taken(
        kind=kind,
        start=start,
        end=end,
        unum=unum,
        kick=kick,
        ball=seen.ball[kick],
        to=to,
        receiver=receiver,
        shot=followed(shots, kick, last),
        goal=followed(goals, kick, last),
        kept=kept,
        known=known & (unum > 0),
    )


def _kinds(seen: Seen, plays: Columns) -> Ints:
    """Return the kind (n,) of each set play, -1 of others."""
    words = np.where(plays["outcome"] == "indirect free kick", "free kick", plays["outcome"])
    kind = np.full(len(words), -1, np.int64)
    for index, word in enumerate(KINDS):
        kind[words == word] = index
    caught = np.isin(plays["frame"] - 1, seen.pick(EventKind.CATCH)["frame"])
    found: Ints = np.where(caught & (kind == FREE_KICK), CATCH, kind)
    return found


def _first_balls(seen: Seen, start: Ints, end: Ints, unum: Ints) -> tuple[Floats, Ints]:
    """Return where the first balls of set plays go (n, 2), and to which teammate (n,), 0 of none."""
    these = np.flatnonzero(seen.events["own"] & np.isin(seen.events["kind"], [kind.value for kind in TAKING]))
    to, receiver = np.full((len(start), 2), np.nan), np.zeros(len(start), np.int64)
    if not len(these):
        return to, receiver
    balls = {name: seen.events[name][these] for name in ("frame", "unum", "end_x", "end_y", "other_own", "other_unum")}
    at = np.searchsorted(balls["frame"], start)
    row = np.minimum(at, len(these) - 1)
    # Some kick the ball several times before it is away.
    there = (at < len(these)) & (balls["unum"][row] == unum) & (balls["frame"][row] < end + SEVERAL_CYCLES)
    row = row[there]
    to[there] = np.stack([balls["end_x"][row], balls["end_y"][row]], -1)
    other = balls["other_own"][row] & (balls["other_unum"][row] != unum[there])
    receiver[there] = np.where(other, balls["other_unum"][row], 0)
    return to, receiver


def _kept(seen: Seen, end: Ints) -> tuple[Bools, Bools]:
    """Return whether the ball is not lost soon after set plays end (n,), and where the log tells who had it."""
    spells = seen.pick(EventKind.POSSESSION, own=None)
    if not len(spells["frame"]):
        return np.zeros(len(end), np.bool_), np.zeros(len(end), np.bool_)
    at = np.searchsorted(spells["frame"], end)
    row = np.minimum(at, len(spells["frame"]) - 1)
    cycle = seen.world.cycle
    lasts = cycle[spells["end_frame"][row]] - cycle[spells["frame"][row]]
    lost = np.isin(spells["outcome"][row], [str(one) for one in LOSSES]) & (lasts <= KEPT_CYCLES)
    known = (at < len(spells["frame"])) & (spells["frame"][row] == end)
    return known & spells["own"][row] & ~lost, known


def look(seen: Seen) -> Look:
    """Return what a match says of this."""
    found = set_plays(seen)
    numbers = {}
    for index, key in enumerate(KEYS):
        these = found.kind == index
        taken = these & found.taken
        numbers[key] = (float(these.sum()), seen.length)
        numbers[f"{key}_kept"] = (float((found.kept & found.known & these).sum()), float((found.known & these).sum()))
        numbers[f"{key}_shot"] = (float((found.shot & taken).sum()), float(taken.sum()))
        numbers[f"{key}_wait"] = (float((found.kick - found.start)[taken].sum()), float(taken.sum()))
    places = _places(found)
    stood, faced = np.zeros((2, len(PLACES), N_TEAM, 3))
    ways = []
    for place in range(len(PLACES)):
        rows = np.flatnonzero(found.taken & (places == place))
        at_kick = seen.places[found.kick[rows]]
        stood[place], faced[place] = summed(at_kick[:, :N_TEAM]), summed(at_kick[:, N_TEAM:])
        rows = rows[:MOST_BALLS]
        ways.append(np.concatenate([np.full((len(rows), 1), place), found.ball[rows], found.to[rows]], axis=1))
    return Look(
        numbers=numbers,
        arrays={
            "set_count": _counted(found.kind, np.zeros(len(found.kind), np.int64), 1)[:, 0],
            "set_takers": _counted(found.kind[found.taken], found.unum[found.taken], N_TEAM + 1),
            "set_receivers": _counted(found.kind[found.taken], found.receiver[found.taken], N_TEAM + 1),
            "set_stood": stood,
            "set_faced": faced,
            "set_balls": np.concatenate(ways).astype(np.float32),
        },
        moments=_moments(seen, found),
    )


def _counted(kind: Ints, what: Ints, n: int) -> Floats:
    counts = np.bincount(kind * n + what, minlength=len(KINDS) * n)
    found: Floats = counts.reshape(len(KINDS), n).astype(np.float64)
    return found


def _places(found: Taken) -> Ints:
    """Return the index (n,) of PLACES, -1 of other set plays."""
    x, y = np.nan_to_num(found.ball).T
    right = (y > 0).astype(np.int64)
    kick_in, corner = (found.kind == KICK_IN) & (x > 0), found.kind == CORNER_KICK
    choices = [kick_in, corner, found.kind == GOAL_KICK, found.kind == CATCH]
    places: Ints = np.select(choices, [right, 2 + right, 4, 5], -1)
    return places


def _moments(seen: Seen, found: Taken) -> dict[str, list[Moment]]:
    """Return set plays of each kind, those with a goal and a shot first."""
    moments = {}
    for index, key in enumerate(KEYS):
        rows = np.flatnonzero((found.kind == index) & found.taken)
        weight = found.goal[rows] + 0.5 * found.shot[rows] + 0.1 * (found.receiver[rows] > 0)
        moments[key] = foremost(
            seen,
            found.kick[rows],
            found.unum[rows],
            weight,
            lambda one, rows=rows: (
                f"{found.unum[rows[one]]} to {who(int(found.receiver[rows[one]]))}"  # type: ignore[misc]
                + _then(found, int(rows[one]))
            ),
        )
    return moments


def _then(found: Taken, row: int) -> str:
    return ", then a goal" if found.goal[row] else ", then a shot" if found.shot[row] else ""


def tell(looks: Looks, other: Looks) -> Findings:
    """Return what its matches say of this; ``other`` is of its opponents."""
    rare = [words for kind, words in enumerate(PLURAL) if looks.total("set_count")[kind] < LEAST]
    return Findings(
        claims=claims(
            _most_dangerous(looks),
            _of_kind(looks, KICK_IN),
            _of_kind(looks, GOAL_KICK),
            _most_suffered(other),
        ),
        pictures=_pictures(looks, other),
        tables=[_table(looks, other)],
        notes=[f"Too rare in these matches to say anything of: {', '.join(rare)}."] if rare else [],
    )


def _enough(looks: Looks) -> list[int]:
    """Return the kinds of which there are enough to speak of."""
    return [kind for kind, count in enumerate(looks.total("set_count")) if count >= LEAST]


def _most_shots(looks: Looks) -> int | None:
    """Return the kind of which most shots come, None if no shot does."""
    shots = {kind: float(looks.of(f"{KEYS[kind]}_shot")[0].sum()) for kind in _enough(looks)}
    most = max(shots, key=lambda kind: shots[kind], default=None)
    return most if most is not None and shots[most] else None


def _most_dangerous(looks: Looks) -> Claim | None:
    kind = _most_shots(looks)
    # Of kick-ins and goal kicks their own sentence says it.
    if kind is None or kind in (KICK_IN, GOAL_KICK):
        return None
    return claim(
        looks,
        f"Of its set plays, {PLURAL[kind]} give the most shots: it has {{{KEYS[kind]}}} a match, and "
        f"{{{KEYS[kind]}_shot}} become a shot within {SHOT_CYCLES} cycles.",
        moments=(KEYS[kind],),
    )


def _most_suffered(other: Looks) -> Claim | None:
    kind = _most_shots(other)
    if kind is None:
        return None
    found = claim(
        other,
        f"Of its opponents' set plays, {PLURAL[kind]} give the most shots: they have {{{KEYS[kind]}}} a match, and "
        f"{{{KEYS[kind]}_shot}} become a shot within {SHOT_CYCLES} cycles.",
        moments=(KEYS[kind],),
    )
    if found is None:
        return None
    theirs = tuple(replace(one, own=False, text=f"their {one.text}") for one in found.moments)
    return replace(found, moments=theirs)


def _of_kind(looks: Looks, kind: int) -> Claim | None:
    """Return who takes set plays of a kind, to whom, how soon, and whether the ball is kept."""
    key, words = KEYS[kind], PLURAL[kind]
    if kind not in _enough(looks) or (looks.figure(key).value or 0.0) < OFTEN:
        return None
    takers, receivers = (_foremost(looks, name, kind) for name in ("set_takers", "set_receivers"))
    if takers is None:
        return None
    if looks.total("set_receivers")[kind, 1:].sum() < LEAST:
        receivers = None
    ways = f" {receivers[0]} get{'' if ' ' in receivers[0] else 's'} {{to}} of those that arrive." if receivers else ""
    return claim(
        looks,
        f"It takes {{{key}}} {words} a match, {{by}} of them by {takers[0]}, {{{key}_wait}} after the whistle.{ways} "
        f"It keeps {{{key}_kept}} of the balls for {KEPT_CYCLES} cycles"
        + (f"; {{{key}_shot}} become a shot within {SHOT_CYCLES}." if looks.figure(f"{key}_shot").value else "."),
        moments=(key,),
        shares={"by": takers[1]} | ({"to": receivers[1]} if receivers else {}),
    )


def _foremost(looks: Looks, name: str, kind: int, most: int = 2) -> tuple[str, Figure] | None:
    """Return the numbers that do something most often, and their share of the times when somebody does."""
    counts = looks.each(name)[:, kind, 1:]
    total = counts.sum(0)
    ranked = np.argsort(-total, kind="stable")[:most]
    chosen = [int(one) for one in ranked if total[one] > total[ranked[0]] / RARER]
    if not chosen:
        return None
    return " and ".join(str(one + 1) for one in chosen), ratio(counts[:, chosen].sum(1), counts.sum(1))


def _pictures(looks: Looks, other: Looks) -> list[Picture]:
    """Return where the team stands at its own set plays, and at those of its opponents, who see it turned round."""
    pictures = []
    for name, whose, these, stood, titles, words in (
        ("set-plays", "the team's", looks, looks.total("set_stood"), PLACES, "it takes a set play"),
        ("set-plays-faced", "opponents'", other, other.total("set_faced"), FACED, "an opponent takes a set play"),
    ):
        drawn = [place for place in range(len(PLACES)) if stood[place, :, 2].max() >= LEAST_DRAWN]
        if drawn:
            pictures.append(
                Picture(
                    name=name,
                    draw=partial(_draw, these, stood, drawn, titles, sign=1 if these is looks else -1),
                    alt=f"Where each number stands at {whose} set plays, and where the first ball goes",
                    caption=f"Where each number of the team stands on average as {words}, and where the first balls "
                    "go: arrows from the ball to the next touch.",
                )
            )
    return pictures


def _draw(looks: Looks, stood: Floats, drawn: list[int], titles: Sequence[str], *, sign: int) -> Drawing:
    """Draw set plays of ``looks`` where the team, -1 if it is the opponent of those who take them, stood."""
    balls = looks.joined("set_balls")
    panels = []
    for place in drawn:
        ways = sign * balls[(balls[:, 0] == place) & np.isfinite(balls).all(1), 1:]
        panels.append(
            (
                f"{titles[place]} ({stood[place, :, 2].max():.0f})",
                sign * mean_of(stood[place]),
                ways[:, :2],
                ways[:, 2:],
            )
        )
    return figures.set_plays(panels)


def _table(looks: Looks, other: Looks) -> Table:
    rows = []
    for whose, these in (("", looks), ("opponents' ", other)):
        for kind in range(len(KINDS)):
            takers, receivers = (_foremost(these, name, kind, most=3) for name in ("set_takers", "set_receivers"))
            rows.append(
                (
                    f"{whose}{PLURAL[kind]}",
                    these.figure(KEYS[kind]).value,
                    *(these.figure(f"{KEYS[kind]}_{what}").value for what in ("wait", "kept", "shot")),
                    *(one[0].replace(" and ", ", ") if one and not whose else "" for one in (takers, receivers)),
                )
            )
    return Table(
        name="set-plays",
        caption="Set plays, its own and its opponents'",
        columns=(
            "what",
            "a match",
            "wait (cycles)",
            f"kept {KEPT_CYCLES} cycles (share)",
            f"shot within {SHOT_CYCLES} (share)",
            "taken by",
            "first ball to",
        ),
        rows=rows,
        folded=True,
    )
