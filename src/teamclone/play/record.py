"""``match.json``: the outcome of a match, and all that is needed to know how it was played."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Self

from teamclone.errors import PlayError
from teamclone.play.schedule import TeamSpec
from teamclone.system.documents import check_format, misfit, read_json, write_document

FORMAT = 2
NAME = "match.json"


class Fault(StrEnum):
    """The reason for which a match failed."""

    NO_PORT = "no port"
    """The ports that the server needs are in use."""
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
    SUPERVISOR_DIED = "supervisor died"
    """The process that looks after a match was killed."""


class FailedError(Exception):
    """A match has failed.

    Attributes:
        fault, text, side, unums: see `Trouble`; but here the side is 0 left, 1 right.
    """

    def __init__(self, fault: Fault, text: str, *, side: int | None = None, unums: Iterable[int] = ()) -> None:
        super().__init__(text)
        self.fault, self.text, self.side, self.unums = fault, text, side, tuple(sorted(int(unum) for unum in unums))


def who(team: TeamSpec, unums: Iterable[int]) -> str:
    """Return players as the subject of a sentence, with its verb: ``Red: players 3, 4 are``."""
    numbers = sorted(unums)
    if len(numbers) == team.players:
        return f"{team.name}: the whole team is"
    names = ", ".join(map(str, numbers))
    return f"{team.name}: player{'s' if len(numbers) > 1 else ''} {names} {'are' if len(numbers) > 1 else 'is'}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Trouble:
    """A fault: its text, and the team and players at fault.

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
        """Make a trouble from its fields by name, as JSON has them."""
        return cls(**{**values, "fault": Fault(values["fault"]), "unums": tuple(values["unums"])})


@dataclass(frozen=True, slots=True, kw_only=True)
class Side:
    """A team in a match.

    Attributes:
        team: its name in the schedule.
        name: its name in the logs; None where it never connected.
        coach: whether its online coach ever connected; None where the server does not report it (before version 15).
        score: goals.
        holes, clashes, missed: of players 1 to 11, see `holes`; None where there are no whole logs.
        files: SHA-256 of its programs, by path.
        exits: how its processes ended, by label: an exit code, or a signal as a negative number.
    """

    team: str
    name: str | None = None
    coach: bool | None = None
    score: int = 0
    holes: tuple[int, ...] | None = None
    clashes: tuple[int, ...] | None = None
    missed: tuple[int, ...] | None = None
    files: dict[str, str] = field(default_factory=dict)
    exits: dict[str, int | None] = field(default_factory=dict)

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Self:
        """Make a side from its fields by name, as JSON has them."""
        lists = {
            name: value and tuple(value) for name, value in values.items() if name in ("holes", "clashes", "missed")
        }
        return cls(**{**values, **lists})


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """The outcome of one attempt at a match. It is a match, and data, if ``trouble`` is None.

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
        """True if the match was played to its end."""
        return self.trouble is None

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name, for a JSON document; `from_json` is the inverse."""
        return {"format": FORMAT, "outcome": "complete" if self.complete else "failed", **dataclasses.asdict(self)}

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Self:
        """Make a record from its fields by name, as JSON has them."""
        kept = {name: value for name, value in values.items() if name not in ("format", "outcome")}
        kept["trouble"] = kept["trouble"] and Trouble.from_json(kept["trouble"])
        kept |= {side: Side.from_json(kept[side]) for side in ("left", "right")}
        kept |= {name: tuple(kept[name]) for name in ("logs", "ports")}
        return cls(**kept)


def bury_logs(folder: Path) -> None:
    """Rename the logs of a failed attempt, so that no reader takes them for a match."""
    for path in [*folder.glob("*.rcg*"), *folder.glob("*.rcl*")]:
        path.rename(f"{path}.failed")


def save_record(folder: Path, record: Record) -> None:
    """Write the record of a match into its folder."""
    write_document(folder / NAME, record.to_json())


_MAYBE = (str, type(None))
_COUNTS = ([int], type(None))
_SIDE = {"team": str, "name": _MAYBE, "score": int, "holes": _COUNTS, "clashes": _COUNTS, "missed": _COUNTS}
_SIDE |= {"files": {"*": str}, "exits": {"*": (int, type(None))}}
_SHAPE = {
    "left": _SIDE,
    "right": _SIDE,
    "trouble": (type(None), {"fault": str, "text": str, "side": _MAYBE, "unums": [int], "cycle": (int, type(None))}),
    "logs": [str],
    "ports": [int],
    "server": dict,
    "commands": {"*": [str]},
    **dict.fromkeys(("id", "fingerprint", "machine", "started", "teamclone"), str),
    **dict.fromkeys(("attempt", "cycles", "cpus"), int),
    **dict.fromkeys(("seconds", "play_seconds"), float),
}
"""Of match.json."""


def load_record(folder: Path) -> Record | None:
    """Read the record in a folder; None where there is none.

    Raises:
        PlayError: it is not one that this version reads.
    """
    try:
        values = read_json(folder / NAME)
        check_format(
            values["format"],
            number=FORMAT,
            what="match record",
            where=folder / NAME,
            again="choose another --out",
            error=PlayError,
        )
        if problem := misfit(values, _SHAPE):
            raise ValueError(problem)
        return Record.from_json(values)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (ValueError, KeyError, TypeError) as error:
        raise PlayError(f"{folder / NAME}: is damaged ({error}); remove its folder to play this match again") from None
