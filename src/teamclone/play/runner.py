"""The matches of a schedule, many at once: gone on with where it stopped, tried again where one failed.

In the folder of a schedule, ``matches/ID`` is a whole match and appears at once, ``failed/ID/N`` holds the remains of
attempt N, with logs renamed so that no reader takes them for logs. Matches that are being played lie in ``.playing``.
"""

from __future__ import annotations

import errno
import json
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

from teamclone.errors import PlayError, StoreError, UsageError
from teamclone.play.ports import default_is_held, open_locks
from teamclone.play.processes import kill_marked
from teamclone.play.record import Fault, Record, Side, Trouble, bury_logs, load_record, save_record
from teamclone.play.schedule import Fixture, Schedule
from teamclone.play.server import find_server
from teamclone.play.supervisor import STOPPED, Order
from teamclone.store.ingest import ingest
from teamclone.store.store import Store
from teamclone.system.files import held
from teamclone.system.workers import Died, available_cpus, run_tasks

MATCHES = "matches"
FAILED = "failed"
_PLAYING = ".playing"
_LOCK = ".lock"
_POLL_S = 0.2
_END_S = 30.0
"""How long a supervisor has to end its match."""

_REMEDIES = {
    Fault.DISK_FULL: "make room and give the command again",
    Fault.SERVER_START: "mend the server or its options and give the command again",
}
"""Faults that every other match would have, too, and what to do; they are no attempt at a match."""

