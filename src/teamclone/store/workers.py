"""Tasks over processes, where the death of a process costs only its own task."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Final, TypeVar

T = TypeVar("T")
R = TypeVar("R")


class Died:
    """The result of a task whose process ended before it answered: killed, or out of memory."""


DIED: Final = Died()


def available_cpus() -> int:
    """The processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_tasks(
    function: Callable[[T], R], tasks: Sequence[T], *, jobs: int | None = None
) -> Iterator[tuple[T, R | Died]]:
    """Each task with its result, in the order in which they end.

    Args:
        function: runs in another process, so it and the tasks must pickle. What it raises is raised here.
        jobs: how many processes; None for one a processor. With one job, or one task, all runs in this process.

    After an error, or if the caller stops early, tasks that already run are waited for and the others are dropped.
    """
    jobs = min(jobs or available_cpus(), len(tasks))
    if jobs <= 1:
        for task in tasks:
            yield task, function(task)
        return
    waiting = deque(tasks)
    while waiting:
        # Whoever was at work when a process died may have killed it: they are tried again, each alone.
        suspects: list[T] = []
        yield from _run_pool(function, waiting, jobs=jobs, unanswered=suspects)
        for task in suspects:
            unanswered: list[T] = []
            yield from _run_pool(function, deque([task]), jobs=1, unanswered=unanswered)
            if unanswered:
                yield task, DIED


def _run_pool(
    function: Callable[[T], R], waiting: deque[T], *, jobs: int, unanswered: list[T]
) -> Iterator[tuple[T, R | Died]]:
    """Work off ``waiting`` until it is empty or the pool breaks, which moves the tasks in flight to ``unanswered``."""
    # Spawned, not forked: threads of Arrow and DuckDB do not survive a fork.
    context = multiprocessing.get_context("spawn")
    flying: dict[Future[R], T] = {}
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_start_worker)
    try:
        while waiting or flying:
            try:
                while waiting and len(flying) < jobs:
                    flying[pool.submit(function, waiting[0])] = waiting[0]
                    waiting.popleft()
            except BrokenProcessPool:
                unanswered += flying.values()
                return
            done, _ = wait(flying, return_when=FIRST_COMPLETED)
            for future in done:
                task = flying.pop(future)
                try:
                    result = future.result()
                except BrokenProcessPool:
                    unanswered += [task, *flying.values()]
                    return
                yield task, result
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _start_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it: a killed parent must not leave processes behind."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
