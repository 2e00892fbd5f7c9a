"""``build_dataset``: from a store to a dataset on disk, with a report of every cleaning rule."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from dataclasses import replace as changed
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset import clean, layout
from teamclone.dataset.clean import Commands, MatchSamples, TurnZero
from teamclone.dataset.split import MatchKey, split_matches, split_rows
from teamclone.dataset.write import DatasetWriter, writing_dataset
from teamclone.dynamics.inverse.columns import recovered_commands
from teamclone.dynamics.rules import check_parameters
from teamclone.errors import DatasetError, UsageError, choose
from teamclone.logs.columns import COMMANDS, INTERVALS, Source, counter_name
from teamclone.logs.match import empty_columns
from teamclone.percepts import sight
from teamclone.percepts.believed import perceive
from teamclone.rcss import server_params
from teamclone.rcss.commands import CLONED, REPERTOIRE, CommandKind
from teamclone.rcss.player_types import DEFAULTS, FIELDS
from teamclone.store import Store
from teamclone.store.shared import SharedStore
from teamclone.system.settings import setting
from teamclone.system.workers import Died, run_tasks
from teamclone.world.view import FRAME_COLUMNS, PLAYER_COLUMNS

AHEAD = 64
"""Cleaned matches that a cluster may hold ready, about 300 MB: more than one writer takes in a second."""


_WITHOUT_COUNTERS = ("1", "2")
"""Versions of game logs that do not show which commands were executed."""
MAX_SHARE = 0.9
"""Of the matches, for test or validation."""


class SplitBy(StrEnum):
    """The unit of the split: whole matches, or the paper's rows at random."""

    MATCH = "match"
    ROWS = "rows"


