"""``build_dataset``: from a store to a dataset on disk, with a report of every cleaning rule."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset import clean, layout
from teamclone.dataset.clean import Commands, MatchSamples, TurnZero
from teamclone.dataset.split import MatchKey, split_matches, split_rows
from teamclone.dataset.write import write_dataset
from teamclone.errors import DatasetError, UsageError
from teamclone.rcss.commands import CLONED_KINDS
from teamclone.rcss.player_types import DEFAULTS, FIELDS
from teamclone.store import Store


class SplitBy(StrEnum):
    """What is kept apart: whole matches, or the paper's rows at random."""

    MATCH = "match"
    ROWS = "rows"


@dataclass(frozen=True, slots=True, kw_only=True)
class DatasetConfig:
    """What goes into a dataset.

    Attributes:
        team: the team to clone, as its logs name it.
        unseen: opponents kept out of training, validation and test.
        split: see SplitBy.
        commands, turn_zero: see `clean`.
        test_matches, validation_matches: match ids or parts of log names that must fall there; the other split
            shares are then drawn from the rest.
        test, validation: share of the matches.
        seed: of the split.
    """

    team: str
    unseen: tuple[str, ...] = ()
    split: SplitBy = SplitBy.MATCH
    commands: Commands = Commands.EXECUTED
    turn_zero: TurnZero = TurnZero.KEEP
    test_matches: tuple[str, ...] = ()
    validation_matches: tuple[str, ...] = ()
    test: float = 0.15
    validation: float = 0.15
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Entry:
    match_id: str
    name: str
    side: int
    opponent: str


def build_dataset(
    config: DatasetConfig,
    *,
    store: Store,
    out: Path,
    replace: bool = False,
    on_progress: Callable[[int, int, str], None] | None = None,
) -> dict[str, Any]:
    """Builds a dataset and writes it to ``out``.

    Args:
        on_progress: called with (matches done, matches in all, name of the match) before each match.

    Returns:
        The cleaning report: ``rules`` (name, before, after over all matches), ``matches`` (each with its split, rules
        and rows), ``rows`` by split and kind, ``player_cycles``, ``idle`` and ``frozen``.

    Raises:
        UsageError: the team or an unseen opponent does not occur in the store.
        DatasetError: no row is left, or ``out`` cannot be written.
    """
    entries, without_team = _entries(store, config)
    splits = split_matches(
        [MatchKey(match_id=entry.match_id, opponent=entry.opponent) for entry in entries],
        unseen=config.unseen,
        fixed=_fixed(entries, config),
        test=config.test,
        validation=config.validation,
        seed=config.seed,
    )
    cleaned: list[MatchSamples] = []
    types: list[NDArray[np.float64]] = []
    for done, entry in enumerate(entries):
        if on_progress is not None:
            on_progress(done, len(entries), entry.name)
        cleaned.append(
            clean.clean_match(
                store.read_match_columns(entry.match_id, "frames", columns=clean.FRAME_COLUMNS),
                store.read_match_columns(entry.match_id, "player_states", columns=clean.PLAYER_COLUMNS),
                store.read_match_columns(entry.match_id, "commands", columns=clean.COMMAND_COLUMNS),
                store.read_parameters(entry.match_id)["server"],
                side=entry.side,
                keep=config.commands,
                turn_zero=config.turn_zero,
            )
        )
        columns = store.read_match_columns(entry.match_id, "player_types", columns=FIELDS)
        types.append(np.stack([columns[name] for name in FIELDS], axis=-1))
    frames, samples = _join(entries, cleaned, splits)
    seen = samples["split"] != layout.Split.UNSEEN
    if config.split is SplitBy.ROWS:
        samples["split"][seen] = split_rows(int(seen.sum()), seed=config.seed)
    report = _report(config, entries, cleaned, splits=splits, samples=samples, frames=frames, without_team=without_team)
    if not len(samples["kind"]):
        left = "; ".join(f"{rule['name']}: {rule['after']}" for rule in report["rules"])
        raise DatasetError(
            f"{out}: no command of {config.team} is left after cleaning ({left}). "
            "Matches without a command log have none to give, and before log version 3 nothing tells what was executed"
        )
    meta = {
        "team": config.team,
        "options": asdict(config),
        "matches": [{key: value for key, value in row.items() if key != "rules"} for row in report["matches"]],
        "cleaning": report,
    }
    write_dataset(out, frames=frames, samples=samples, player_types=_pad_types(types), meta=meta, replace=replace)
    if on_progress is not None:
        on_progress(len(entries), len(entries), "")
    return report


