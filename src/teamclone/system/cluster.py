"""An existing Dask cluster as an executor."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, TypeVar

from teamclone import __version__
from teamclone.errors import ClusterError, UsageError

if TYPE_CHECKING:
    from distributed import Client

R = TypeVar("R")

CONNECT_SECONDS = 10
"""How long a scheduler, and the first of its workers, may take to answer."""

CLOSE_SECONDS = 2
"""How long to wait for a scheduler when all is done; it may be gone."""


@contextmanager
def executor_of(scheduler: str | None, *, jobs: int | None = None) -> Iterator[Executor | None]:
    """Open an executor of the cluster at this address; None without an address, for processes on this machine.

    Args:
        scheduler: ``tcp://host:port``.
        jobs: the user's number of processes, which must be None: a cluster has its own.

    Raises:
        UsageError: the address is no address, or ``jobs`` is given for a cluster.
        ClusterError: no scheduler answers, or there are no workers, or they run another version of teamclone.
    """
    if scheduler is None:
        yield None
        return
    if jobs is not None:
        raise UsageError("--jobs is for processes on this machine; leave it out with --scheduler")
    if not re.fullmatch(r"\w+://.+:\d+", scheduler):
        raise UsageError(f"--scheduler {scheduler!r}: expected the address of a Dask scheduler, tcp://host:port")
    from distributed import Client

    # A lost connection becomes one line of ours instead of Dask's log.
    for name in ("distributed", "distributed.client", "tornado.application"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        client = Client(scheduler, timeout=CONNECT_SECONDS, set_as_default=False)
    except (OSError, ValueError) as error:
        raise ClusterError(
            f"{scheduler}: no Dask scheduler answers ({' '.join(str(error).split())}); "
            "start one with `dask scheduler`, or leave --scheduler out to work on this machine"
        ) from None
    try:
        _check_workers(client, scheduler)
        yield _Cluster(client)
    finally:
        client.close(timeout=CLOSE_SECONDS)


class _Cluster(Executor):
    """A replacement of ``Client.get_executor``: its futures never end if the scheduler goes while they wait."""

    def __init__(self, client: Client) -> None:
        self._client = client

    def submit(self, function: Callable[..., R], /, *args: Any, **options: Any) -> Future[R]:
        from distributed.comm.core import CommClosedError

        answer: Future[R] = Future()

        def pass_on(asked: Any) -> None:
            if not answer.set_running_or_notify_cancel():
                return
            try:
                answer.set_result(asked.result())
            except CommClosedError:
                answer.set_exception(CancelledError())
            except BaseException as error:
                answer.set_exception(error)

        # Not pure: the same files give another result once they have changed.
        self._client.submit(function, *args, pure=False, **options).add_done_callback(pass_on)
        return answer


def _check_workers(client: Client, scheduler: str) -> None:
    try:
        client.wait_for_workers(1, timeout=CONNECT_SECONDS)
    except TimeoutError:
        raise ClusterError(f"{scheduler}: has no workers; start some with `dask worker {scheduler}`") from None
    for worker, found in client.run(_version, on_error="return").items():
        if found != __version__:
            what = f"has teamclone {found}" if isinstance(found, str) else f"cannot load teamclone ({found})"
            raise ClusterError(f"{scheduler}: the worker {worker} {what}, expected {__version__}; install it there")


def _version() -> str:
    return __version__
