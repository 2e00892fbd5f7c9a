"""What one match says of one of its teams: a number for each statistic, and histograms of places and speeds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.events.statistics import described, team_statistics
from teamclone.logs.align import plays_on
from teamclone.logs.columns import Source, counter_name
from teamclone.logs.match import Columns
from teamclone.play.holes import holes_of
from teamclone.rcss import pitch, server_params
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_TEAM, TEAM_SLOTS
from teamclone.rcss.playmodes import PlayMode
from teamclone.store import schema
from teamclone.store.events import read_events
from teamclone.store.store import Store
from teamclone.world.channels import FLAG_CHARGED, FLAG_GOALIE, FLAG_ON_FIELD, FLAG_TACKLING
from teamclone.world.view import FRAME_COLUMNS, PLAYER_COLUMNS, view_columns
from teamclone.world.world import World

Floats = NDArray[np.floating[Any]]
Counts = NDArray[np.int64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Statistic:
    """A statistic of a team in a match. ``unit`` is empty of a count, ``share`` of a number from 0 to 1."""

    name: str
    unit: str
    about: str


def _of(name: str, unit: str, about: str) -> Statistic:
    return Statistic(name=name, unit=unit, about=about)


SHARES = {
    CommandKind.DASH: "a dash",
    CommandKind.TURN: "a turn",
    CommandKind.KICK: "a kick",
    CommandKind.TACKLE: "a tackle",
}
"""The commands whose shares are compared, in words."""
_SCORE = (
    _of("goals_against", "", "goals of the other team"),
    _of("goal_difference", "", "goals less those of the other team"),
    _of("win", "share", "1 for a win, else 0, so that its mean is the win rate"),
    _of("draw", "share", "1 for a draw, else 0"),
    _of("shots_against", "", "shots of the other team"),
)
_MOTION = (
    _of("tackles", "", "tackles won, lost and missed"),
    _of("play_on", "cycle", "cycles of play_on"),
    _of("speed", "m/cycle", "mean way of a field player in a cycle of play_on"),
    *(
        _of(
            f"{kind.name.lower()}_share",
            "share",
            f"of the cycles in which a field player could act, those with {words}",
        )
        for kind, words in SHARES.items()
    ),
    _of("none_share", "share", "of the same cycles, those without a body command"),
    _of("holes", "", "cycles of a player that could act and sent no body command; with command logs"),
    _of("clashes", "", "cycles of a player that sent several body commands; with command logs"),
    _of("stamina_half", "stamina", "mean stamina of the field players in the last cycle of play_on of the first half"),
    _of("stamina_end", "stamina", "the same of the match"),
    _of("capacity_end", "stamina", "mean stamina capacity of the field players in that cycle"),
)
NUMBERS: tuple[Statistic, ...] = (*_SCORE, *(_of(*one) for one in described()), *_MOTION)
"""The statistics that are one number a match, in the order of `Profile.numbers`."""
POSITIONS = _of(
    "positions",
    "m",
    "where each player number is while the ball is in each of nine zones: Wasserstein distance along and across the "
    "pitch, mean over both, players and zones, weighted by the cycles that both have",
)
SPEEDS = _of("speeds", "m/cycle", "ways of field players in a cycle of play_on: Wasserstein distance")
STATISTICS = (*NUMBERS, POSITIONS, SPEEDS)

ZONES = 3
"""Zones of the ball along the pitch, and across."""
N_BINS = 2 * int(np.ceil(pitch.MAX_X))
"""Bins of 1 m for places, the middle one's edge on the centre spot."""
SPEED_BIN = 0.02
"""Width of a bin for ways, m/cycle."""
N_SPEED_BINS = 75
"""The last bin has all greater ways, too: players that collide are moved far."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Profile:
    """One team in one match.

    Attributes:
        match_id: of the match. opponent: name of the other team.
        numbers: (len(NUMBERS),), NaN where the match has none.
        positions: (11, 2, 9, N_BINS) cycles by player, axis, zone of the ball and place; the team attacks +x.
        speeds: (N_SPEED_BINS,) player-cycles by way.
    """

    match_id: str
    opponent: str
    numbers: Floats
    positions: Counts
    speeds: Counts


def profile(store: Store, row: Mapping[str, Any], *, side: int) -> Profile:
    """Return what a match of a store says of the team on a side, 1 left or -1 right.

    Args:
        row: of the match in the table ``matches``.

    Raises:
        StoreError: its rows cannot be read.
    """
    match_id = row["match_id"]
    frames = store.read_match_columns(match_id, schema.FRAMES.name, columns=FRAME_COLUMNS)
    players = store.read_match_columns(match_id, schema.PLAYER_STATES.name, columns=PLAYER_COLUMNS)
    params = store.read_parameters(match_id)["server"]
    world = view_columns(frames, players, params=params, side=side)
    goes_on = plays_on(frames)
    values = _of_events(store, match_id, side) | _stamina(world, params)
    values |= _holes(frames, players, _commands(store, match_id), side)
    # Logs may hold any number as a place; what follows from one that is none is left out.
    with np.errstate(all="ignore"):
        ways = _ways(world, goes_on)
        values["speed"] = float(ways.mean()) if len(ways) else np.nan
        values["play_on"] = float((world.mode == PlayMode.PLAY_ON).sum())
        if (players[counter_name(CommandKind.DASH)] >= 0).any():
            values |= _shares(world, goes_on)
        bins = np.minimum((ways / SPEED_BIN).astype(np.int64), N_SPEED_BINS - 1)
        return Profile(
            match_id=match_id,
            opponent=row["right_name" if side > 0 else "left_name"],
            numbers=np.array([values.get(one.name, np.nan) for one in NUMBERS]),
            positions=_positions(world),
            speeds=np.bincount(bins, minlength=N_SPEED_BINS),
        )


def _of_events(store: Store, match_id: str, side: int) -> dict[str, float]:
    both = team_statistics(read_events(store, match_id))
    ours, theirs = (both.left, both.right) if side > 0 else (both.right, both.left)
    return {
        **{name: float(getattr(ours, name)) for name, _, _ in described()},
        "goals_against": float(theirs.goals),
        "goal_difference": float(ours.goals - theirs.goals),
        "win": float(ours.goals > theirs.goals),
        "draw": float(ours.goals == theirs.goals),
        "shots_against": float(theirs.shots),
        "tackles": float(ours.tackles_won + ours.tackles_lost + ours.tackles_missed),
    }


def _commands(store: Store, match_id: str) -> Columns:
    return store.read_match_columns(
        match_id, schema.COMMANDS.name, columns=("frame", "side", "unum", "kind", "valid", "source")
    )


def _holes(frames: Columns, players: Columns, commands: Columns, side: int) -> dict[str, float]:
    # Recovered commands are those that were executed: they know neither what was sent twice nor what was not.
    if not (commands["source"] == Source.LOGGED).any():
        return {}
    found, team = holes_of(frames, players, commands), TEAM_SLOTS[0 if side > 0 else 1]
    return {"holes": float(found.holes[team].sum()), "clashes": float(found.clashes[team].sum())}


def _flags(world: World, flag: int) -> NDArray[np.bool_]:
    """Return (n_frames, 11) whether players of the team have one of some flags."""
    found: NDArray[np.bool_] = (world.channel("flags")[:, :N_TEAM].astype(np.int64) & flag) != 0
    return found


def _field_players(world: World) -> NDArray[np.bool_]:
    """Return (n_frames, 11) which players of the team are on the field and no goalkeepers."""
    return _flags(world, FLAG_ON_FIELD) & ~_flags(world, FLAG_GOALIE)


def _ways(world: World, goes_on: NDArray[np.bool_]) -> Floats:
    """Return (n,) the ways of field players from each cycle of play_on to the next, m."""
    there = _field_players(world)
    place = np.stack([world.channel(name)[:, :N_TEAM] for name in "xy"], -1).astype(np.float64)
    way = np.hypot(*np.moveaxis(np.diff(place, axis=0), -1, 0))
    way = way[there[:-1] & there[1:] & goes_on[:-1, None]]
    known: Floats = way[np.isfinite(way)]
    return known


def _shares(world: World, goes_on: NDArray[np.bool_]) -> dict[str, float]:
    """Return the share of each command that the server executed."""
    free = _field_players(world) & ~_flags(world, FLAG_TACKLING | FLAG_CHARGED)
    given = world.channel("last_command")[1:, :N_TEAM][free[:-1] & goes_on[:-1, None]]
    if not len(given):
        return {}
    share = {f"{kind.name.lower()}_share": float((given == kind).mean()) for kind in SHARES}
    return share | {"none_share": float((given == 0).mean())}


def _stamina(world: World, params: Mapping[str, float | str]) -> dict[str, float]:
    """Return the stamina of field players as the halves end."""
    cycles = server_params.half_cycles(params, version=server_params.OLDEST)
    play_on = world.mode == PlayMode.PLAY_ON
    there = _field_players(world)
    values = {}
    for name, channel, frames in (
        ("stamina_half", "stamina", play_on & (world.cycle <= cycles)),
        ("stamina_end", "stamina", play_on),
        ("capacity_end", "capacity", play_on),
    ):
        last = np.flatnonzero(frames)[-1:]
        left = world.channel(channel)[last, :N_TEAM][there[last]].astype(np.float64)
        if len(left):
            values[name] = float(left.mean())
    return values


def zones(ball: NDArray[np.floating[Any]]) -> Counts:
    """Return (n,) the zone of each ball place (n, 2) in metres, 0 to 8: own third to theirs, of each left to right."""
    edges = (np.array([-1, 1]) * pitch.LENGTH / (2 * ZONES), np.array([-1, 1]) * pitch.WIDTH / (2 * ZONES))
    along, across = (np.searchsorted(edge, ball[:, axis]) for axis, edge in enumerate(edges))
    found: Counts = along * ZONES + across
    return found


def _positions(world: World) -> Counts:
    """Return how many cycles of play_on each player is where, see `Profile.positions`."""
    place = np.stack([world.channel(name)[:, :N_TEAM] for name in "xy"], -1).astype(np.float64)
    there = _flags(world, FLAG_ON_FIELD) & np.isfinite(place).all(-1)
    there &= ((world.mode == PlayMode.PLAY_ON) & np.isfinite(world.ball[:, :2]).all(-1))[:, None]
    frame, player = np.nonzero(there)
    bins = np.clip(np.floor(place[there]) + N_BINS // 2, 0, N_BINS - 1).astype(np.int64)
    zone = zones(world.ball[:, :2])[frame]
    shape = (N_TEAM, 2, ZONES**2, N_BINS)
    index = ((player[:, None] * 2 + np.arange(2)) * ZONES**2 + zone[:, None]) * N_BINS + bins
    counts: Counts = np.bincount(index.ravel(), minlength=int(np.prod(shape))).reshape(shape)
    return counts