class Sources(StrEnum):
    """Which commands of a match are taken, see `store.schema.COMMANDS`."""

    ANY = "any"
    """Those that the store has: of the command log; of a match without one those that its game log implies."""
    LOGGED = "logged"
    """Those of command logs; matches without one give nothing."""
    RECOVERED = "recovered"
    """Those that the game log implies, also of matches that have a command log."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetConfig:
    """The settings of a dataset.

    Attributes:
        teams: the teams to clone, as their logs name them. Each is seen as attacking +x and coming first, so a match of
            two of them is in the dataset twice; both entries fall into the same split.
        unseen: opponents kept out of training, validation and test.
        split: see SplitBy.
        commands, turn_zero: see `clean`. Recovered commands are those that the server executed, whatever is asked for.
        source: see Sources.
        train_goalkeepers: let goalkeepers' commands, too, be training samples; never validation or test. A team may
            give its goalkeeper another number than usual. A field player then wears the usual one, which a network
            that knows players by their numbers has otherwise never seen.
        goalkeepers: model goalkeepers like the other players, in every split, and ``catch`` as a command.
        set_plays: take the commands of all play modes that have a Situation, not only of play_on, and ``move`` as one.
        idle: take cycles without a body command as samples of ``none``.
        percepts: take the situation of a sample as its player believes it, from what it saw (`percepts`), not as the
            log has it: for teams that play without the full state.
        test_matches, validation_matches: match ids or parts of log names that must fall there; the other split
            shares are then drawn from the rest.
        test, validation: share of the matches.
        seed: of the split.
    """

    teams: tuple[str, ...] = setting(some=True)
    unseen: tuple[str, ...] = ()
    split: SplitBy = SplitBy.MATCH
    commands: Commands = Commands.EXECUTED
    turn_zero: TurnZero = TurnZero.KEEP
    source: Sources = Sources.ANY
    train_goalkeepers: bool = False
    goalkeepers: bool = False
    set_plays: bool = False
    idle: bool = False
    percepts: bool = False
    test_matches: tuple[str, ...] = ()
    validation_matches: tuple[str, ...] = ()
    test: float = setting(0.15, at_least=0, at_most=MAX_SHARE)
    validation: float = setting(0.15, at_least=0, at_most=MAX_SHARE)
    seed: int = 0

    @property
    def team(self) -> str:
        """Name of all teams together."""
        return " + ".join(self.teams)

    @property
    def repertoire(self) -> tuple[str, ...]:
        """The commands of the dataset."""
        wanted = {"catch": self.goalkeepers, "move": self.set_plays, "none": self.idle}
        return tuple(name for name in REPERTOIRE if wanted.get(name, True))

    def check(self) -> None:
        """Raise unless the options go together.

        Raises:
            UsageError: they do not.
        """
        problems = self.problems()
        if problems:
            raise UsageError("; ".join(problems))

    def problems(self, key: str | None = None) -> list[str]:
        """Return what is wrong between the settings.

        Args:
            key: what messages call their table; None for options of the command line.
        """

        def called(name: str) -> str:
            return f"{key}.{name}" if key else f"--{name.replace('_', '-')}"

        training, every = called("train_goalkeepers"), called("goalkeepers")
        problems = []
        if self.train_goalkeepers and self.split is SplitBy.ROWS:
            split = f"{called('split')} {'= ' if key else ''}match"
            problems.append(f"{training} keeps goalkeepers out of whole test matches; it needs {split}")
        if self.train_goalkeepers and self.goalkeepers:
            problems.append(f"{every} takes goalkeepers' commands in every split; leave out {training}")
        return problems


@dataclass(frozen=True, slots=True, kw_only=True)
class _Entry:
    """A match of a team; ``source`` is that of its commands in the store, None where it has none of the team."""

    match_id: str
    name: str
    side: int
    team: str
    opponent: str
    source: Source | None


@dataclass(frozen=True, slots=True, kw_only=True)
class _Task:
    store: SharedStore
    entry: _Entry
    commands: Commands
    turn_zero: TurnZero
    recover: bool
    goalkeepers: bool
    repertoire: tuple[str, ...]
    percepts: bool


def build_dataset(
    config: DatasetConfig,
    *,
    store: Store,
    out: Path,
    executor: Executor | None = None,
    jobs: int | None = None,
    replace: bool = False,
    on_progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Build a dataset and write it to ``out``, the same bytes wherever its matches are cleaned.

    Args:
        executor: where matches are cleaned, for example on a cluster (``cluster.executor_of``); its workers must see
            the store under the same path. None starts processes on this machine.
        jobs: how many, None for one a processor. More than one needs the usual ``if __name__ == "__main__"`` guard.
        replace: put it in the place of a dataset that is already there.
        on_progress: called with the matches that are done and their number.

    Returns:
        The cleaning report: ``rules`` (name, before, after over all matches), ``matches`` (each with its split, rules
        and rows), ``rows`` by split and kind, ``player_cycles``, ``idle`` and ``frozen``.

    Raises:
        UsageError: a team or an unseen opponent does not occur in the store, a team is named twice, or options exclude
            each other.
        StoreError: a match cannot be read, or a worker does not see the store.
        DatasetError: no row is left, or ``out`` cannot be written.
        ClusterError: the connection to the executor's workers was lost.
    """
    config.check()
    found = _entries(store, config)
    entries = found.usable
    splits = split_matches(
        [MatchKey(match_id=entry.match_id, team=entry.team, opponent=entry.opponent) for entry in entries],
        unseen=config.unseen,
        fixed=_fixed(entries, config),
        test=config.test,
        validation=config.validation,
        seed=config.seed,
    )
    tasks = _tasks(entries, config, splits, SharedStore.of(store))
    matches: list[dict[str, Any]] = []
    parameters: list[_Parameters] = []
    rows = np.zeros((len(layout.Split), len(config.repertoire)), np.int64)
    with writing_dataset(out, replace=replace) as writer:
        for task, cleaned in run_tasks(_clean, tasks, executor=executor, jobs=jobs, ahead=AHEAD, in_order=True):
            if isinstance(cleaned, Died):
                raise DatasetError(
                    f"{task.entry.name}: the process that cleaned it was killed, perhaps out of memory; "
                    "try again with --jobs 1"
                )
            match, of_match = cleaned
            of_rows, name = _split_of_rows(match, task.entry, splits[task.entry.match_id], config)
            _add(writer, match, index=len(matches), split=of_rows)
            np.add.at(rows, (of_rows, match.samples["kind"]), 1)
            row = _report_match(
                task.entry, match, source=_source_of(task.entry, config), split=name, repertoire=config.repertoire
            )
            row["left_out"] = of_match.left_out
            matches.append(row if len(config.teams) == 1 else {"team": task.entry.team, **row})
            parameters.append(of_match)
            if on_progress is not None:
                on_progress(len(matches), len(entries))
        report = _report(config, matches, rows=rows, entries=found)
        if not writer.n_samples:
            raise _nothing_left(out, config, report)
        writer.finish(
            player_types=_pad_types([each.types for each in parameters]),
            server_params=np.stack([each.server for each in parameters]),
            meta=_meta(config, matches, report),
        )
    return report


