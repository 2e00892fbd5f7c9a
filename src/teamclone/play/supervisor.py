"""The process that looks after one match: has it played, reads its logs, reports the outcome.

Run as ``python -m teamclone.play.supervisor``, with an `Order` as JSON in a line on standard input, which then stays
open: its end is the request to stop, so that a supervisor ends with the process that asked for the match. The `Record`
goes to standard output.
"""

from __future__ import annotations

import dataclasses
import json
import os
import platform
import shutil
import sys
import time
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, Self

from teamclone import __version__
from teamclone.logs.match import Match
from teamclone.play.game import SIDES, Game, StoppedError
from teamclone.play.holes import Holes
from teamclone.play.processes import adopt_orphans
from teamclone.play.record import FailedError, Fault, Record, Side, Trouble, bury_logs, save_record
from teamclone.play.schedule import Fixture
from teamclone.play.server import coach_connected, gave_up, hashes, programs_of, server_report
from teamclone.play.verdict import read_logs, verdict
from teamclone.rcss.players import N_TEAM

STOPPED = 3
"""Exit code of a supervisor that was asked to stop."""

FULL = 1 << 20
"""If fewer bytes than this can be written, a failure is attributed to the full disk."""

_PERHAPS_FULL = (Fault.SERVER_START, Fault.SERVER_DIED, Fault.BAD_LOGS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Order:
    """One attempt to make: ``folder`` is there and empty, ``server`` is the server's program."""

    fixture: Fixture
    folder: Path
    server: Path
    attempt: int

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name, for a JSON document; `from_json` is the inverse."""
        return {
            "fixture": self.fixture.to_json(),
            "folder": str(self.folder),
            "server": str(self.server),
            "attempt": self.attempt,
        }

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Self:
        """Make an order from the fields that `to_json` returned."""
        return cls(
            fixture=Fixture.from_json(values["fixture"]),
            folder=Path(values["folder"]),
            server=Path(values["server"]),
            attempt=values["attempt"],
        )


def supervise(order: Order) -> Record:
    """Play a match as ordered and return its record; no process of it runs afterwards.

    Raises:
        StoppedError: the match is no longer wanted.
    """
    game = Game(order.fixture, folder=order.folder, program=order.server)
    failed: FailedError | None = None
    try:
        game.play()
    except FailedError as error:
        failed = error
    except OSError as error:  # of our own files
        failed = FailedError(Fault.DISK_FULL if _is_full(order.folder) else Fault.SUPERVISOR_DIED, f"{error}")
    finally:
        exits = game.finish(failed=failed is not None)
    match, holes, problem = read_logs(order.folder)
    if failed is None:
        failed = verdict(order.fixture, match, holes, problem, gave_up=gave_up(game.server_output()))
    if failed is not None and failed.fault in _PERHAPS_FULL and _is_full(order.folder):
        failed = FailedError(Fault.DISK_FULL, f"no room is left ({failed.text})")
    shutil.rmtree(order.folder / "conf", ignore_errors=True)
    if failed is not None:
        bury_logs(order.folder)
    seconds, now = time.monotonic() - game.began_at, datetime.now(UTC)
    record = _record(order, game, failed=failed, match=match, holes=holes, exits=exits)
    return dataclasses.replace(
        record,
        started=(now - timedelta(seconds=seconds)).isoformat(timespec="seconds"),
        seconds=round(seconds, 2),
        play_seconds=round(game.end_at - game.kick_off_at, 2) if game.end_at and game.kick_off_at else 0.0,
    )


def _record(
    order: Order,
    game: Game,
    *,
    failed: FailedError | None,
    match: Match | None,
    holes: Holes | None,
    exits: dict[str, dict[str, int | None]],
) -> Record:
    fixture, output = order.fixture, game.server_output()
    cycle = game.show.cycle if game.show else None
    sides = []
    for side, team in enumerate(game.teams):
        played = None if match is None else (match.left, match.right)[side]
        name = played.name if played else game.show.names[side] if game.show else None
        mine = slice(side * N_TEAM, (side + 1) * N_TEAM)
        counts = {
            name: None if holes is None or failed else tuple(int(count) for count in getattr(holes, name)[mine])
            for name in ("holes", "clashes", "missed")
        }
        commands = [words for label, words in game.commands.items() if label.startswith(f"{SIDES[side]}-")]
        sides.append(
            Side(
                team=team.name,
                name=name,
                coach=coach_connected(output, name),
                score=played.score if played else 0,
                files=hashes(programs_of(Path(team.folder), commands)),
                exits=exits[SIDES[side]],
                **counts,
            )
        )
    trouble = None
    if failed is not None:
        side_name = None if failed.side is None else SIDES[failed.side]
        trouble = Trouble(fault=failed.fault, text=failed.text, side=side_name, unums=failed.unums, cycle=cycle)
    return Record(
        id=fixture.id,
        fingerprint=fixture.fingerprint,
        attempt=order.attempt,
        left=sides[0],
        right=sides[1],
        trouble=trouble,
        cycles=int(match.frames["cycle"][-1]) if match and len(match.frames["cycle"]) else 0,
        logs=tuple(sorted(path.name for path in order.folder.glob("*.rc[gl]*"))),
        server={
            **server_report(output),
            "files": hashes([order.server]),
            "options": fixture.server.options,
            "player_types_seed": fixture.seed,
        },
        commands=game.commands,
        ports=tuple(game.port + offset for offset in range(3)) if game.port else (),
        machine=platform.node(),
        cpus=os.cpu_count() or 1,
        teamclone=__version__,
    )


def _is_full(folder: Path) -> bool:
    """Return whether the disk is full. It is tried, since quotas count, too."""
    test = folder / "room"
    try:
        test.write_bytes(bytes(FULL))
    except OSError:
        return True
    finally:
        test.unlink(missing_ok=True)
    return False


def _make_last(folder: Path) -> None:
    """Sync the logs to disk before the match counts as complete."""
    for path in folder.glob("*.rc[gl]*"):
        with path.open("rb") as file:
            os.fsync(file.fileno())


def main() -> None:
    """Read an order, carry it out, and print the record."""
    line = b""
    while not line.endswith(b"\n"):  # byte by byte: a buffer would hide the end of the stream
        line += os.read(0, 1) or b"\n"
    if not line.strip():
        sys.exit(STOPPED)
    adopt_orphans()
    order = Order.from_json(json.loads(line))
    try:
        record = supervise(order)
    except StoppedError:
        sys.exit(STOPPED)
    try:
        _make_last(order.folder)
        save_record(order.folder, record)
    except OSError as error:
        trouble = Trouble(fault=Fault.DISK_FULL, text=f"the match cannot be kept ({error.strerror or error})")
        record = dataclasses.replace(record, trouble=trouble)
    json.dump(record.to_json(), sys.stdout)


if __name__ == "__main__":
    main()
