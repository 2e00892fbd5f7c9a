"""The matches to play: teams, pairings, the server's options; from TOML, with every mistake reported at once."""

from __future__ import annotations

import dataclasses
import json
import math
import os
import re
import shlex
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from teamclone.errors import UsageError, choose
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.server_params import number
from teamclone.system.files import digest
from teamclone.system.settings import entries, from_table, setting

COACH = 12
"""The coach's number in the league's ``start`` scripts."""

PLACEHOLDERS = ("host", "port", "coach_port", "olcoach_port", "unum", "team", "folder")
"""Words in braces that a team's commands may hold."""

OPTIONS: Mapping[str, bool | int | float | str] = {
    "server::synch_mode": True,
    "server::fullstate_l": True,
    "server::fullstate_r": True,
    "server::nr_extra_halfs": 0,
    "server::penalty_shoot_outs": False,
    "server::game_log_compression": 6,
    "server::text_log_compression": 6,
}
"""The server's options where the schedule sets none: those of the paper, and small logs."""

OURS = (
    *("port", "coach_port", "olcoach_port", "auto_mode", "connect_wait", "coach", "team_l_start", "team_r_start"),
    *(f"{log}_log_{option}" for log in ("game", "text") for option in ("dir", "fixed", "dated")),
    *("game_logging", "text_logging"),
)
"""Options of the server that a schedule may not set, because the match itself needs them."""

OTHER_SECTIONS = ("store", "dataset", "train", "evaluate")
"""Sections of a schedule that are for `teamclone pipeline`, see `pipeline`."""

MAX_FIXTURES = 100_000

CYCLES_PER_S = 20
"""In synch mode a cycle before the kick-off takes at least 50 ms."""

_PLACEHOLDER = re.compile(r"(?<!\$)\{([\w-]*)\}")  # ${NAME} is for a shell
_VARIABLE = re.compile(r"[A-Za-z_]\w*")
_WORD = re.compile(r"[\w./+-]*")
"""A value of an option that the server's parser accepts."""
_NUMBERS = ("half_time", "nr_normal_halfs", "extra_half_time", "nr_extra_halfs", "simulator_step", "kick_off_wait")
_NAME = re.compile(r"[\w.+-]{1,40}")