def _tasks(
    entries: Sequence[_Entry], config: DatasetConfig, splits: Mapping[str, layout.Split], store: SharedStore
) -> list[_Task]:
    return [
        _Task(
            store=store,
            entry=entry,
            commands=config.commands,
            turn_zero=config.turn_zero,
            recover=config.source is Sources.RECOVERED and entry.source is not Source.RECOVERED,
            goalkeepers=config.train_goalkeepers and splits[entry.match_id] is layout.Split.TRAIN,
            repertoire=config.repertoire,
            percepts=config.percepts,
        )
        for entry in entries
    ]


def _split_of_rows(
    match: MatchSamples, entry: _Entry, split: layout.Split, config: DatasetConfig
) -> tuple[NDArray[np.uint8], str]:
    """Return the split of each sample of a match, (n_samples,), and the name under which the report has the match."""
    n = len(match.samples["kind"])
    if config.split is SplitBy.ROWS and split is not layout.Split.UNSEEN:
        return split_rows(n, match_id=entry.match_id, seed=config.seed), "rows"
    return np.full(n, split, np.uint8), split.name.lower()


def _nothing_left(out: Path, config: DatasetConfig, report: dict[str, Any]) -> DatasetError:
    left = "; ".join(f"{rule['name']}: {rule['after']}" for rule in report["rules"])
    if config.source is Sources.LOGGED and not report["matches"]:
        return DatasetError(
            f"{out}: no match has logged commands of {config.team}; add the command logs, or take what game logs imply "
            "with --source any"
        )
    return DatasetError(
        f"{out}: no command of {config.team} is left after cleaning ({left or 'no match has any'}). "
        "Without a command log there are only the commands that the game log shows, and logs before version 3 do not "
        "show which were executed"
    )


def _meta(config: DatasetConfig, matches: Sequence[dict[str, Any]], report: dict[str, Any]) -> dict[str, Any]:
    """Return the content of ``dataset.json`` beside counts."""
    return {
        "team": config.team,
        **({"teams": config.teams} if len(config.teams) > 1 else {}),
        **({"commands": config.repertoire} if config.repertoire != CLONED else {}),
        "options": _options(config),
        "matches": [{key: value for key, value in row.items() if key != "rules"} for row in matches],
        "recovered": report["recovered"],
        "cleaning": report,
    }


def is_current(folder: Path, config: DatasetConfig, store: Store) -> bool:
    """Return whether the dataset in a folder equals that which ``build_dataset`` would make of the store now."""
    from teamclone.dataset.reader import open_dataset  # imports PyTorch, which takes longer than to clean many matches

    try:
        meta = open_dataset(folder).meta
    except DatasetError:
        return False
    wanted = [(entry.match_id, _source_of(entry, config)) for entry in _entries(store, config).usable]
    there = [(match["match_id"], match.get("source")) for match in meta["matches"]]
    options = json.loads(json.dumps(_options(config)))
    return meta.get("options") == options and there == wanted


def _source_of(entry: _Entry, config: DatasetConfig) -> str:
    """Return the word for where the commands of an entry are taken from."""
    source = Source.RECOVERED if config.source is Sources.RECOVERED or entry.source is None else entry.source
    return source.name.lower()


def _options(config: DatasetConfig) -> dict[str, Any]:
    """Return a config as the dataset keeps it: options beyond play_on only where they are on."""
    options = asdict(config)
    teams = options.pop("teams")
    for name in ("goalkeepers", "set_plays", "idle", "percepts"):
        if not options[name]:
            del options[name]
    return {"team": teams if len(teams) > 1 else config.team, **options}


class _Parameters(NamedTuple):
    """Parameters of one match: ``types`` (n_types, n_fields) of its players, ``server`` (n_fields,).

    ``left_out`` is why they are none that a match can have, None where they are.
    """

    left_out: str | None
    types: NDArray[np.float32]
    server: NDArray[np.float64]


