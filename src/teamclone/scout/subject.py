"""Who is scouted, and by which matches."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from teamclone.scout.measures import Looks


@dataclass(frozen=True, slots=True, kw_only=True)
class Played:
    """A match of the team.

    Attributes:
        started_at: local time of the server's start as ISO text; None if the log has none.
        side: of the team, 1 left or -1 right.
        score: goals of the team and of the opponent.
        complete: the server closed its log.
    """

    match_id: str
    started_at: str | None
    opponent: str
    side: int
    score: tuple[int, int]
    complete: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """The scouted team.

    Attributes:
        team: its name. played: its matches, the oldest first.
        own: what each section kept of them, by its key. other: the same of the opponent of each match.
    """

    team: str
    played: Sequence[Played]
    own: Mapping[str, Looks]
    other: Mapping[str, Looks]