def _entries(store: Store, config: DatasetConfig) -> tuple[list[_Entry], int]:
    """The team's matches by match id, and how many matches are without it."""
    entries: list[_Entry] = []
    teams: Counter[str] = Counter()
    rows = store.matches().to_pylist()
    for row in rows:
        left, right = row["left_name"], row["right_name"]
        teams.update(name for name in (left, right) if name)
        if config.team in (left, right):
            on_left = config.team == left
            entries.append(
                _Entry(
                    match_id=row["match_id"],
                    name=row["game_log"] or row["command_log"] or row["match_id"],
                    side=1 if on_left else -1,
                    opponent=(right if on_left else left) or "nobody",
                )
            )
    if not entries:
        raise UsageError(f"team {config.team!r} is in no match of the store{_hint(config.team, teams)}")
    opponents = {entry.opponent for entry in entries}
    for name in config.unseen:
        if name not in opponents:
            raise UsageError(f"unseen opponent {name!r} plays in no match of {config.team}{_hint(name, opponents)}")
    return sorted(entries, key=lambda entry: entry.match_id), len(rows) - len(entries)


def _hint(name: str, known: Counter[str] | set[str]) -> str:
    near = difflib.get_close_matches(name, known, n=1)
    names = ", ".join(sorted(known))
    return f"; did you mean {near[0]!r}?" if near else f"; known: {names or 'none'}"


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


def _join(
    entries: Sequence[_Entry], cleaned: Sequence[MatchSamples], splits: dict[str, layout.Split]
) -> tuple[dict[str, NDArray[Any]], dict[str, NDArray[Any]]]:
    """All matches behind one another; samples point at the joined frames."""
    counts = [len(match.frames["cycle"]) for match in cleaned]
    offsets = np.concatenate(([0], np.cumsum(counts)[:-1])).astype(np.int64)
    frames = {
        array.name: np.concatenate([match.frames[array.name] for match in cleaned])
        for array in layout.FRAME_ARRAYS
        if array.name != "match"
    }
    frames["match"] = np.repeat(np.arange(len(cleaned), dtype=np.int32), counts)
    samples = {
        array.name: np.concatenate([match.samples[array.name] for match in cleaned])
        for array in layout.SAMPLE_ARRAYS
        if array.name not in {"split", "frame"}
    }
    samples["frame"] = np.concatenate(
        [match.samples["frame"] + offset for match, offset in zip(cleaned, offsets, strict=True)]
    ).astype(np.int32)
    samples["split"] = np.repeat(
        np.array([splits[entry.match_id] for entry in entries], np.uint8),
        [len(match.samples["kind"]) for match in cleaned],
    )
    return frames, samples


def _pad_types(types: Sequence[NDArray[np.float64]]) -> NDArray[np.float32]:
    """(n_matches, n_types, n_fields); matches with fewer types repeat type 0."""
    most = max(1, *map(len, types))
    default = np.array([DEFAULTS[name] for name in FIELDS])
    padded = np.empty((len(types), most, len(FIELDS)), np.float32)
    for row, table in enumerate(types):
        padded[row] = table[0] if len(table) else default
        padded[row, : len(table)] = table
    return padded


def _report(
    config: DatasetConfig,
    entries: Sequence[_Entry],
    cleaned: Sequence[MatchSamples],
    *,
    splits: dict[str, layout.Split],
    samples: dict[str, NDArray[Any]],
    frames: dict[str, NDArray[Any]],
    without_team: int,
) -> dict[str, Any]:
    kinds = [kind.name.lower() for kind in CLONED_KINDS]

    def by_kind(mask: NDArray[np.bool_]) -> dict[str, int]:
        counts = np.bincount(samples["kind"][mask], minlength=len(kinds))
        return dict(zip(kinds, map(int, counts), strict=True))

    totals = [
        {
            "name": rule.name,
            "before": sum(match.rules[index].before for match in cleaned),
            "after": sum(match.rules[index].after for match in cleaned),
        }
        for index, rule in enumerate(cleaned[0].rules)
    ]
    by_rows = config.split is SplitBy.ROWS
    match_of_sample = frames["match"][samples["frame"]]
    matches = []
    for index, (entry, match) in enumerate(zip(entries, cleaned, strict=True)):
        split = splits[entry.match_id]
        matches.append(
            {
                "match_id": entry.match_id,
                "name": entry.name,
                "opponent": entry.opponent,
                "side": "left" if entry.side > 0 else "right",
                "split": "rows" if by_rows and split is not layout.Split.UNSEEN else split.name.lower(),
                "frames": len(match.frames["cycle"]),
                "rows": by_kind(match_of_sample == index),
                "player_cycles": match.player_cycles,
                "idle": match.idle,
                "frozen": match.frozen,
                "rules": [asdict(rule) for rule in match.rules],
            }
        )
    return {
        "team": config.team,
        "matches_without_team": without_team,
        "rules": totals,
        "rows": {split.name.lower(): by_kind(samples["split"] == split) for split in layout.Split},
        "executed": int(samples["executed"].sum()),
        "turn_zero": int(samples["turn_zero"].sum()),
        "player_cycles": sum(match.player_cycles for match in cleaned),
        "idle": sum(match.idle for match in cleaned),
        "frozen": sum(match.frozen for match in cleaned),
        "matches": matches,
    }
