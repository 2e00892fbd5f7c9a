"""``match.json``: what became of a match, and all that is needed to say how it was played."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

from teamclone.errors import PlayError
from teamclone.system.files import write_json

FORMAT = 1
NAME = "match.json"


class Fault(StrEnum):
    """Why a match did not come to its end."""

    NO_PORT = "no port"
    """The ports it needs are in use."""
    SERVER_START = "server did not start"
    SERVER_DIED = "server died"
    STALLED = "server stalled"
    TEAM_START = "team did not start"
    NOT_CONNECTED = "never connected"
    CRASHED = "crashed"
    """Clients that had connected are gone."""
    HUNG = "hung"
    """Clients that are there and send nothing."""
    TOO_LONG = "took too long"
    DISK_FULL = "disk full"
    BAD_LOGS = "logs not whole"
    KEEPER_DIED = "keeper died"
    """The process that looks after a match was killed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble:
    """A fault: what happened, in words, and whose it was.

    Attributes:
        side: "left" or "right" where a team is at fault, else None.
        unums: the players concerned, where they are known.
        cycle: of the server, 0 before the kick-off; None where it was never seen.
    """

    fault: Fault
    text: str
    side: str | None = None
    unums: tuple[int, ...] = ()
    cycle: int | None = None

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Self:
        return cls(**{**values, "fault": Fault(values["fault"]), "unums": tuple(values["unums"])})


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """A team in a match.

    Attributes:
        team: its name in the plan.
        name: its name in the logs; None where it never came.
        score: goals.
        holes, clashes, missed: of players 1 to 11, see `holes`; None where there are no whole logs.
        files: SHA-256 of its programs, by path.
        exits: how its processes ended, by label: an exit code, or a signal as a negative number.
    """

    team: str
    name: str | None = None
    score: int = 0
    holes: tuple[int, ...] | None = None
    clashes: tuple[int, ...] | None = None
    missed: tuple[int, ...] | None = None
    files: dict[str, str] = field(default_factory=dict)
    exits: dict[str, int | None] = field(default_factory=dict)

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Self:
        lists = {
            name: value and tuple(value) for name, value in values.items() if name in ("holes", "clashes", "missed")
        }
        return cls(**{**values, **lists})


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """What one attempt at a match came to. It is a match, and data, if ``trouble`` is None.

    Attributes:
        id, fingerprint: of the fixture.
        attempt: from 1.
        cycles: time of the last frame.
        logs: names of the game log and the command log.
        server: version, path, hash and options of the server, the seeds, cycles that it waited for clients in vain.
        commands: of each process that was started, by label.
        ports: of players, trainer and online coaches.
        machine, cpus: where it was played.
        started: UTC, ISO 8601.
        seconds: wall time of the whole attempt; ``play_seconds`` from the kick-off to the end.
    """

    id: str
    fingerprint: str
    attempt: int
    left: Side
    right: Side
    trouble: Trouble | None = None
    cycles: int = 0
    logs: tuple[str, ...] = ()
    server: dict[str, Any] = field(default_factory=dict)
    commands: dict[str, list[str]] = field(default_factory=dict)
    ports: tuple[int, ...] = ()
    machine: str = ""
    cpus: int = 0
    started: str = ""
    seconds: float = 0.0
    play_seconds: float = 0.0
    teamclone: str = ""

    @property
    def complete(self) -> bool:
        return self.trouble is None

    def to_json(self) -> dict[str, Any]:
        return {"format": FORMAT, "outcome": "complete" if self.complete else "failed", **dataclasses.asdict(self)}

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Self:
        kept = {name: value for name, value in values.items() if name not in ("format", "outcome")}
        kept["trouble"] = kept["trouble"] and Trouble.from_json(kept["trouble"])
        kept |= {side: Side.from_json(kept[side]) for side in ("left", "right")}
        kept |= {name: tuple(kept[name]) for name in ("logs", "ports")}
        return cls(**kept)


def bury_logs(folder: Path) -> None:
    """Rename the logs of what is no match, so that no reader takes them for one."""
    for path in [*folder.glob("*.rcg*"), *folder.glob("*.rcl*")]:
        path.rename(f"{path}.failed")


def save_record(folder: Path, record: Record) -> None:
    write_json(folder / NAME, record.to_json())


def load_record(folder: Path) -> Record | None:
    """The record in a folder; None where there is none.

    Raises:
        PlayError: it is not one that this version reads.
    """
    try:
        values = json.loads((folder / NAME).read_bytes())
        if values["format"] != FORMAT:
            raise PlayError(f"{folder / NAME}: has format {values['format']}, expected {FORMAT}; choose another --out")
        return Record.from_json(values)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (ValueError, KeyError, TypeError) as error:
        raise PlayError(f"{folder / NAME}: is damaged ({error}); remove its folder to play this match again") from None