def _clean(task: _Task) -> tuple[MatchSamples, _Parameters]:
    """Return the samples of one match and its parameters. Runs in a worker."""
    store, match_id = task.store.open(), task.entry.match_id
    params = store.read_parameters(match_id)["server"]
    types = store.read_match_columns(match_id, "player_types", columns=FIELDS)
    frames = store.read_match_columns(match_id, "frames", columns=FRAME_COLUMNS)
    columns = dict.fromkeys((*PLAYER_COLUMNS, *(sight.PLAYER_COLUMNS if task.percepts else ())))
    players = store.read_match_columns(match_id, "player_states", columns=tuple(columns))
    left_out, memory = None, None
    try:
        check_parameters(params, types)
        if task.percepts:
            _, memory = perceive(frames, players, types=types, params=params)
    except UsageError as error:  # what no match has would spoil the samples of all others
        left_out = str(error)
    if left_out is not None:
        commands = empty_columns((*COMMANDS, *INTERVALS), 0)
    elif task.recover:
        players |= store.read_match_columns(match_id, "player_states", columns=[counter_name(CommandKind.TURN_NECK)])
        try:
            commands, _ = recovered_commands(frames, players, types=types, params=params)
        except UsageError:  # its game log says too little: no samples, as of a match that has no commands
            commands = empty_columns((*COMMANDS, *INTERVALS), 0)
    else:
        intervals = [column.name for column in INTERVALS] if task.entry.source is Source.RECOVERED else []
        commands = store.read_match_columns(match_id, "commands", columns=(*clean.COMMAND_COLUMNS, *intervals))
    samples = clean.clean_match(
        frames,
        players,
        commands,
        params,
        side=task.entry.side,
        n_types=max(1, len(types[FIELDS[0]])),  # a log that describes none has the server's default type alone
        keep=task.commands,
        turn_zero=task.turn_zero,
        goalkeepers=task.goalkeepers,
        repertoire=task.repertoire,
        memory=memory,
    )
    if left_out is not None:  # nor do its cycles count among those that have no command
        samples = changed(samples, player_cycles=0, idle=0, frozen=0, odd_frames=0)
    return samples, _Parameters(
        left_out=left_out,
        types=np.stack([types[name] for name in FIELDS], axis=-1).astype(np.float32),
        server=server_params.vector(params, version=server_params.OLDEST),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Entries:
    """The teams' matches by match id, the left side first.

    Attributes:
        usable: those from which there are commands to take. without_commands: names of the others.
        without_team: how many matches of the store none of the teams plays in.
    """

    usable: list[_Entry]
    without_commands: tuple[str, ...]
    without_team: int


def _entries(store: Store, config: DatasetConfig) -> _Entries:
    """Return the teams' matches; splits are drawn from the usable ones alone."""
    if not config.teams or len(set(config.teams)) < len(config.teams):
        raise UsageError(f"expected different teams, got {', '.join(config.teams) or 'none'}; name each once")
    sources = _sources(store, config.repertoire)
    entries: list[_Entry] = []
    teams: Counter[str] = Counter()
    rows = store.matches().to_pylist()
    in_play = "n_frames" if config.set_plays else "n_play_on_frames"
    usable: list[_Entry] = []
    for row in rows:
        left, right = row["left_name"], row["right_name"]
        teams.update(name for name in (left, right) if name)
        for side, team, opponent in ((1, left, right), (-1, right, left)):
            if team not in config.teams or (side < 0 and left == right):
                continue
            entry = _Entry(
                match_id=row["match_id"],
                name=row["game_log"] or row["command_log"] or row["match_id"],
                side=side,
                team=team,
                opponent=opponent or "nobody",
                source=sources.get((row["match_id"], side)),
            )
            entries.append(entry)
            if row[in_play] and _gives_commands(entry, row, config):
                usable.append(entry)
    for name in config.teams:
        if name not in teams:
            raise UsageError(f"team {name!r} is in no match of the store; {choose(name, sorted(teams))}")
    opponents = {entry.opponent for entry in entries}
    for name in config.unseen:
        if name not in opponents:
            remedy = choose(name, sorted(opponents))
            raise UsageError(f"unseen opponent {name!r} plays in no match of {config.team}; {remedy}")
    taken = {entry.match_id for entry in usable}
    left_out = {entry.match_id: entry.name for entry in entries if entry.match_id not in taken}
    return _Entries(
        usable=sorted(usable, key=lambda entry: entry.match_id),
        without_commands=tuple(name for _, name in sorted(left_out.items())),
        without_team=len(rows) - len({entry.match_id for entry in entries}),
    )


def _gives_commands(entry: _Entry, row: Mapping[str, Any], config: DatasetConfig) -> bool:
    """Return whether there are commands to take in a match, whose row of ``matches`` this is."""
    if config.commands is Commands.EXECUTED and row["log_version"] in _WITHOUT_COUNTERS:
        return False
    if config.source is Sources.LOGGED:
        return entry.source is Source.LOGGED
    # A command log may lack a side of which the game log knows.
    return entry.source is not None or (config.source is Sources.RECOVERED and row["command_log"] is not None)


def _sources(store: Store, repertoire: Sequence[str]) -> dict[tuple[str, int], Source]:
    """Return where the commands of each match and side are known from; those without commands are left out."""
    kinds = ", ".join(str(int(CommandKind[name.upper()])) for name in repertoire if name != "none")
    found = store.sql(
        "select match_id, side, min(source) as source from commands "
        f"where unum > 0 and frame >= 0 and valid and kind in ({kinds}) group by match_id, side"
    )
    return {(row["match_id"], row["side"]): Source(row["source"]) for row in found.to_pylist()}


def _fixed(entries: Sequence[_Entry], config: DatasetConfig) -> dict[str, layout.Split]:
    fixed: dict[str, layout.Split] = {}
    for split, wanted in (
        (layout.Split.TEST, config.test_matches),
        (layout.Split.VALIDATION, config.validation_matches),
    ):
        for text in wanted:
            found = [entry.match_id for entry in entries if text == entry.match_id or text in entry.name]
            if not found:
                raise UsageError(f"no match of {config.team} is called {text!r}; see `teamclone matches`")
            fixed |= dict.fromkeys(found, split)
    return fixed


def _add(writer: DatasetWriter, match: MatchSamples, *, index: int, split: NDArray[np.uint8]) -> None:
    """Append a match, the ``index``-th, whose samples then point at the frames of the dataset."""
    first = writer.n_frames
    if first + len(match.frames["cycle"]) > np.iinfo(np.int32).max:
        raise DatasetError("a dataset holds at most two billion frames; give each team, or each year, its own")
    writer.add(
        frames={**match.frames, "match": np.full(len(match.frames["cycle"]), index, np.int32)},
        samples={**match.samples, "frame": match.samples["frame"] + np.int32(first), "split": split},
    )


def _pad_types(types: Sequence[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Return (n_matches, n_types, n_fields) parameters; matches with fewer types repeat type 0."""
    most = max(1, *map(len, types))
    default = np.array([DEFAULTS[name] for name in FIELDS])
    padded = np.empty((len(types), most, len(FIELDS)), np.float32)
    for row, table in enumerate(types):
        padded[row] = table[0] if len(table) else default
        padded[row, : len(table)] = table
    return padded


def _report_match(
    entry: _Entry, match: MatchSamples, *, source: str, split: str, repertoire: Sequence[str]
) -> dict[str, Any]:
    return {
        "match_id": entry.match_id,
        "name": entry.name,
        "opponent": entry.opponent,
        "side": "left" if entry.side > 0 else "right",
        "split": split,
        "source": source,
        "frames": len(match.frames["cycle"]),
        "rows": _by_kind(np.bincount(match.samples["kind"], minlength=len(repertoire)), repertoire),
        "executed": int(match.samples["executed"].sum()),
        "turn_zero": int(match.samples["turn_zero"].sum()),
        "player_cycles": match.player_cycles,
        "idle": match.idle,
        "frozen": match.frozen,
        "odd_frames": match.odd_frames,
        "rules": [asdict(rule) for rule in match.rules],
    }


def _by_kind(counts: Iterable[int], repertoire: Sequence[str]) -> dict[str, int]:
    return {name: int(count) for name, count in zip(repertoire, counts, strict=True)}


def _report(
    config: DatasetConfig, matches: Sequence[dict[str, Any]], *, rows: NDArray[np.int64], entries: _Entries
) -> dict[str, Any]:
    """Return the sums over all matches; ``rows`` is (n_splits, n_kinds)."""
    return {
        "team": config.team,
        "matches_without_team": entries.without_team,
        "matches_without_commands": list(entries.without_commands),
        "rules": [
            {
                "name": same[0]["name"],
                "before": sum(rule["before"] for rule in same),
                "after": sum(rule["after"] for rule in same),
            }
            for same in zip(*(match["rules"] for match in matches), strict=True)
        ],
        "recovered": sum(sum(match["rows"].values()) for match in matches if match["source"] == "recovered"),
        "rows": {split.name.lower(): _by_kind(rows[split], config.repertoire) for split in layout.Split},
        **{
            name: sum(match[name] for match in matches)
            for name in ("executed", "turn_zero", "player_cycles", "idle", "frozen", "odd_frames")
        },
        "matches": list(matches),
    }