OnRecord = Callable[[Record], None]
"""Called with the record of a match, as soon as it is known."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlayReport:
    """The outcome of each match of a schedule.

    Attributes:
        records: of all matches, in the order of the schedule: the match, or the last attempt at it.
        played: how many were played now; the others were there before.
        failed_before: how many failed in an earlier call and were not tried again.
        seconds: how long it took.
    """

    records: tuple[Record, ...]
    played: int
    failed_before: int
    seconds: float

    @property
    def failed(self) -> tuple[Record, ...]:
        """Records of the matches that are not complete."""
        return tuple(record for record in self.records if not record.complete)

    def to_json(self) -> dict[str, Any]:
        """Return the report as ``teamclone play --json`` prints it."""
        return {
            "matches": len(self.records),
            "complete": len(self.records) - len(self.failed),
            "failed": len(self.failed),
            "played": self.played,
            "seconds": round(self.seconds, 2),
            "records": [record.to_json() for record in self.records],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class _Task:
    """``wanted`` is a file that is there as long as the match is wanted; all machines see ``out``."""

    fixture: Fixture
    attempts: int
    out: Path
    wanted: Path


def play(
    schedule: Schedule,
    out: Path,
    *,
    store: Store | None = None,
    executor: Executor | None = None,
    jobs: int | None = None,
    retry_failed: bool = False,
    on_progress: Callable[[int, int], None] = lambda done, total: None,
    on_record: OnRecord = lambda record: None,
    on_stop: Callable[[], None] = lambda: None,
) -> PlayReport:
    """Play the missing matches of a schedule.

    A match that failed is tried up to ``schedule.attempts`` times, then it counts as failed, also for the next call.
    A server that does not start, or a full disk, ends this at once and counts as no attempt.
    When this ends, however it ends, servers and clients end with it.

    Args:
        schedule: the matches, see `load_schedule`.
        out: the folder for the matches; it may hold those of an earlier call that was stopped or killed.
        store: each match is added to it as it ends, and those that were there before.
        executor: where matches are played, for example on a cluster (``cluster.executor_of``); its workers must see
            ``out`` and the teams under the same paths. None plays on this machine.
        jobs: how many at once, None for one a processor; in real time, where it must not be busy, one for two.
        retry_failed: forget the attempts at matches that failed before.
        on_progress: called with the number of matches that are complete or failed, and of all.
        on_record: called with the record of each match, as soon as it is known.
        on_stop: called where this ends early, also by Ctrl-C, before the matches that run are ended.

    Raises:
        UsageError: ``out`` holds matches of another schedule, or a worker does not see it.
        PlayError: there is no server or it does not start, another process plays into ``out``, the folder of the ports
            is another user's, or the disk is full; matches played stay.
        StoreError: the store cannot be written.
        ClusterError: the connection to the executor's workers was lost.
    """
    start = time.monotonic()
    out = out.resolve()
    if executor is None:
        find_server(schedule.fixtures[0].server)
        os.close(open_locks())
    with ExitStack() as stack:
        stack.enter_context(_to_itself(out))
        wanted = _wanted(out)
        if retry_failed:
            for fixture in schedule.fixtures:
                shutil.rmtree(out / FAILED / fixture.id, ignore_errors=True)
        records = _known_records(schedule, out)
        stored = _Stored(out, store)
        stored.add([record for record in records.values() if record.complete])
        failed_before = sum(not record.complete for record in records.values())
        tasks = [
            _Task(fixture=fixture, attempts=schedule.attempts, out=out, wanted=wanted)
            for fixture in schedule.fixtures
            if fixture.id not in records
        ]
        on_progress(len(records), len(schedule.fixtures))
        play_next: Callable[[_Task], Record] = _play_match
        if executor is None:
            play_next = _Turns(tasks, wanted).play
            threads = jobs or max(1, available_cpus() // (1 if schedule.fixtures[0].server.synch else 2))
            executor = stack.enter_context(ThreadPoolExecutor(threads, thread_name_prefix="match"))
        stack.callback(wanted.unlink, missing_ok=True)  # before the executor waits for its matches
        for task, result in run_tasks(play_next, tasks, executor=executor, on_stop=partial(_stop, wanted, on_stop)):
            record = _lost(task) if isinstance(result, Died) else result
            _stop_at(record)
            records[record.id] = record
            on_record(record)
            with suppress(StoreError):  # busy, perhaps: tried again with the next match, and at the end
                stored.add([record] if record.complete else [])
            on_progress(len(records), len(schedule.fixtures))
        stored.add([])
    return PlayReport(
        records=tuple(records[fixture.id] for fixture in schedule.fixtures),
        played=len(tasks),
        failed_before=failed_before,
        seconds=time.monotonic() - start,
    )


@contextmanager
def _to_itself(out: Path) -> Iterator[None]:
    """Have the folder of the matches for this process, without what others left half played.

    Raises:
        PlayError: another process plays into it.
    """
    for folder in (out / MATCHES, out / FAILED):
        folder.mkdir(parents=True, exist_ok=True)
    lock = out / _LOCK
    lock.touch()
    with held(lock, busy=PlayError(f"{out}: another process plays into it; wait for its end")):
        _clear(out / _PLAYING)
        try:
            yield
        finally:
            _clear(out / _PLAYING)


def _stop(wanted: Path, on_stop: Callable[[], None]) -> None:
    """Have the matches that run ended, and say so."""
    wanted.unlink(missing_ok=True)
    on_stop()


def _stop_at(record: Record) -> None:
    """Raise PlayError at a fault that every other match would have, too."""
    if record.trouble and record.trouble.fault in _REMEDIES:
        fault, text = record.trouble.fault, record.trouble.text
        raise PlayError(f"{fault} on {record.machine}: {text}; {_REMEDIES[fault]}, matches played stay")


def _clear(playing: Path) -> None:
    """Remove matches that are half played, and end the processes that still play them."""
    kill_marked(playing)
    shutil.rmtree(playing, ignore_errors=True)


def _wanted(out: Path) -> Path:
    """Make the file that is there as long as the matches are wanted.

    It has a folder of its own: workers that do not know yet that an earlier call is over may still write into theirs.
    """
    wanted = out / _PLAYING / uuid.uuid4().hex[:8] / "wanted"
    wanted.parent.mkdir(parents=True)
    wanted.touch()
    return wanted


def _known_records(schedule: Schedule, out: Path) -> dict[str, Record]:
    """Return the records of the matches that are not to be played, by id."""
    known = {fixture.id: _known(fixture, schedule.attempts, out) for fixture in schedule.fixtures}
    return {name: record for name, record in known.items() if record is not None}


def _known(fixture: Fixture, attempts: int, out: Path) -> Record | None:
    """Read the record of a match, or of its last attempt if there may be no more; None if it is to be played.

    Raises:
        UsageError: the match there was played otherwise than the schedule has it.
    """
    record = load_record(out / MATCHES / fixture.id)
    tries = _attempts(fixture, out)
    last = record or (tries[-1] if tries else None)
    if last is not None and last.fingerprint != fixture.fingerprint:
        raise UsageError(
            f"{fixture.id}: was played in {out} with other commands, options or seed than the schedule has now; "
            "choose another --out, or remove this match there"
        )
    return record or (last if len(tries) >= attempts else None)


def _attempts(fixture: Fixture, out: Path) -> list[Record]:
    """Read the records of failed attempts, in their order."""
    folders = (out / FAILED / fixture.id).glob("*")
    found = [load_record(folder) for folder in sorted(folders, key=lambda folder: (len(folder.name), folder.name))]
    return [record for record in found if record is not None]


class _Stored:
    """The matches of a folder, as they go into a store."""

    def __init__(self, out: Path, store: Store | None) -> None:
        self._matches, self._store = out / MATCHES, store
        self._waiting: list[Record] = []
        if store is not None:
            with store.writing():  # a store that cannot be written fails at once
                pass

    def add(self, records: Sequence[Record]) -> None:
        """Add these, and those that could not be added before.

        Raises:
            StoreError: the store cannot be written now; they are kept for the next time.
        """
        self._waiting += records
        if self._store is not None and self._waiting:
            ingest([self._matches / record.id for record in self._waiting], self._store, jobs=1)
        self._waiting = []


class _Turns:
    """The matches to play on this machine, each at the turn of a free slot.

    Those that need the default ports follow one another, and hold no slot while they wait as long as there are others.
    """

    def __init__(self, tasks: Sequence[_Task], wanted: Path) -> None:
        self._waiting = {task.fixture.id: task for task in tasks}
        self._wanted = wanted
        self._lock = Lock()
        self._has_default = False

    def play(self, _: _Task) -> Record:
        """Play the match whose turn it is, which is not always the given one."""
        task = self._next()
        while task is None:
            if not self._wanted.exists():
                raise UsageError("the matches are no longer wanted")
            time.sleep(_POLL_S)
            task = self._next()
        try:
            return _play_match(task)
        finally:
            if not task.fixture.takes_port:
                self._has_default = False

    def _next(self) -> _Task | None:
        """Take a match that can begin now; None where all that wait need the default ports, which are in use."""
        with self._lock:
            free = not self._has_default and not default_is_held()
            able = (task for task in self._waiting.values() if free or task.fixture.takes_port)
            task = next(able, None)
            if task is not None:
                del self._waiting[task.fixture.id]
                self._has_default |= not task.fixture.takes_port
            return task


def _play_match(task: _Task) -> Record:
    """Play a match in as many attempts as it takes. Runs in a thread, here or on a worker of a cluster.

    Raises:
        UsageError: this machine does not see the folder, or the match is no longer wanted.
        PlayError: there is no server.
    """
    if not task.wanted.exists():
        raise UsageError(
            f"{task.out}: the worker on {platform.node()} does not see this folder; put it on a file system that all "
            "machines have under the same path"
        )
    server = find_server(task.fixture.server)
    home = task.out / MATCHES / task.fixture.id
    record: Record | None = load_record(home)  # of a worker that died before it could answer
    for attempt in range(1 + len(_attempts(task.fixture, task.out)), 1 + task.attempts):
        if record is not None and record.complete:
            break
        folder = task.wanted.with_name(f"{task.fixture.id}.{uuid.uuid4().hex[:8]}")
        folder.mkdir()
        record = _attempt(Order(fixture=task.fixture, folder=folder, server=server, attempt=attempt), task.wanted)
        if record.trouble and record.trouble.fault in _REMEDIES:
            shutil.rmtree(folder, ignore_errors=True)
            break
        if record.complete:
            _put(folder, home)
        else:
            (task.out / FAILED / task.fixture.id).mkdir(exist_ok=True)
            _put(folder, task.out / FAILED / task.fixture.id / str(attempt))
    if record is None:
        raise AssertionError("a match with no attempt left was not to be played")
    return record


def _attempt(order: Order, wanted: Path) -> Record:
    """Have a supervisor make one attempt.

    Raises:
        UsageError: the match is no longer wanted.
    """
    with tempfile.TemporaryFile() as answer, (order.folder / "supervisor.txt").open("wb") as errors:
        supervisor = subprocess.Popen(
            (sys.executable, "-P", "-m", "teamclone.play.supervisor"),
            stdin=subprocess.PIPE,
            stdout=answer,
            stderr=errors,
            start_new_session=True,  # Ctrl-C is for us; the supervisors are then asked to stop
        )
        assert supervisor.stdin is not None
        with supervisor.stdin as order_stream:
            with suppress(BrokenPipeError):
                order_stream.write(json.dumps(order.to_json()).encode() + b"\n")
                order_stream.flush()
            while supervisor.poll() is None and wanted.exists():
                with suppress(subprocess.TimeoutExpired):
                    supervisor.wait(_POLL_S)
        try:
            code = supervisor.wait(_END_S)
        except subprocess.TimeoutExpired:
            supervisor.kill()
            code = supervisor.wait()
            kill_marked(order.folder)
        if code == STOPPED or not wanted.exists():
            raise UsageError(f"{order.fixture.id}: is no longer wanted")
        answer.seek(0)
        with suppress(ValueError, KeyError, TypeError):
            return Record.from_json(json.loads(answer.read()))
    kill_marked(order.folder)
    words = (order.folder / "supervisor.txt").read_text("utf-8", "replace").strip().splitlines()
    last = words[-1] if words else "it printed nothing"
    text = f"the process that looked after the match ended with code {code}: {last}"
    record = _unsupervised(order.fixture, order.attempt, text)
    bury_logs(order.folder)
    save_record(order.folder, record)
    return record


def _put(folder: Path, home: Path) -> None:
    """Rename a folder into place; another worker may have been quicker."""
    (folder / "supervisor.txt").unlink(missing_ok=True)
    try:
        folder.rename(home)
    except OSError as error:
        if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
            raise
        if load_record(home) is not None:
            shutil.rmtree(folder)
            return
        shutil.rmtree(home)
        folder.rename(home)


def _lost(task: _Task) -> Record:
    return _unsupervised(task.fixture, task.attempts, "the workers that played it died; it is tried again next time")


def _unsupervised(fixture: Fixture, attempt: int, text: str) -> Record:
    return Record(
        id=fixture.id,
        fingerprint=fixture.fingerprint,
        attempt=attempt,
        left=Side(team=fixture.left.name),
        right=Side(team=fixture.right.name),
        trouble=Trouble(fault=Fault.SUPERVISOR_DIED, text=text),
        machine=platform.node(),
        cpus=os.cpu_count() or 1,
    )
