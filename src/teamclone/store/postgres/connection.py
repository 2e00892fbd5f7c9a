"""Connections to a PostgreSQL server: kept, tried again while it is away, and its errors in words."""

from __future__ import annotations

import re
import time
import weakref
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from adbc_driver_manager import AdbcStatusCode, dbapi
from adbc_driver_postgresql.dbapi import connect as open_connection

from teamclone.errors import StoreError, UsageError
from teamclone.store.postgres.location import Location

T = TypeVar("T")

PAUSES_S = (0.0, 0.2, 0.5, 1.0, 2.0, 4.0, 8.0)
"""How long to wait before each new attempt to reach a server that was reached before: a restart takes seconds."""

FIRST_PAUSES_S = (0.2, 0.5, 1.0, 2.0)
"""How long to wait at first contact, when a wrong address is as likely as a restart."""

_TRANSIENT = re.compile(
    r"refused|no such file|starting up|shutting down|not yet accepting|recovery mode|too many clients|timeout expired|"
    r"closed the connection|reset by peer|unreachable|terminating connection",
    re.IGNORECASE,
)
"""Why a connection may fail now and succeed a moment later."""

_AGAIN = ("08", "57P01", "57P02", "57P03", "53300", "40001", "40P01")
"""SQLSTATEs (or their class) after which the same transaction may succeed: lost connections, restarts, deadlocks."""

_reached: set[str] = set()
"""The URIs of the servers that this process has connected to."""

ERRORS = (dbapi.Error, OSError)
"""Errors that the driver raises; the second while it reads the rows of an answer."""


class Connections:
    """The connections of a store to its server. They are kept for the next question; threads may share them."""

    def __init__(self, location: Location) -> None:
        self.location = location
        self._idle: deque[dbapi.Connection] = deque()
        weakref.finalize(self, _close_all, self._idle)

    def transaction(self, work: Callable[[dbapi.Cursor], T]) -> T:
        """Return the result of ``work``, done in one transaction: all of it, or nothing and an error."""

        def once() -> T:
            connection = self._idle.pop() if self._idle else self.connect()
            cursor = connection.cursor()
            try:
                cursor.execute("begin")
                result = work(cursor)
                cursor.execute("commit")
            except BaseException:
                close(cursor, connection)  # the server rolls back
                raise
            cursor.close()
            self._idle.append(connection)
            return result

        return self.again(once)

    def again(self, attempt: Callable[[], T], *, asked: bool = False) -> T:
        """Return the result of ``attempt``, tried again while the server is away.

        Raises:
            StoreError: the server stayed away, or refused.
            UsageError: with ``asked``, a query of the user's is wrong.
        """
        pauses = iter(PAUSES_S if self.location.uri in _reached else FIRST_PAUSES_S)
        while True:
            try:
                return attempt()
            except ERRORS as error:
                pause = next(pauses, None) if _passing(error) else None
                if pause is None:
                    raise self.failure(error, asked=asked) from None
                _close_all(self._idle)  # they are lost, too
                time.sleep(pause)

    def connect(self) -> dbapi.Connection:
        """Open a new connection, which commits after each statement; it is not kept."""
        connection: dbapi.Connection = open_connection(self.location.uri, autocommit=True)
        _reached.add(self.location.uri)
        return connection

    def failure(self, error: Exception, *, asked: bool = False) -> StoreError | UsageError:
        """Return the error for the user; ``asked``: the user's own query may be the cause."""
        state = getattr(error, "sqlstate", None) or ""
        message = _server_message(error)
        for password in self.location.passwords:
            message = message.replace(password, "***")
        shown = self.location.shown
        if _connecting(error):
            return StoreError(f"{shown}: cannot connect ({message}){_remedy(message)}")
        if _passing(error):
            return StoreError(
                f"{shown}: lost the connection ({message}); "
                "matches added before stay, try again when the server is back"
            )
        if asked and "multiple commands" in message:
            return UsageError("expected one SQL statement, got several")
        if asked and not state.startswith(("53", "58", "XX")):
            return UsageError(message)
        if state == "53100":
            return StoreError(f"{shown}: the server's disk is full; make room and ingest again, what is there stays")
        if state == "42501":
            return StoreError(f"{shown}: {message}; docs/howto/postgresql.md lists the rights that a user needs")
        return StoreError(f"{shown}: {message}")


def fetch(cursor: dbapi.Cursor, query: str, *values: str | None) -> list[dict[str, Any]]:
    """Run a query whose ``$1``, ``$2``, ... are ``values``, and return its rows as dicts by column."""
    cursor.execute(query, values or None)
    found: list[dict[str, Any]] = cursor.fetch_arrow_table().to_pylist()
    return found


def close(*handles: dbapi.Cursor | dbapi.Connection) -> None:
    """Close cursors and connections, in this order; errors are ignored, as the connection may be lost."""
    for handle in handles:
        with suppress(Exception):
            handle.close()


def _close_all(connections: deque[dbapi.Connection]) -> None:
    while connections:
        close(connections.pop())


def _connecting(error: Exception) -> bool:
    return "Failed to connect" in str(error)


def _passing(error: Exception) -> bool:
    """Return whether another attempt may succeed in a moment."""
    if state := getattr(error, "sqlstate", None):
        return bool(state.startswith(_AGAIN))
    if _connecting(error):
        return bool(_TRANSIENT.search(str(error)))
    if "ERROR: " in str(error):  # the server answers
        return False
    return isinstance(error, OSError) or getattr(error, "status_code", None) is AdbcStatusCode.IO


def _server_message(error: Exception) -> str:
    """Return the server's message, detail and hint on one line, without the query."""
    parts = re.findall(r"(?:ERROR|FATAL|PANIC|DETAIL|HINT): +(.+)", str(error))
    if not parts:
        first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        parts = [re.sub(r"^[A-Z_]+: (\[libpq\] )?(Failed to connect: )?", "", first)]
    return "; ".join(re.sub(r"\.? SQLSTATE: \w+$", "", text).strip().rstrip(".") for text in parts)


def _remedy(message: str) -> str:
    """Return advice about a connection that failed, to append to its error."""
    for sign, remedy in (
        ("password", "check user and password (PGPASSWORD and ~/.pgpass work, too)"),
        ('role "', "check the user"),
        ('database "', "make it with `createdb`, or name another"),
        ("host name", "check the host"),
        ("too many", "allow more connections, or use fewer --jobs"),
        ("invalid", "see docs/howto/postgresql.md for the form of the URL"),
    ):
        if sign in message:
            return f"; {remedy}"
    return "; does the server run there, and may you reach it?"