@dataclass(frozen=True, slots=True, kw_only=True)
class TeamSpec:
    """A team and how its clients are started: by exactly one of ``command``, ``start`` and ``player``.

    No shell reads these commands; ``sh -c '...'`` is one. Each may hold the PLACEHOLDERS.

    Attributes:
        name: its name in the schedule; the name that its players give the server may be another.
        folder: where its commands run; the folder of the schedule unless given.
        command: starts the whole team.
        start: a script by the league's rules, called with host, folder and number once for each client: 1 is the
            goalkeeper, 12 the coach.
        player, goalie, coach: start one client. Without ``coach`` the team has none, without ``goalie``, where it is
            not whole, no goalkeeper.
        players: how many it plays with.
        environment: variables to add.
    """

    name: str
    folder: str = ""
    command: str = ""
    start: str = ""
    player: str = ""
    goalie: str = ""
    coach: str = ""
    players: int = setting(N_TEAM, at_least=1, at_most=N_TEAM)
    environment: dict[str, str] = field(default_factory=dict)

    def clients(self) -> list[tuple[str, list[str]]]:
        """Return label and words of each process to start: goalkeeper, players, coach; or the one for all."""
        if self.command:
            return [("team", shlex.split(self.command))]
        first = "goalie" if self.start or self.goalie else "player-1"
        others = range(2, self.players + 1)
        numbers = [(first, 1), *((f"player-{unum}", unum) for unum in others), ("coach", COACH)]
        if self.start:
            words = [*shlex.split(self.start), "{host}", "{folder}", "{unum}"]
            return [(label, [word.replace("{unum}", str(unum)) for word in words]) for label, unum in numbers]
        made = []
        for label, unum in numbers:
            text = {1: self.goalie or self.player, COACH: self.coach}.get(unum, self.player)
            if text:
                made.append((label, [word.replace("{unum}", str(unum)) for word in shlex.split(text)]))
        return made

    @property
    def takes_port(self) -> bool:
        """True if it can play at another port than the default."""
        words = [*self.environment.values(), *(word for _, words in self.clients() for word in words)]
        return any("{port}" in word for word in words)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServerSpec:
    """The server: a command, found on the PATH or a path, and its options as ``server::half_time``."""

    command: str = "rcssserver"
    options: dict[str, Any] = field(default_factory=dict)

    def number(self, name: str) -> float:
        """Return the value of an option, the server's default where it is not set."""
        key = f"server::{name}"
        return number({name: self.options[key]} if key in self.options else {}, name)

    @property
    def synch(self) -> bool:
        """True if the server waits for its clients in every cycle."""
        return self.options.get("server::synch_mode") is True

    @property
    def most_cycles(self) -> int:
        """The most cycles that a match may have, with all extra halves, roughly."""
        regular = self.number("half_time") * self.number("nr_normal_halfs")
        extra = self.number("extra_half_time") * self.number("nr_extra_halfs")
        shoot_out = 200 if self.options.get("server::penalty_shoot_outs") else 0
        return int(1000 * (regular + extra + shoot_out) / max(self.number("simulator_step"), 1))

    @property
    def kick_off_wait_s(self) -> float:
        """Seconds that the server leaves between the last player's connection and the kick-off, at least."""
        cycles = float(self.options.get("server::kick_off_wait", 100))
        return cycles / CYCLES_PER_S if self.synch else cycles * self.number("simulator_step") / 1000


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """How long things may take, in seconds of wall time.

    Attributes:
        connect_s: from the start of a team until all its players are connected, and from that of a coach until it is.
        stall_s: without a message of the server.
        match_s: a whole match; 0 is four times what it takes at 25 cycles/s, or in real time at 10, and a few minutes.
        silent_cycles: in a row without a command from a player on the field; the player then counts as hung. 0 is
            never.
    """

    connect_s: float = setting(60.0, above=0)
    stall_s: float = setting(30.0, above=0)
    match_s: float = setting(0.0, at_least=0)
    silent_cycles: int = setting(100, at_least=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Fixture:
    """One match to play.

    Attributes:
        id: stable name of its folder; pairings that are added to a schedule do not change it.
        seed: of the heterogeneous player types. The server takes the seed of the game itself from its clock.
    """

    id: str
    left: TeamSpec
    right: TeamSpec
    server: ServerSpec
    limits: Limits
    seed: int

    @property
    def takes_port(self) -> bool:
        """True if both teams can play at another port than the default."""
        return self.left.takes_port and self.right.takes_port

    @property
    def whole_teams(self) -> bool:
        """True if both teams have eleven players. Else the server does not kick off by itself."""
        return self.left.players == self.right.players == N_TEAM

    @property
    def match_s(self) -> float:
        """The longest that the match may take, in seconds."""
        if self.limits.match_s:
            return self.limits.match_s
        return 4 * self.server.most_cycles / (25 if self.server.synch else 10) + 2 * self.limits.connect_s + 60

    @property
    def fingerprint(self) -> str:
        """A hash that is equal for fixtures that ask for equal matches; limits do not count."""
        asked = [dataclasses.asdict(part) for part in (self.left, self.right, self.server)]
        for team in asked[:2]:
            if team["players"] == N_TEAM:  # matches of whole teams keep the hash that they had before there were others
                del team["players"]
        return digest(json.dumps([asked, self.seed], sort_keys=True).encode())

    def to_json(self) -> dict[str, Any]:
        """Return the fields by name, for a JSON document; `from_json` is the inverse."""
        return dataclasses.asdict(self)

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> Fixture:
        """Make a fixture from the fields that `to_json` returned."""
        parts = {"left": TeamSpec, "right": TeamSpec, "server": ServerSpec, "limits": Limits}
        return cls(**{name: parts[name](**value) if name in parts else value for name, value in values.items()})


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairing:
    """``matches`` of every team of ``left`` against every one of ``right``; with ``swap`` as many the other way."""

    left: tuple[str, ...] = ()
    right: tuple[str, ...] = ()
    matches: int = setting(1, at_least=1)
    swap: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaySettings:
    """How often a match is tried before it counts as failed, and the seed of the player types of the first match."""

    attempts: int = setting(3, at_least=1)
    seed: int = setting(0, at_least=0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """The matches to play, and how often each is tried before it counts as failed."""

    fixtures: tuple[Fixture, ...]
    attempts: int


def load_schedule(path: Path) -> Schedule:
    """Read a schedule from a TOML file.

    Raises:
        UsageError: naming all that is wrong, in one line.
    """
    return schedule_from(read_schedule(path), where=str(path), base=folder_of(path))


def folder_of(path: Path) -> Path:
    """Return the folder of a schedule's file, to which its paths are relative."""
    return Path(os.path.normpath(path.absolute().parent))


def read_schedule(path: Path) -> dict[str, Any]:
    """Read the tables of a schedule.

    Raises:
        UsageError: the file is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise UsageError(f"{path}: is not TOML: {error}") from None


def quick_schedule(left: str, right: str, *, matches: int, server: str, options: Mapping[str, Any]) -> Schedule:
    """Make the schedule of two teams, each a command that starts it, or a folder with the league's ``start`` script.

    Raises:
        UsageError: naming all that is wrong, in one line.
    """
    problems: list[str] = []
    teams = {}
    for side, text in (("left", left), ("right", right)):
        folder = Path(os.path.abspath(os.path.expanduser(text)))  # noqa: PTH100, PTH111 (any text)
        is_folder = os.path.isdir(folder)  # noqa: PTH112 (any text)
        script = folder / "start" if is_folder else folder
        if is_folder and not script.is_file():
            problems.append(f"--{side} {text}: has no script called start; give the command that starts the team")
        if script.name == "start" and script.is_file():
            name = script.parent.name
            team: dict[str, Any] = {"start": "./start", "folder": str(script.parent)}
        else:
            name, team = side, {"command": text}
        teams[name if name not in teams else f"{name}-2"] = team
    first, second = teams
    table = {
        "server": {"command": server, "options": dict(options)},
        "teams": teams,
        "pairings": [{"left": first, "right": second, "matches": matches}],
    }
    return schedule_from(table, where="teamclone play", base=Path.cwd(), problems=problems)


def schedule_from(table: Mapping[str, Any], *, where: str, base: Path, problems: Iterable[str] = ()) -> Schedule:
    """Make a schedule of its tables.

    Args:
        where: begins the message of an error. base: its folders are relative to it. problems: what else was wrong.

    Raises:
        UsageError: naming all that is wrong, in one line.
    """
    found = list(problems)
    schedule = schedule_of(table, base=base, problems=found)
    if found:
        raise UsageError(f"{where}: {'; '.join(dict.fromkeys(found))}")
    return schedule


def schedule_of(table: Mapping[str, Any], *, base: Path, problems: list[str]) -> Schedule:
    """Make a schedule of its tables, whose folders are relative to ``base``; mistakes are appended to ``problems``."""
    known = ("play", "server", "limits", "teams", "pairings", *OTHER_SECTIONS)
    problems += [f"no section {name!r}; {choose(name, known)}" for name in table if name not in known]
    settings = from_table(PlaySettings, table.get("play", {}), "play", problems)
    limits = from_table(Limits, table.get("limits", {}), "limits", problems)
    given = from_table(ServerSpec, table.get("server", {}), "server", problems)
    program = _path(given.command, base, "server.command", problems) if "/" in given.command else given.command
    server = dataclasses.replace(given, command=program, options=_options(given.options, problems))
    teams: dict[str, TeamSpec] = {}
    for name, values in entries(table.get("teams", {}), "teams", dict, problems).items():
        if "name" in values:
            problems.append(f"teams.{name}.name: a team is called as its table is; leave it out")
        team = from_table(TeamSpec, {**values, "name": name}, f"teams.{name}", problems)
        folder = _path(team.folder, base, f"teams.{name}.folder", problems)
        teams[name] = dataclasses.replace(team, folder=folder)
        problems += [f"teams.{name}: {problem}" for problem in _wrong(teams[name])]
    pairings = table.get("pairings", [])
    if not isinstance(pairings, list) or not pairings:
        problems.append("no [[pairings]]: name the teams that play each other")
        pairings = []
    fixtures: list[Fixture] = []
    counts: dict[tuple[str, str], int] = {}
    for index, values in enumerate(pairings, 1):
        key = f"pairings {index}"
        pairing = from_table(Pairing, values, key, problems)
        sides = [(left, right) for left in pairing.left for right in pairing.right]
        if not sides:
            problems.append(f"{key}: needs left and right")
        if pairing.swap:
            sides += [(right, left) for left, right in sides]
        for left, right in sides:
            strange = [name for name in (left, right) if name not in teams]
            problems += [f"{key}: no team {name!r}; {choose(name, list(teams))}" for name in strange]
            if left == right:
                problems.append(f"{key}: {left} against itself; the server takes each name once")
            if strange or left == right:
                continue
            if len(fixtures) + pairing.matches > MAX_FIXTURES:
                problems.append(f"{key}: more than {MAX_FIXTURES} matches in one schedule")
                continue
            for _ in range(pairing.matches):
                count = counts[left, right] = counts.get((left, right), 0) + 1
                fixture = Fixture(
                    id=f"{left}-vs-{right}-{count}",
                    left=teams[left],
                    right=teams[right],
                    server=server,
                    limits=limits,
                    seed=settings.seed + count - 1,
                )
                fixtures.append(fixture)
    if settings.seed >= 2**31 - len(fixtures):
        problems.append(f"play.seed: expected a number below 2^31, got {settings.seed}")
    twice = [name for name, number in Counter(fixture.id for fixture in fixtures).items() if number > 1]
    problems += [f"{name}: names two matches; call one of their teams otherwise" for name in twice]
    return Schedule(fixtures=tuple(fixtures), attempts=settings.attempts)


def option_words(options: Mapping[str, Any]) -> Iterator[str]:
    """Yield options as the server's command line takes them."""
    for name, value in options.items():
        yield f"{name}={('off', 'on')[value] if isinstance(value, bool) else value}"


def filled_in(words: list[str], values: Mapping[str, Any]) -> list[str]:
    """Return the words of a command with its placeholders replaced."""
    return [_PLACEHOLDER.sub(lambda found: str(values[found[1]]), word) for word in words]


def _wrong(team: TeamSpec) -> list[str]:
    """Return the mistakes in a team's commands."""
    problems = []
    if not _NAME.fullmatch(team.name):
        problems.append("a name is made of at most 40 letters, digits, '_', '.', '+' and '-'")
    ways = [name for name in ("command", "start", "player") if getattr(team, name).strip()]
    if len(ways) != 1:
        got = " and ".join(ways) or "none"
        problems.append(f"needs one of command (the whole team), start (the league's script) and player, got {got}")
    if team.player and not team.goalie and team.players == N_TEAM:
        problems.append("player needs goalie, the command of the goalkeeper; only a team of fewer players has none")
    if not team.player and (team.goalie or team.coach):
        problems.append("goalie and coach go with player")
    for name in ("command", "start", "player", "goalie", "coach"):
        text = getattr(team, name)
        try:
            words = shlex.split(text)
        except ValueError as error:
            problems.append(f"{name}: {text!r}: {error}")
            continue
        strange = [found for word in words for found in _PLACEHOLDER.findall(word) if found not in PLACEHOLDERS]
        problems += [f"{name}: no {{{found}}}; {choose(found, PLACEHOLDERS)}" for found in strange]
        if "{unum}" in text and name in ("command", "start"):
            problems.append(f"{name}: {{unum}} is for player, goalie and coach")
    for name, text in team.environment.items():
        strange = [found for found in _PLACEHOLDER.findall(text) if found not in PLACEHOLDERS or found == "unum"]
        problems += [f"environment.{name}: no {{{found}}}; {choose(found, PLACEHOLDERS)}" for found in strange]
    problems += [
        f"environment: no variable can be called {name!r}" for name in team.environment if not _VARIABLE.fullmatch(name)
    ]
    texts = (team.command, team.start, team.player, team.goalie, team.coach, *team.environment.values())
    if any("\0" in text for text in texts):
        problems.append("commands and variables cannot hold a NUL byte")
    if not os.path.isdir(team.folder):  # noqa: PTH112 (any text)
        problems.append(f"{team.folder}: no such folder")
    return problems


def _options(given: Mapping[str, Any], problems: list[str]) -> dict[str, Any]:
    """Return the server's options under their full names, with ours where the schedule has none."""
    options = dict(OPTIONS)
    switches = {"on": True, "true": True, "off": False, "false": False}
    for name, text in given.items():
        value = switches.get(text.lower(), text) if isinstance(text, str) else text
        full = name if "::" in name else f"server::{name}"
        if full.removeprefix("server::") in OURS or full == "player::random_seed":
            problems.append(f"server.options.{name}: is set by teamclone; leave it out")
        is_number = isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
        if full.removeprefix("server::") in _NUMBERS and not (is_number and float(value) >= 0):
            problems.append(f"server.options.{name}: expected a number, got {value!r}")
        elif full == "server::game_log_version" and value in (1, 2, 3):
            problems.append(
                f"server.options.{name}: a log of version {value} does not hold enough; choose from 4, 5, 6, -1"
            )
        elif not (is_number or isinstance(value, bool) or (isinstance(value, str) and _WORD.fullmatch(value))):
            problems.append(f"server.options.{name}: expected a number, a word, true or false, got {value!r}")
        options[full] = value
    return options


def _path(text: str, base: Path, key: str, problems: list[str]) -> str:
    """Return a path from ``base``, with ``~`` and ``..`` resolved, but no links."""
    try:
        return os.path.normpath(base / Path(text).expanduser())
    except RuntimeError as error:  # of ~somebody
        problems.append(f"{key}: {text}: {error}")
        return str(base)
