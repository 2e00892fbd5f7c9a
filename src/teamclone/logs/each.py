"""Something made of each of many logs: one that cannot be read does not stop the others."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from pathlib import Path
from typing import TypeVar

from teamclone.errors import LogError, UsageError, choose
from teamclone.logs.match import Match
from teamclone.logs.read import LogPair, read_pair

Made = TypeVar("Made")


def of_each(
    pairs: Sequence[LogPair], make: Callable[[Match], Made], *, on_progress: Callable[[int, int], None] | None
) -> Iterator[tuple[Path, Made | None, str | None]]:
    """Give for each match its path and what was made of it, or else why its log could not be read.

    Args:
        pairs: logs, see ``find_matches``. make: may raise LogError.
        on_progress: called with the matches done and their number.
    """
    for done, pair in enumerate(pairs):
        if on_progress is not None:
            on_progress(done, len(pairs))
        try:
            made = make(read_pair(pair))
        except (LogError, OSError) as error:
            yield pair.path, None, str(error)
        else:
            yield pair.path, made, None
    if on_progress is not None:
        on_progress(len(pairs), len(pairs))


def check_teams(wanted: Collection[str], there: Collection[str]) -> None:
    """Raise unless teams are among those that play; where no match could be read nothing is known.

    Raises:
        UsageError: a team plays in none of the matches.
    """
    for team in wanted:
        if there and team not in there:
            raise UsageError(f"no team {team!r} plays in these matches; {choose(team, sorted(there))}")
