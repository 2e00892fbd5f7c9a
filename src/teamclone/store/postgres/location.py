"""The URL of a store in PostgreSQL: its parts, and the form for messages, without passwords."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Self
from urllib.parse import parse_qsl, unquote

from teamclone.errors import UsageError

SCHEMA = "teamclone"
"""The schema of a URL that names none."""

DEFAULTS = {
    "connect_timeout": "10",
    "fallback_application_name": "teamclone",
    # A host that vanished is noticed after a minute, not after hours.
    "keepalives_idle": "30",
    "keepalives_interval": "10",
    "keepalives_count": "3",
}
"""Settings of the connection that a URL may override."""


class Secret(str):
    """A URL whose ``repr`` hides its password, also inside the ``repr`` of other objects."""

    __slots__ = ()

    def __repr__(self) -> str:
        return repr(masked(self))


def masked(location: str) -> str:
    """Return the URL with ``***`` for its password.

    Up to the last @, since a password may hold one that is not encoded.
    """
    location = re.sub(r"^(\w+://[^:@/?]*):.*@", r"\1:***@", location, flags=re.DOTALL)
    return re.sub(r"(password=)[^&]*", r"\1***", location)


@dataclass(frozen=True, slots=True, kw_only=True)
class Location:
    """A URL ``postgresql://user:password@host:port/database?schema=...``, taken apart.

    Attributes:
        url: the URL.
        uri: the URL for libpq: without ``schema``, with ``DEFAULTS``.
        schema: the schema that holds the tables.
        shown: the URL for messages.
        passwords: texts that messages must not show.
    """

    url: Secret
    uri: Secret
    schema: str
    shown: str
    passwords: tuple[str, ...]

    @classmethod
    def parse(cls, url: str) -> Self:
        """Read a URL.

        Raises:
            UsageError: a part of the URL is wrong; the text does not show its password.
        """
        base, _, query = url.partition("?")
        shown = masked(url)
        authority, slash, path = base.partition("://")[2].partition("/")
        if "@" in path or "@" in authority.rpartition("@")[0] or "#" in base or ("@" in query and "@" not in base):
            raise UsageError(
                f"{shown}: expected postgresql://USER:PASSWORD@HOST:PORT/DATABASE; in the password write %40 for @, "
                "%2F for /, %3F for ?, %23 for #, or leave it to PGPASSWORD or ~/.pgpass"
            )
        options = dict(parse_qsl(query, keep_blank_values=True))
        name = options.pop("schema", SCHEMA)
        if not name or "\0" in name or name.startswith("pg_"):
            raise UsageError(f"{shown}: schema {name!r} cannot be used, name another one with ?schema=")
        kept = [part for part in query.split("&") if part and not part.startswith("schema=")]
        kept += [f"{option}={value}" for option, value in DEFAULTS.items() if option not in options]
        _, _, password = authority.rpartition("@")[0].partition(":")
        passwords = {password, unquote(password), options.get("password", ""), options.get("sslpassword", "")}
        return cls(
            url=Secret(url),
            uri=Secret(f"{base}{'' if slash else '/'}?{'&'.join(kept)}"),
            schema=name,
            shown=shown,
            passwords=tuple(sorted(passwords - {""}, key=len, reverse=True)),
        )
