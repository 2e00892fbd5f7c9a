"""Tasks over processes, here or on a cluster, where the death of a process costs only its own task."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    ThreadPoolExecutor,
    wait,
)
from itertools import islice
from typing import TYPE_CHECKING, Any, Final, TypeVar

from teamclone.errors import ClusterError

if TYPE_CHECKING:
    from multiprocessing.context import ForkServerContext, SpawnContext

T = TypeVar("T")
R = TypeVar("R")


class Died:
    """The result of a task whose process ended before it answered: killed, or out of memory."""


DIED: Final = Died()


def available_cpus() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def run_tasks(
    function: Callable[[T], R],
    tasks: Sequence[T],
    *,
    executor: Executor | None = None,
    jobs: int | None = None,
    ahead: int = 1024,
    in_order: bool = False,
    on_stop: Callable[[], None] = lambda: None,
) -> Iterator[tuple[T, R | Died]]:
    """Yield each task with its result.

    Args:
        function: runs in another process, so it and the tasks must pickle. What it raises is raised here.
        tasks: the arguments of ``function``, one for each call.
        executor: where the tasks run, for example on a Dask cluster. None starts processes on this machine.
        jobs: how many processes to start; None for one a processor. With one job, or one task, all runs in this
            process.
        ahead: how many tasks an executor is given before their results are taken, which bounds the memory.
        in_order: give the results in the order of the tasks instead of that in which they end.
        on_stop: called where the work ends early, before those that run are waited for.

    After an error, or if the caller stops early, tasks that already run are waited for and the others are dropped.

    Raises:
        ClusterError: the executor dropped a task, because the connection to its workers was lost.
    """
    if executor is not None:
        yield from _run(function, tasks, executor=executor, ahead=ahead, in_order=in_order, on_stop=on_stop)
        return
    jobs = min(jobs or available_cpus(), len(tasks))
    if jobs <= 1:
        for task in tasks:
            yield task, function(task)
        return
    with Processes(jobs) as processes:
        # For each task that runs another waits, so that no process does while results are taken.
        yield from _run(function, tasks, executor=processes, ahead=2 * jobs, in_order=in_order, on_stop=on_stop)


def _run(
    function: Callable[[T], R],
    tasks: Sequence[T],
    *,
    executor: Executor,
    ahead: int,
    in_order: bool,
    on_stop: Callable[[], None],
) -> Iterator[tuple[T, R | Died]]:
    waiting = iter(tasks)
    flying: dict[Future[R], T] = {}
    try:
        while True:
            for task in islice(waiting, ahead - len(flying)):
                flying[executor.submit(function, task)] = task
            if not flying:
                return
            for future in wait(list(flying)[: 1 if in_order else None], return_when=FIRST_COMPLETED).done:
                task = flying.pop(future)
                try:
                    result: R | Died = future.result()
                except _deaths():
                    result = DIED
                except CancelledError:
                    raise ClusterError(
                        "the connection to the workers was lost; give the same command again when they are back"
                    ) from None
                yield task, result
    finally:
        if flying:
            on_stop()
        for future in flying:
            future.cancel()
        wait(flying)


def _deaths() -> tuple[type[Exception], ...]:
    """Return the errors that executors raise for a task whose process died each time it was tried."""
    distributed = sys.modules.get("distributed")
    return (BrokenExecutor,) if distributed is None else (BrokenExecutor, distributed.KilledWorker)


class Processes(Executor):
    """Processes on this machine, each served by a thread: a dead one is replaced and its task tried once more."""

    def __init__(self, jobs: int) -> None:
        self._threads = ThreadPoolExecutor(jobs, thread_name_prefix="teamclone")
        self._own = threading.local()
        self._pools: list[ProcessPoolExecutor] = []

    def submit(self, function: Callable[..., R], /, *args: Any, **options: Any) -> Future[R]:
        """Run a call in a process; the future raises `BrokenExecutor` if two processes died of it."""
        return self._threads.submit(self._call, function, *args, **options)

    def _call(self, function: Callable[..., R], *args: Any, **options: Any) -> R:
        try:
            return self._pool(function).submit(function, *args, **options).result()
        except BrokenExecutor:
            self._own.pool = None
        try:
            return self._pool(function).submit(function, *args, **options).result()
        except BrokenExecutor:
            self._own.pool = None
            raise

    def _pool(self, function: Callable[..., Any]) -> ProcessPoolExecutor:
        """Return the one process of this thread, started for a function if there is none."""
        pool: ProcessPoolExecutor | None = getattr(self._own, "pool", None)
        if pool is None:
            context = process_context(function.__module__)
            pool = self._own.pool = ProcessPoolExecutor(1, mp_context=context, initializer=start_worker)
            self._pools.append(pool)
        return pool

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the processes; ``wait`` and ``cancel_futures`` as in `concurrent.futures.Executor.shutdown`."""
        self._threads.shutdown(wait, cancel_futures=cancel_futures)
        for pool in self._pools:
            pool.shutdown(wait)


def process_context(module: str) -> SpawnContext | ForkServerContext:
    """Return how processes for the functions of a module are started, each without the threads of this one.

    Where the system can, a server that imports the module once forks them, so that many are there as soon as one. A
    fork of this process would not do: threads of Arrow and DuckDB do not survive it.
    """
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["__main__", module])  # does nothing if the server runs
    return context


def start_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it: a killed parent must not leave processes behind."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is None:
        return

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
