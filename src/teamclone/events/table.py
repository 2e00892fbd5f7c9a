"""The events of matches as tables, and as files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from teamclone.errors import LogError
from teamclone.events.definitions import COLUMNS, EventKind
from teamclone.events.find import find_events
from teamclone.events.statistics import MatchStatistics, team_statistics
from teamclone.logs import LogPair, Match
from teamclone.logs.each import check_teams, of_each
from teamclone.logs.match import Columns
from teamclone.system.tables import writing_if

if TYPE_CHECKING:
    import pyarrow as pa


@dataclass(frozen=True, slots=True, kw_only=True, repr=False)
class MatchEvents:
    """The events of a match.

    Attributes:
        match_id: of the match. left, right: names of the teams, None for an empty side.
        columns: (n_events,) each, see the data model's table ``match_events``; texts are NumPy text arrays.
    """

    match_id: str
    left: str | None
    right: str | None
    columns: Columns

    @classmethod
    def of(cls, match: Match) -> MatchEvents:
        """Find the events of a match.

        Raises:
            LogError: there is no game log, or it has no frame.
        """
        if not len(match.frames["cycle"]):
            text = "expected frames to find events in, the log has none; name its game log (.rcg)"
            raise LogError(text, path=match.rcg_path or match.rcl_path)
        return cls(
            match_id=match.match_id,
            left=match.left.name,
            right=match.right.name,
            columns=find_events(match.frames, match.players, match.game.server_params),
        )

    def __repr__(self) -> str:
        return f"MatchEvents({self.left or 'nobody'} - {self.right or 'nobody'}, {len(self):,} events, {self.match_id})"

    def __len__(self) -> int:
        return len(self.columns["kind"])

    def statistics(self) -> MatchStatistics:
        """Return goals, shots, possession, passes and so on of both teams; needs the events of all kinds."""
        return team_statistics(self.columns)

    def select(self, *, kinds: Collection[EventKind] = (), teams: Collection[str] = ()) -> MatchEvents:
        """Return the events of some kinds and some teams, by name; empty for all."""
        kept = np.ones(len(self), np.bool_)
        if kinds:
            kept &= np.isin(self.columns["kind"], [kind.value for kind in kinds])
        if teams:
            kept &= np.isin(self.columns["side"], [side for side in (1, -1) if self.team(side) in teams])
        return MatchEvents(
            match_id=self.match_id,
            left=self.left,
            right=self.right,
            columns={name: values[kept] for name, values in self.columns.items()},
        )

    def team(self, side: int) -> str | None:
        """Return the name of the team on a side, 1 left or -1 right."""
        return self.left if side > 0 else self.right

    def counts(self) -> dict[str, int]:
        """Return the number of events by kind, of those kinds that there are."""
        found = Counter(self.columns["kind"].tolist())
        return {kind.value: found[kind.value] for kind in EventKind if found[kind.value]}

    def to_arrow(self) -> pa.Table:
        """Return an Arrow table: ``match_id`` and ``team``, the name of the one on ``side``, before the columns."""
        import pyarrow as pa

        names = np.array([self.team(1) or "", self.team(-1) or ""])
        side = self.columns["side"]
        arrays: dict[str, Any] = {
            "match_id": pa.array([self.match_id] * len(self), pa.string()),
            "team": pa.array(np.where(side == 0, "", names[(side < 0).astype(int)]), pa.string(), mask=side == 0),
        }
        return pa.table(
            arrays | {column.name: pa.array(self.columns[column.name], from_pandas=True) for column in COLUMNS}
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundEvents:
    """The outcome for one log.

    Attributes:
        path: of the log. events: what was found, all of it; None where the log could not be read.
        error: why; None where it could.
    """

    path: Path
    events: MatchEvents | None = None
    error: str | None = None


def events_of_logs(
    pairs: Sequence[LogPair],
    *,
    out: Path | None = None,
    kinds: Collection[EventKind] = (),
    teams: Collection[str] = (),
    on_progress: Callable[[int, int], None] | None = None,
) -> list[FoundEvents]:
    """Find the events of matches and write them into one file, match after match.

    A log that cannot be read does not stop the others. The file appears when it is whole, and not at all where no log
    could be read.

    Args:
        pairs: logs, see ``find_matches``.
        out: the file; its name ends in one of ``tables.SUFFIXES``. None writes none.
        kinds, teams: which events are written, see `MatchEvents.select`.
        on_progress: called with the matches done and their number.

    Returns:
        The outcome for each, in their order.

    Raises:
        UsageError: the ending of ``out`` is unknown, or a team plays in none of the matches.
    """
    results = []
    with writing_if(out) as write:
        for path, found, error in of_each(pairs, MatchEvents.of, on_progress=on_progress):
            results.append(FoundEvents(path=path, events=found, error=error))
            if found is not None and write is not None:
                write(found.select(kinds=kinds, teams=teams).to_arrow())
        events = [one.events for one in results if one.events is not None]
        check_teams(teams, {name for one in events for name in (one.left, one.right) if name})
    return results
