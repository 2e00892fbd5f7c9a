"""Checks of matches: of logs before they are ingested, and of the matches of a store."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from teamclone.errors import LogError, StoreError
from teamclone.logs import LogPair, Problem, Severity, find_matches, read_pair
from teamclone.store import convert, schema
from teamclone.store.checks import Finding, check_match
from teamclone.store.opening import open_store
from teamclone.store.physics import Physics, check_physics
from teamclone.store.store import Store
from teamclone.system.workers import Died, run_tasks

if TYPE_CHECKING:
    import pyarrow as pa

T = TypeVar("T", LogPair, tuple[str, str])

OnProgress = Callable[[int, int], None]
"""Called with the matches that are done and their number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchCheck:
    """The findings about one match.

    Attributes:
        name: its file, or its id in a store.
        error: why nothing could be read, else None.
        problems: problems of its files; none for a stored match, whose are in its table ``problems``.
        findings: the rules that its rows break.
        physics: what was compared with the server's physics; None if that was not asked for.
    """

    name: str
    match_id: str | None = None
    frames: int = 0
    commands: int = 0
    error: str | None = None
    problems: tuple[Problem, ...] = ()
    findings: tuple[Finding, ...] = ()
    physics: Physics | None = None

    @property
    def wrong(self) -> list[str]:
        """All problems but notes."""
        texts = [] if self.error is None else [self.error]
        texts += [str(problem) for problem in self.problems if problem.severity is not Severity.NOTE]
        return texts + [str(finding) for finding in self.findings]


def validate_logs(
    paths: Iterable[Path], *, physics: bool = False, jobs: int | None = None, on_progress: OnProgress | None = None
) -> Iterator[MatchCheck]:
    """Check every match in these files and folders, in the order of their paths. Writes nothing.

    Args:
        physics: compare every cycle of play with what the server makes of the one before, too.

    Raises:
        UsageError: a path does not exist, or there is no log under any of them.
    """
    tasks = find_matches(paths)
    yield from _in_order(partial(_validate_pair, physics=physics), tasks, jobs=jobs, on_progress=on_progress)


def validate_store(
    store: Store, *, physics: bool = False, jobs: int | None = None, on_progress: OnProgress | None = None
) -> Iterator[MatchCheck]:
    """Check every match of a store: its tables can be read, have the rows they should, and break no rule.

    ``physics`` as in `validate_logs`.
    """
    tasks = [(store.location, match_id) for match_id in store.match_ids()]
    yield from _in_order(partial(_validate_stored, physics=physics), tasks, jobs=jobs, on_progress=on_progress)


def _in_order(
    function: Callable[[T], MatchCheck], tasks: Sequence[T], *, jobs: int | None, on_progress: OnProgress | None
) -> Iterator[MatchCheck]:
    """Yield the checks of all tasks, in their order."""
    for done, (task, outcome) in enumerate(run_tasks(function, tasks, jobs=jobs, in_order=True), 1):
        if on_progress is not None:
            on_progress(done, len(tasks))
        yield _dead(task) if isinstance(outcome, Died) else outcome


def _dead(task: LogPair | tuple[str, str]) -> MatchCheck:
    name = str(task.path) if isinstance(task, LogPair) else task[1]
    return MatchCheck(name=name, error=f"{name}: the process that checked it was killed, perhaps out of memory")


def _validate_pair(pair: LogPair, *, physics: bool) -> MatchCheck:
    try:
        match = read_pair(pair)
        compared, findings = _check(convert.tables_of(match, recover=False), physics=physics)
    except LogError as error:
        return MatchCheck(name=str(pair.path), error=str(error))
    except OSError as error:
        return MatchCheck(name=str(pair.path), error=f"{pair.path}: {error.strerror or error}")
    except Exception as error:
        # A defect here must not cost the other matches.
        text = f"{pair.path}: could not be checked ({type(error).__name__}: {error}); please report this file"
        return MatchCheck(name=str(pair.path), error=text)
    return MatchCheck(
        name=str(pair.path),
        match_id=match.match_id,
        frames=len(match.frames["cycle"]),
        commands=len(match.commands["cycle"]),
        problems=match.problems,
        findings=findings,
        physics=compared,
    )


def _check(tables: Mapping[str, pa.Table], *, physics: bool) -> tuple[Physics | None, tuple[Finding, ...]]:
    """Return what the physics was compared with, if asked for, and all findings."""
    findings = check_match(tables)
    if not physics:
        return None, tuple(findings)
    compared, more = check_physics(tables)
    return compared, (*findings, *more)


def _validate_stored(task: tuple[str, str], *, physics: bool) -> MatchCheck:
    location, match_id = task
    store = open_store(location)
    try:
        tables = {table.name: store.read_table(match_id, table.name) for table in schema.MATCH_TABLES}
    except StoreError as error:
        return MatchCheck(name=match_id, match_id=match_id, error=str(error))
    about = tables[schema.MATCHES.name].to_pylist()
    if len(about) != 1:
        return MatchCheck(
            name=match_id, match_id=match_id, error=f"{match_id}: expected one row in matches, got {len(about)}"
        )
    for name in ("frames", "commands", "events", "problems"):
        if about[0][f"n_{name}"] != tables[name].num_rows:
            return MatchCheck(
                name=match_id,
                match_id=match_id,
                error=f"{match_id}: expected {about[0][f'n_{name}']} rows in {name}, got {tables[name].num_rows}; "
                "remove the match and ingest it again",
            )
    compared, findings = _check(tables, physics=physics)
    return MatchCheck(
        name=match_id,
        match_id=match_id,
        frames=about[0]["n_frames"],
        commands=about[0]["n_commands"],
        findings=findings,
        physics=compared,
    )
