"""The matches of one team in a store."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from teamclone.errors import StoreError, UsageError, choose
from teamclone.store import schema
from teamclone.store.postgres.location import masked
from teamclone.store.store import Store


@dataclass(frozen=True, slots=True, kw_only=True)
class TeamMatch:
    """A match of a team.

    Attributes:
        match_id: of the match.
        row: of the table ``matches``; empty where it cannot be read.
        side: of the team, 1 left or -1 right; where it plays against itself, left.
        opponent: name of the other team; None where there is none.
        error: why its row cannot be read; None where it can. Then nobody knows whether the team plays in it.
    """

    match_id: str
    row: dict[str, Any]
    side: int = 0
    opponent: str | None = None
    error: str | None = None

    @property
    def started(self) -> str:
        """When it began as ISO text, which sorts by time; empty where the log does not say."""
        started = self.row.get("started_at")
        return "" if started is None else str(started.isoformat(sep=" "))

    @property
    def uncontested(self) -> str | None:
        """Why it says nothing of the team against others; None if it does."""
        if not self.opponent:
            return "there is no opponent"
        return "the team plays against itself" if self.row["left_name"] == self.row["right_name"] else None


def matches_of(store: Store, team: str) -> list[TeamMatch]:
    """Return the matches of a team, and those of which nothing can be read, by id.

    Raises:
        UsageError: it has none.
        StoreError: the store cannot be read at all.
    """
    found, unread = matches_by_team(store)
    if team not in found:
        raise UsageError(f"{masked(store.location)}: no matches of {team!r}; {choose(team, sorted(found))}")
    return sorted([*found[team], *unread], key=lambda one: one.match_id)


def matches_by_team(store: Store) -> tuple[dict[str, list[TeamMatch]], list[TeamMatch]]:
    """Return the matches of every team by id, and those of which nothing can be read.

    Raises:
        StoreError: the store cannot be read at all.
    """
    found: dict[str, list[TeamMatch]] = {}
    unread: list[TeamMatch] = []
    for match_id in store.match_ids():
        try:
            (row,) = store.read_table(match_id, schema.MATCHES.name).to_pylist()
        except StoreError as error:
            unread.append(TeamMatch(match_id=match_id, row={}, error=str(error)))
            continue
        sides = {1: row["left_name"], -1: row["right_name"]}
        for team in dict.fromkeys(name for name in sides.values() if name):
            side = next(side for side, name in sides.items() if name == team)
            one = TeamMatch(match_id=match_id, row=row, side=side, opponent=sides[-side])
            found.setdefault(team, []).append(one)
    return found, unread
