"""Percepts of matches: how well their players know where ball and others are, and all of it as one table."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import LogError, UsageError
from teamclone.logs import LogPair, Match
from teamclone.logs.each import check_teams, of_each
from teamclone.percepts.agreement import Agreement, agreement
from teamclone.percepts.believed import perceive
from teamclone.percepts.memory import MAX_AGE, Memory
from teamclone.percepts.offline_log import read_offline_log
from teamclone.percepts.sight import BALL, N_OBJECTS, Sight, X, Y, objects_of
from teamclone.rcss import state_bits
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import PlayMode
from teamclone.system.tables import writing_if

if TYPE_CHECKING:
    import pyarrow as pa

AGES = ((0, 0), (1, 1), (2, 3), (4, 7), (8, 15), (16, MAX_AGE))
"""First and last age of each row of `Known.by_age`."""
_WHAT = ("hidden", "near", "seen")
_FRAMES_AT_ONCE = 500
"""Of which the rows of a table are made at once: it bounds memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class KnownAtAge:
    """How well something is known that was last seen some cycles ago.

    Attributes:
        first, last: the ages, cycles. share: of all. error_m: the median distance from the truth; NaN of none.
    """

    first: int
    last: int
    share: float
    error_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class TeamPercepts:
    """What the field players of a team know in play_on.

    Attributes:
        team: its name. cycles: player-cycles. messages: share of them with a visual message.
        ball, others: of the ball and of the other players, by the age of what is known.
    """

    team: str
    cycles: int
    messages: float
    ball: tuple[KnownAtAge, ...]
    others: tuple[KnownAtAge, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchPercepts:
    """The percepts of a match.

    Attributes:
        match: it. sight, memory: of its players.
    """

    match: Match
    sight: Sight
    memory: Memory

    @classmethod
    def of(cls, match: Match) -> MatchPercepts:
        """Work out the percepts of a match.

        Raises:
            LogError: there is no game log, or it does not show where players look.
        """
        path = match.rcg_path or match.rcl_path
        if not len(match.frames["cycle"]):
            raise LogError("expected frames to see something in, the log has none; name its game log (.rcg)", path=path)
        game = match.game
        try:
            seen, memory = perceive(game.frames, game.players, types=game.player_types, params=game.server_params)
        except UsageError as error:
            raise LogError(str(error), path=path) from error
        return cls(match=match, sight=seen, memory=memory)

    def teams(self) -> list[TeamPercepts]:
        """Return what each team knows, of those that play."""
        sides = ((self.match.left.name, slice(0, N_TEAM)), (self.match.right.name, slice(N_TEAM, N_PLAYERS)))
        return [self._team(name, side) for name, side in sides if name]

    def _team(self, name: str, side: slice) -> TeamPercepts:
        state = self.match.players["state"]
        there = (state & state_bits.STAND) != 0
        due = there & ((state & state_bits.GOALIE) == 0)
        due &= (self.match.frames["playmode"] == PlayMode.PLAY_ON)[:, None]
        frame, player = np.nonzero(due[:, side])
        player = player + side.start
        age, error = self.memory.age[frame, player], self._error(frame, player)
        others = np.ones((len(frame), N_OBJECTS), np.bool_)
        others[:, :BALL] = there[frame]
        others[np.arange(len(frame)), player] = others[:, BALL] = False
        return TeamPercepts(
            team=name,
            cycles=len(frame),
            messages=float(self.sight.received[frame, player].mean()) if len(frame) else float("nan"),
            ball=_by_age(age[:, BALL], error[:, BALL]),
            others=_by_age(age[others], error[others]),
        )

    def _error(self, frame: NDArray[np.int64], player: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return (n, N_OBJECTS) metres between believed and true places, as players see them."""
        truth = objects_of(self.match.frames, self.match.players)[..., [X, Y]]
        return np.linalg.norm(self.memory.place[frame, player] - truth[frame], axis=-1).astype(np.float32)

    def agreement(self, path: Path) -> Agreement:
        """Return how far the visual messages are those that a player wrote down, see `agreement`.

        Raises:
            LogError: the file is no such log, or of another match.
        """
        names = (self.match.left.name or "", self.match.right.name or "")
        log = read_offline_log(path)
        try:
            return agreement(self.match.frames, names, self.sight, log)
        except LogError as error:
            raise LogError(error.text, path=path) from error

    def tables(self, *, teams: Collection[str] = ()) -> Iterator[pa.Table]:
        """Give the percepts as Arrow tables, in the order of the frames: a row a frame, player and object.

        Columns: match_id, cycle, stoppage, side and unum of the player; object_side (0 of the ball) and object_unum;
        what (hidden, near, seen), distance, direction, distance_change, direction_change as shown; x, y, vx, vy as
        believed, age. Of players on the field.

        Args:
            teams: of players of these teams only; empty for both.
        """
        names = np.repeat([self.match.left.name or "", self.match.right.name or ""], N_TEAM)
        wanted = np.isin(names, list(teams)) if teams else np.ones(N_PLAYERS, np.bool_)
        there = (self.match.players["state"] & state_bits.STAND) != 0
        for start in range(0, len(there), _FRAMES_AT_ONCE):
            part = there[start : start + _FRAMES_AT_ONCE]
            each = np.concatenate([part, np.ones((len(part), 1), np.bool_)], axis=1)
            here = (part & wanted)[:, :, None] & each[:, None] & ~np.eye(N_PLAYERS, N_OBJECTS, dtype=np.bool_)
            frame, player, other = np.nonzero(here)
            yield self._table(frame + start, player, other)

    def _table(self, frame: NDArray[np.int64], player: NDArray[np.int64], other: NDArray[np.int64]) -> pa.Table:
        import pyarrow as pa

        sides, unums = np.repeat([1, -1, 0], [N_TEAM, N_TEAM, 1]), np.append(np.tile(np.arange(1, N_TEAM + 1), 2), 0)
        at, frames, sight, memory = (frame, player, other), self.match.frames, self.sight, self.memory
        what = pa.DictionaryArray.from_arrays(pa.array(sight.what[at].astype(np.int8)), pa.array(_WHAT))
        match_id = pa.DictionaryArray.from_arrays(np.zeros(len(frame), np.int8), pa.array([self.match.match_id]))
        return pa.table(
            {
                "match_id": match_id,
                "cycle": frames["cycle"][frame],
                "stoppage": frames["stoppage"][frame],
                "side": sides[player].astype(np.int8),
                "unum": unums[player].astype(np.uint8),
                "object_side": sides[other].astype(np.int8),
                "object_unum": unums[other].astype(np.uint8),
                "what": what,
                "distance": pa.array(sight.distance[at], from_pandas=True),
                "direction": pa.array(sight.direction[at], from_pandas=True),
                "distance_change": pa.array(sight.change[at][:, 0], from_pandas=True),
                "direction_change": pa.array(sight.change[at][:, 1], from_pandas=True),
                "x": memory.place[at][:, 0],
                "y": memory.place[at][:, 1],
                "vx": memory.velocity[at][:, 0],
                "vy": memory.velocity[at][:, 1],
                "age": memory.age[at],
            }
        )


def _by_age(age: NDArray[np.uint8], error: NDArray[np.float32]) -> tuple[KnownAtAge, ...]:
    made = []
    for first, last in AGES:
        found = error[(age >= first) & (age <= last)]
        share = len(found) / len(age) if len(age) else float("nan")
        middle = float(np.median(found)) if len(found) else float("nan")
        made.append(KnownAtAge(first=first, last=last, share=share, error_m=middle))
    return tuple(made)


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundPercepts:
    """The outcome for one log.

    Attributes:
        path: of the log. match_id, teams: see `MatchPercepts`; None and empty where the log could not be read.
        agreement: by the log of each player. faults: why others of these could not be compared.
        error: why the match could not be read, None where it could.
    """

    path: Path
    match_id: str | None = None
    teams: tuple[TeamPercepts, ...] = ()
    agreement: Mapping[Path, Agreement] = field(default_factory=dict)
    faults: tuple[str, ...] = ()
    error: str | None = None


def percepts_of_logs(
    pairs: Sequence[LogPair],
    *,
    out: Path | None = None,
    teams: Collection[str] = (),
    offline_logs: Sequence[Path] = (),
    on_progress: Callable[[int, int], None] | None = None,
) -> list[FoundPercepts]:
    """Work out the percepts of matches and write them into one file, match after match.

    A log that cannot be read does not stop the others. The file appears when it is whole.

    Args:
        pairs: logs, see ``find_matches``.
        out: the file; its name ends in one of ``tables.SUFFIXES``. None writes none.
        teams: of players of these teams only; empty for both.
        offline_logs: of players of the one match there is, see `MatchPercepts.agreement`.
        on_progress: called with the matches done and their number.

    Raises:
        UsageError: the ending of ``out`` is unknown, a team plays in none of the matches, or logs of players are given
            for several matches.
    """
    if offline_logs and len(pairs) > 1:
        raise UsageError(f"logs of players are of one match, got {len(pairs)}; name its game log")
    results: list[FoundPercepts] = []
    names: set[str] = set()
    with writing_if(out) as write:
        for path, found, error in of_each(pairs, MatchPercepts.of, on_progress=on_progress):
            if found is None:
                results.append(FoundPercepts(path=path, error=error))
                continue
            known = found.teams()
            names.update(team.team for team in known)
            compared, faults = _compared(found, offline_logs)
            results.append(
                FoundPercepts(
                    path=path,
                    match_id=found.match.match_id,
                    teams=tuple(team for team in known if not teams or team.team in teams),
                    agreement=compared,
                    faults=tuple(faults),
                )
            )
            if write is not None:
                for table in found.tables(teams=teams):
                    write(table)
        check_teams(teams, names)
    return results


def _compared(found: MatchPercepts, paths: Sequence[Path]) -> tuple[dict[Path, Agreement], list[str]]:
    made: dict[Path, Agreement] = {}
    faults = []
    for path in paths:
        try:
            made[path] = found.agreement(path)
        except LogError as error:
            faults.append(str(error))
    return made, faults
