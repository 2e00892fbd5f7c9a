"""One match from the side of the team that is scouted: what every section looks at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import StoreError
from teamclone.events.definitions import EventKind
from teamclone.logs.match import Columns
from teamclone.rcss import server_params
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.players import TEAM_SLOTS
from teamclone.rcss.playmodes import PlayMode
from teamclone.store import schema
from teamclone.store.events import read_events
from teamclone.store.of_team import TeamMatch
from teamclone.store.store import Store
from teamclone.world.channels import FLAG_GOALIE, FLAG_ON_FIELD
from teamclone.world.view import FRAME_COLUMNS, PLAYER_COLUMNS, view_columns
from teamclone.world.world import World

BEHIND_M = 15.0
"""So far behind the goalkeeper that the server knows stands, on average, another one that keeps the goal."""

Floats = NDArray[np.floating[Any]]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]


@dataclass(frozen=True, slots=True, kw_only=True)
class Seen:
    """A match in the team's frame of reference: it attacks +x and comes first on the player axis.

    Attributes:
        match_id: of the match. opponent: name of the other team.
        world: all frames.
        events: columns of ``events.definitions``, places turned into the team's frame, with ``own`` (n_events,) bool
            whether an event is the team's and ``other_own`` whether the other player that it is about is.
        goalies: (n_frames, 22) who keeps a goal. The one that may catch, unless a teammate stands far behind: players
            that connect in an unusual order make another one than they mean the server's goalkeeper.
        has: (n_frames,) 1 where the team has the ball in play_on, -1 where the opponent has it, else 0.
        cycles: of a match of full length, both halves.
    """

    match_id: str
    opponent: str
    world: World
    events: Columns
    goalies: Bools
    has: NDArray[np.int8]
    cycles: float

    @classmethod
    def of(
        cls,
        frames: Columns,
        players: Columns,
        events: Columns,
        *,
        side: int,
        types: Columns | None = None,
        params: Mapping[str, float | str],
        match_id: str = "",
        opponent: str = "",
    ) -> Seen:
        """Return a match as the team on ``side`` sees it, 1 left or -1 right.

        Args:
            frames, players, types, params: as ``world.view.view_columns`` takes them.
            events: ``events.definitions.COLUMNS`` of the match.
        """
        world = view_columns(frames, players, types=types, params=params, side=side)
        return cls(
            match_id=match_id,
            opponent=opponent,
            world=world,
            goalies=_goalies(world),
            events=_turned(events, side),
            has=_owned(events, side, len(frames["cycle"])),
            cycles=2 * server_params.half_cycles(params, version=server_params.OLDEST),
        )

    @property
    def play_on(self) -> Bools:
        """(n_frames,) whether the ball is in play."""
        found: Bools = self.world.mode == PlayMode.PLAY_ON
        return found

    @property
    def length(self) -> float:
        """How much of a whole match the log holds, in cycles: 1 of a whole one, half of one cut at half time."""
        cycle = self.world.cycle
        return float(cycle.max() - cycle.min()) / self.cycles if len(cycle) and self.cycles > 0 else 0.0

    @property
    def ball(self) -> NDArray[np.float32]:
        """(n_frames, 2) its place, m."""
        return self.world.ball[:, :2]

    @property
    def places(self) -> NDArray[np.float32]:
        """(n_frames, 22, 2) places of all players, m; NaN off the field."""
        place = self.world.players[..., :2]
        return np.where(self.on_field[..., None], place, np.float32(np.nan))

    @property
    def on_field(self) -> Bools:
        """(n_frames, 22) who is on the field."""
        return _flag(self.world, FLAG_ON_FIELD)

    @property
    def gloves(self) -> Bools:
        """(n_frames, 22) who may catch the ball: the goalkeeper that the server knows."""
        return _flag(self.world, FLAG_GOALIE)

    @property
    def outfield(self) -> NDArray[np.float32]:
        """(n_frames, 22, 2) places of the field players, m; NaN of goalkeepers, too."""
        return np.where(self.goalies[..., None], np.float32(np.nan), self.places)

    def pick(self, kind: EventKind, *outcomes: str, own: bool | None = True) -> Columns:
        """Return the events of a kind and some outcomes, of the team, or with ``own`` False of the opponent.

        ``own`` None gives those of both.
        """
        these = self.events["kind"] == kind.value
        if own is not None:
            these &= self.events["own"] if own else ~self.events["own"]
        if outcomes:
            these &= np.isin(self.events["outcome"], [str(one) for one in outcomes])
        return {name: values[these] for name, values in self.events.items()}


def see(store: Store, match: TeamMatch) -> tuple[Seen, Seen]:
    """Return a match as the team and as its opponent see it.

    Raises:
        StoreError: its rows cannot be read, or its game log has no frame.
    """
    frames = store.read_match_columns(match.match_id, schema.FRAMES.name, columns=FRAME_COLUMNS)
    players = store.read_match_columns(match.match_id, schema.PLAYER_STATES.name, columns=PLAYER_COLUMNS)
    types = store.read_match_columns(match.match_id, schema.PLAYER_TYPES.name, columns=FIELDS)
    params = store.read_parameters(match.match_id)["server"]
    events = read_events(store, match.match_id)
    if not len(frames["cycle"]):
        raise StoreError(f"match {match.match_id}: its game log has no frame")
    names = {1: match.row["left_name"] or "", -1: match.row["right_name"] or ""}

    def of(side: int) -> Seen:
        return Seen.of(
            frames,
            players,
            events,
            side=side,
            types=types,
            params=params,
            match_id=match.match_id,
            opponent=names[-side],
        )

    return of(match.side), of(-match.side)


def _flag(world: World, flag: int) -> Bools:
    found: Bools = (np.nan_to_num(world.channel("flags")).astype(np.int64) & flag) != 0
    return found


def _goalies(world: World) -> Bools:
    """Return (n_frames, 22) who keeps a goal, see `Seen`."""
    named, on_field = _flag(world, FLAG_GOALIE), _flag(world, FLAG_ON_FIELD)
    play_on = (world.mode == PlayMode.PLAY_ON)[:, None]
    for team, behind in zip(TEAM_SLOTS, (1.0, -1.0), strict=True):
        x = behind * world.channel("x")[:, team].astype(np.float64)
        playing = on_field[:, team] & play_on & np.isfinite(x)
        keeps = named[:, team] & playing
        other = playing & ~keeps.any(0)
        if keeps.any() and other.any():
            mean = np.where(other, x, 0).sum(0) / np.maximum(other.sum(0), 1)
            hindmost = int(np.where(other.any(0), mean, np.inf).argmin())
            if mean[hindmost] < x[keeps].mean() - BEHIND_M:
                named[:, team] = False
                named[:, team.start + hindmost] = on_field[:, team.start + hindmost]
    return named


def _turned(events: Columns, side: int) -> Columns:
    turned = {name: events[name] * np.float32(side) for name in ("x", "y", "end_x", "end_y")}
    return {
        **events,
        **turned,
        "own": events["side"] == side,
        "other_own": events["other_side"] == side,
    }


def _owned(events: Columns, side: int, n_frames: int) -> NDArray[np.int8]:
    """Return whose the ball is, frame by frame, from the spells of possession."""
    has = np.zeros(n_frames, np.int8)
    for row in np.flatnonzero(events["kind"] == EventKind.POSSESSION.value):
        has[events["frame"][row] : events["end_frame"][row]] = side * events["side"][row]
    return has
