"""From log files to a store: one task a match, one status row a file, nothing read twice."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Executor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from teamclone.errors import LogError, TeamcloneError, UsageError
from teamclone.logs import LogPair, Severity, find_matches, read_pair
from teamclone.logs.match import Match
from teamclone.store.shared import SharedStore
from teamclone.store.status import FileOutcome, FileStatus, stamp
from teamclone.store.store import Added, Store
from teamclone.system.files import digest
from teamclone.system.workers import DIED, Died, run_tasks

OnProgress = Callable[[int, int], None]
"""Called with the matches that are done and their number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class IngestReport:
    """The result of an ingest.

    Attributes:
        files: the status of every file that was named, by path, also of those that were in the store before.
        added, replaced, unchanged: number of matches.
        seconds: how long it took.
    """

    files: tuple[FileStatus, ...]
    added: int
    replaced: int
    unchanged: int
    seconds: float

    def count(self, outcome: FileOutcome) -> int:
        """Return the number of files with this outcome."""
        return sum(status.outcome is outcome for status in self.files)

    def to_json(self) -> dict[str, Any]:
        """Return the counts, the seconds and the status of each file, as ``teamclone ingest --json`` prints them."""
        return {
            "matches": {"added": self.added, "replaced": self.replaced, "unchanged": self.unchanged},
            "files": {str(outcome): self.count(outcome) for outcome in FileOutcome},
            "seconds": round(self.seconds, 3),
            "status": [status.to_json() for status in self.files],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Task:
    store: SharedStore
    pair: LogPair
    strict: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class _Result:
    """``added`` is None where nothing could be read; ``machine`` is the one that tried."""

    statuses: tuple[FileStatus, ...]
    added: Added | None = None
    machine: str = field(default_factory=platform.node)


def ingest(
    paths: Iterable[Path],
    store: Store,
    *,
    executor: Executor | None = None,
    jobs: int | None = None,
    strict: bool = False,
    on_progress: OnProgress | None = None,
) -> IngestReport:
    """Read the logs in these files and folders into a store.

    A file that was read before and has not changed is not read again, a match that the store has is not written
    again, so that an ingest can be stopped, killed and repeated. Files that failed are tried again. A file that cannot
    be read, or whose process dies, gets its status row and the others go on.

    Args:
        paths: logs and folders; a log finds its partner, folders are searched through.
        store: the store to add to.
        executor: where matches are read, for example on a cluster (``cluster.executor_of``); its workers must see the
            logs and the store under the same paths. None starts processes on this machine.
        jobs: how many, None for one a processor. More than one needs the usual ``if __name__ == "__main__"`` guard.
        strict: stop at the first file from which something is lost; matches added before stay.
        on_progress: called with the matches that are done and their number.

    Raises:
        UsageError: a path does not exist, here or for a worker, or there is no log under any of them.
        StoreError: the store cannot be written, or a worker does not see it.
        ClusterError: the connection to the executor's workers was lost; matches added before stay.
        LogError: with ``strict``, the first thing that was wrong.
    """
    start = time.monotonic()
    # Workers on other machines have another current folder.
    pairs = find_matches(paths if executor is None else [path.absolute() for path in paths])
    counts = dict.fromkeys(Added, 0)
    with store.writing():
        known = {status.path: status for status in store.files()}
        present = set(store.match_ids())
        found: dict[str, FileStatus] = {}
        shared = SharedStore.of(store)
        tasks = []
        for pair in pairs:
            before = _up_to_date(pair, known=known, present=present)
            if before is None:
                tasks.append(_Task(store=shared, pair=pair, strict=strict))
                continue
            counts[Added.UNCHANGED] += 1
            found |= {status.path: status for status in before}
        done = len(pairs) - len(tasks)
        if on_progress is not None:
            on_progress(done, len(pairs))
        for task, outcome in run_tasks(_ingest_one, tasks, executor=executor, jobs=jobs):
            result = _died(task) if isinstance(outcome, Died) else outcome
            if executor is not None:
                _check_seen(result)
            if strict and outcome is DIED:
                raise LogError(str(result.statuses[0].error), path=task.pair.path)
            store.save_files(result.statuses)
            if result.added is not None:
                # What a worker added before it died, the next one finds there.
                ids = {status.match_id for status in result.statuses if status.match_id is not None}
                new = result.added is Added.UNCHANGED and ids.isdisjoint(present)
                counts[Added.ADDED if new else result.added] += 1
                present |= ids
            _forget_superseded(store, result.statuses, known=known)
            rows = {status.path: status for status in result.statuses}
            found |= rows
            known |= rows
            done += 1
            if on_progress is not None:
                on_progress(done, len(pairs))
    return IngestReport(
        files=tuple(found[path] for path in sorted(found)),
        added=counts[Added.ADDED],
        replaced=counts[Added.REPLACED],
        unchanged=counts[Added.UNCHANGED],
        seconds=time.monotonic() - start,
    )


def files_of(pair: LogPair) -> tuple[Path, ...]:
    """Return the one or two files of a match."""
    return tuple(path for path in (pair.rcg, pair.rcl) if path is not None)


def _up_to_date(pair: LogPair, *, known: dict[str, FileStatus], present: set[str]) -> tuple[FileStatus, ...] | None:
    """Return the status rows of a pair that needs no reading; None if it does."""
    statuses = []
    for path in files_of(pair):
        status = known.get(str(path.absolute()))
        if status is None or not status.describes(path):
            return None
        statuses.append(status)
    # A bad command log beside a good game log stays as it is; a match of which nothing was kept is tried again.
    ids = {status.match_id for status in statuses} - {None}
    return tuple(statuses) if ids and ids <= present else None


def _ingest_one(task: _Task) -> _Result:
    """Read one match and add it to the store; runs in a worker."""
    # Looked at before reading, so that a file that grows meanwhile is read again next time.
    stamps = {path: stamp(path) for path in files_of(task.pair)}
    try:
        match = read_pair(task.pair)
    except TeamcloneError as error:
        if task.strict:
            raise
        return _failed(task.pair, str(error), stamps)
    except OSError as error:
        text = f"{task.pair.path}: {error.strerror or error}"
        if task.strict:
            raise LogError(error.strerror or str(error), path=task.pair.path) from error
        return _failed(task.pair, text, stamps)
    except Exception as error:
        # A defect of the reader must not cost the other files.
        text = f"{task.pair.path}: could not be read ({type(error).__name__}: {error}); please report this file"
        if task.strict:
            raise
        return _failed(task.pair, text, stamps)
    statuses = tuple(_status(match, path, stamps[path]) for path in files_of(task.pair))
    if task.strict:
        for status in statuses:
            if status.outcome is not FileOutcome.OK:
                raise LogError(f"{status.error} (--strict)")
    try:
        return _Result(statuses=statuses, added=task.store.open().add(match))
    except (TeamcloneError, OSError):  # of the store, which all matches need
        raise
    except Exception as error:
        if task.strict:
            raise
        text = f"{task.pair.path}: could not be stored ({type(error).__name__}: {error}); please report this file"
        return _failed(task.pair, text, stamps)


def _check_seen(result: _Result) -> None:
    """Raise if this machine sees a log that the worker did not: else a wrong mount would cost every match."""
    for status in result.statuses:
        if status.size < 0 and Path(status.path).exists():
            raise UsageError(
                f"{status.path}: the worker on {result.machine} does not see this file; put the logs on a file system "
                "that all machines have under the same path"
            )


def _status(match: Match, path: Path, stamped: tuple[int, int]) -> FileStatus:
    """Return the status row of one of a match's files."""
    wrong = [
        problem for problem in match.problems if problem.path in (None, path) and problem.severity is not Severity.NOTE
    ]
    if path == match.rcg_path:
        rows, content, outcome = len(match.frames["cycle"]), match.match_id, FileOutcome.OK
    elif path == match.rcl_path and match.log is not None:
        rows, content, outcome = len(match.commands["cycle"]), digest(match.log.text), FileOutcome.OK
    else:
        rows, content, outcome = 0, None, FileOutcome.FAILED
    if wrong and outcome is FileOutcome.OK:
        outcome = FileOutcome.PARTIAL
    return FileStatus(
        path=str(path.absolute()),
        outcome=outcome,
        rows=rows,
        match_id=match.match_id if outcome is not FileOutcome.FAILED else None,
        error=str(wrong[0]) if wrong else None,
        size=stamped[0],
        mtime_ns=stamped[1],
        content=content,
    )


def _failed(pair: LogPair, text: str, stamps: dict[Path, tuple[int, int]]) -> _Result:
    return _Result(
        statuses=tuple(
            FileStatus(
                path=str(path.absolute()),
                outcome=FileOutcome.FAILED,
                rows=0,
                match_id=None,
                error=text,
                size=size,
                mtime_ns=mtime_ns,
                content=None,
            )
            for path, (size, mtime_ns) in stamps.items()
        )
    )


def _died(task: _Task) -> _Result:
    text = f"{task.pair.path}: the process that read it was killed, perhaps out of memory; try again with --jobs 1"
    return _failed(task.pair, text, {path: stamp(path) for path in files_of(task.pair)})


def _forget_superseded(store: Store, statuses: tuple[FileStatus, ...], *, known: dict[str, FileStatus]) -> None:
    """Drop the match that a changed file gave before, unless another file still gives it."""
    now = {status.path: status for status in statuses}
    before = {known[path].match_id for path in now if path in known} - {status.match_id for status in statuses} - {None}
    for match_id in before:
        if match_id is not None and not any(
            status.match_id == match_id for path, status in known.items() if path not in now
        ):
            store.remove(match_id)
