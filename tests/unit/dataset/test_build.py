"""From a store to a dataset: the same bytes however it is made, memory that does not grow, and nothing half done."""

from __future__ import annotations

import dataclasses
import fcntl
import json
import os
import shutil
import subprocess
import sys
import time
import tracemalloc
from collections import Counter
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import torch

from disk import small_disk
from teamclone.dataset import build, layout
from teamclone.dataset.build import DatasetConfig, Sources, SplitBy, build_dataset, is_current
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import open_dataset
from teamclone.errors import ClusterError, DatasetError, StoreError, UsageError
from teamclone.logs import Match, read_match
from teamclone.rcss.commands import CLONED, REPERTOIRE
from teamclone.store import Store, create_store, open_store
from teamclone.world.channels import CHANNEL, FLAG_GOALIE

TEAM = "HELIOS_base"
MATCHES = 5


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory, fixtures_dir: Path) -> Store:
    """One short match under several names."""
    (log,) = (fixtures_dir / "v6").glob("*.rcg.gz")
    match = read_match(log)
    made = create_store(tmp_path_factory.mktemp("store") / "store")
    for number in range(MATCHES):
        made.add(dataclasses.replace(match, match_id=f"{number:016x}"))
    return made


@pytest.fixture
def config(store: Store) -> DatasetConfig:
    (row,) = {(row["left_name"], row["right_name"]) for row in store.matches().to_pylist()}
    return DatasetConfig(teams=(row[0],))


class Backwards(ThreadPoolExecutor):
    """Ends the first task last."""

    rest = 0.3

    def submit(self, function: Callable[..., Any], /, *args: Any, **options: Any) -> Future[Any]:
        self.rest, rest = self.rest / 2, self.rest

        def wait_first() -> Any:
            time.sleep(rest)
            return function(*args, **options)

        return super().submit(wait_first)


class Failing(Executor):
    """Every task ends with this error; None drops them."""

    def __init__(self, error: Exception | None) -> None:
        self.error = error

    def submit(self, function: Callable[..., Any], /, *args: Any, **options: Any) -> Future[Any]:
        future: Future[Any] = Future()
        if self.error is None:
            future.cancel()
            future.set_running_or_notify_cancel()
        else:
            future.set_exception(self.error)
        return future


def content(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("split", SplitBy)
def test_the_same_bytes_wherever_matches_are_cleaned(
    store: Store, config: DatasetConfig, tmp_path: Path, split: SplitBy
) -> None:
    config = dataclasses.replace(config, split=split)
    reports = [
        build_dataset(config, store=store, out=tmp_path / "one", jobs=1),
        build_dataset(config, store=store, out=tmp_path / "two", jobs=2),
    ]
    with Backwards(MATCHES) as executor:
        reports.append(build_dataset(config, store=store, out=tmp_path / "any", executor=executor))
    one = content(tmp_path / "one")
    assert len(one) == 20
    for name, report in zip(("two", "any"), reports[1:], strict=True):
        assert content(tmp_path / name) == one
        assert report == reports[0]


def test_building_does_without_pytorch() -> None:
    """Which takes seconds to import, in every worker."""
    code = "import sys, teamclone.dataset.build; sys.exit('torch' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_matches_lie_behind_one_another(store: Store, config: DatasetConfig, tmp_path: Path) -> None:
    report = build_dataset(config, store=store, out=tmp_path / "ds", jobs=1)
    dataset = open_dataset(tmp_path / "ds")
    n = len(dataset) // MATCHES
    assert n > 1000
    first, last = np.arange(n), np.arange(len(dataset) - n, len(dataset))
    assert dataset.match(first).unique().tolist() == [0]
    assert dataset.match(last).unique().tolist() == [MATCHES - 1]
    # The same match each time: the same states and commands.
    assert dataset.state(last).players.equal(dataset.state(first).players)
    assert dataset.target(last).parameters.equal(dataset.target(first).parameters)
    splits = Counter(match["split"] for match in report["matches"])
    assert {split: sum(rows.values()) for split, rows in report["rows"].items() if any(rows.values())} == {
        split: count * n for split, count in splits.items()
    }
    assert report["executed"] == len(dataset)
    assert sum(match["idle"] for match in report["matches"]) == report["idle"]


def test_rows_are_split_within_each_match(store: Store, config: DatasetConfig, tmp_path: Path) -> None:
    build_dataset(dataclasses.replace(config, split=SplitBy.ROWS), store=store, out=tmp_path / "ds", jobs=1)
    dataset = open_dataset(tmp_path / "ds")
    for match in range(MATCHES):
        of_match = dataset.samples["split"][dataset.match(np.arange(len(dataset))) == match].numpy()
        assert (of_match == Split.TRAIN).mean() == pytest.approx(0.95, abs=1e-3)
        assert (of_match == Split.TEST).mean() == pytest.approx(0.025, abs=1e-3)


def test_a_match_of_two_modelled_teams_is_seen_from_both_sides(store: Store, tmp_path: Path) -> None:
    (pair,) = {(row["left_name"], row["right_name"]) for row in store.matches().to_pylist()}
    for split in SplitBy:
        report = build_dataset(DatasetConfig(teams=pair, split=split), store=store, out=tmp_path / split, jobs=1)
        dataset = open_dataset(tmp_path / split)
        assert (dataset.meta["team"], dataset.meta["teams"]) == (" + ".join(pair), list(pair))
        assert dataset.meta["options"]["team"] == list(pair)
        assert report["matches_without_team"] == 0
        twins = list(zip(dataset.matches[::2], dataset.matches[1::2], strict=True))
        assert len(twins) == MATCHES
        for left, right in twins:
            assert (left["team"], right["opponent"], left["side"], right["side"]) == (*pair[:1] * 2, "left", "right")
            assert (right["team"], left["opponent"]) == (*pair[1:] * 2,)
            assert (left["match_id"], left["split"]) == (right["match_id"], right["split"])
    assert {match["split"] for match in open_dataset(tmp_path / "match").matches} >= {"train", "validation", "test"}

    # Each entry is the same as in the dataset of its team alone.
    pooled = open_dataset(tmp_path / "match")
    index = pooled.match(np.arange(len(pooled)))
    for side, team in enumerate(pair):
        build_dataset(DatasetConfig(teams=(team,)), store=store, out=tmp_path / team, jobs=1)
        alone = open_dataset(tmp_path / team)
        rows = np.flatnonzero(index % 2 == side)
        assert len(rows) == len(alone) > 0
        every = np.arange(len(alone))
        assert pooled.state(rows).players.equal(alone.state(every).players)
        assert pooled.target(rows).parameters.equal(alone.target(every).parameters)
        assert "teams" not in alone.meta
        assert alone.meta["options"]["team"] == alone.meta["team"] == team
        assert not any("team" in match for match in alone.matches)


def test_a_match_against_an_unseen_team_is_unseen_from_both_sides(store: Store, tmp_path: Path) -> None:
    (pair,) = {(row["left_name"], row["right_name"]) for row in store.matches().to_pylist()}
    report = build_dataset(DatasetConfig(teams=pair, unseen=pair[1:]), store=store, out=tmp_path / "ds", jobs=1)
    assert {match["split"] for match in report["matches"]} == {"unseen"}


def test_goalkeepers_are_for_training_only(store: Store, config: DatasetConfig, tmp_path: Path) -> None:
    found = {}
    for keepers in (False, True):
        made = dataclasses.replace(config, train_goalkeepers=keepers)
        report = build_dataset(made, store=store, out=tmp_path / str(keepers), jobs=1)
        dataset = open_dataset(tmp_path / str(keepers))
        assert dataset.meta["options"]["train_goalkeepers"] is keepers
        splits, n = dataset.samples["split"].numpy(), np.arange(len(dataset))
        state = dataset.state(n)
        flags = state.players[state.frame, state.actor, CHANNEL["flags"]].numpy().astype(int)
        keeper = (flags & FLAG_GOALIE) != 0
        assert keeper.any() == keepers
        assert set(splits[keeper].tolist()) <= {Split.TRAIN}
        assert {split for split, rows in report["rows"].items() if any(rows.values())} == {
            "train",
            "validation",
            "test",
        }
        found[keepers] = [dataset.target(n[~keeper]), splits[~keeper]]
    # Nothing else is changed by them.
    assert torch.equal(found[True][0].parameters, found[False][0].parameters)
    np.testing.assert_array_equal(found[True][1], found[False][1])


def test_goalkeepers_stay_out_of_a_match_against_an_unseen_team(store: Store, tmp_path: Path) -> None:
    (pair,) = {(row["left_name"], row["right_name"]) for row in store.matches().to_pylist()}
    counts = []
    for keepers in (False, True):
        config = DatasetConfig(teams=pair[:1], unseen=pair[1:], train_goalkeepers=keepers)
        build_dataset(config, store=store, out=tmp_path / str(keepers), jobs=1)
        counts.append(len(open_dataset(tmp_path / str(keepers))))
    assert counts[0] == counts[1]


def test_beyond_play_on_is_written_only_where_it_is_asked_for(
    store: Store, config: DatasetConfig, tmp_path: Path
) -> None:
    usual = build_dataset(config, store=store, out=tmp_path / "usual", jobs=1)
    whole = dataclasses.replace(config, goalkeepers=True, set_plays=True, idle=True)
    report = build_dataset(whole, store=store, out=tmp_path / "whole", jobs=1)
    meta = open_dataset(tmp_path / "usual").meta
    assert "commands" not in meta
    assert not {"goalkeepers", "set_plays", "idle"} & set(meta["options"])
    dataset = open_dataset(tmp_path / "whole")
    assert dataset.commands == REPERTOIRE
    assert {name: dataset.meta["options"][name] for name in ("goalkeepers", "set_plays", "idle")} == {
        "goalkeepers": True,
        "set_plays": True,
        "idle": True,
    }
    for split in ("train", "validation", "test"):
        assert tuple(report["rows"][split]) == REPERTOIRE
        assert sum(report["rows"][split].values()) > sum(usual["rows"][split].values()) > 0
    state = dataset.state(np.arange(len(dataset)))
    keeper = (state.players[state.frame, state.actor, CHANNEL["flags"]].long() & FLAG_GOALIE) != 0
    assert set(dataset.samples["split"][keeper].tolist()) == {Split.TRAIN, Split.VALIDATION, Split.TEST}
    assert is_current(tmp_path / "usual", config, store)
    assert is_current(tmp_path / "whole", whole, store)
    assert not is_current(tmp_path / "usual", whole, store)


@pytest.mark.parametrize(
    ("options", "commands"),
    [({"goalkeepers": True}, "catch"), ({"set_plays": True}, "move"), ({"idle": True}, "none")],
)
def test_each_option_adds_its_command(config: DatasetConfig, options: dict[str, bool], commands: str) -> None:
    assert config.repertoire == CLONED
    assert dataclasses.replace(config, **options).repertoire == (*CLONED, commands)


def test_goalkeepers_in_training_alone_and_everywhere_exclude_each_other(
    store: Store, config: DatasetConfig, tmp_path: Path
) -> None:
    config = dataclasses.replace(config, goalkeepers=True, train_goalkeepers=True)
    with pytest.raises(UsageError, match=r"--goalkeepers takes .* in every split; leave out --train-goalkeepers"):
        build_dataset(config, store=store, out=tmp_path / "ds", jobs=1)
    assert list(tmp_path.iterdir()) == []


def test_goalkeepers_need_a_split_by_match(store: Store, config: DatasetConfig, tmp_path: Path) -> None:
    config = dataclasses.replace(config, split=SplitBy.ROWS, train_goalkeepers=True)
    with pytest.raises(UsageError, match=r"--train-goalkeepers keeps goalkeepers out .*; it needs --split match"):
        build_dataset(config, store=store, out=tmp_path / "ds", jobs=1)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("teams", "message"),
    [
        ((TEAM, "HELIOS_bse"), r"team 'HELIOS_bse' is in no match of the store; did you mean HELIOS_base\?"),
        ((TEAM, TEAM), "expected different teams, got HELIOS_base, HELIOS_base; name each once"),
        ((), "expected different teams, got none"),
    ],
)
def test_teams_that_cannot_be_pooled(store: Store, tmp_path: Path, teams: tuple[str, ...], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        build_dataset(DatasetConfig(teams=teams), store=store, out=tmp_path / "ds", jobs=1)


@pytest.fixture(scope="module")
def mixed(tmp_path_factory: pytest.TempPathFactory, fixtures_dir: Path) -> Store:
    """Three matches with a command log, three without, and three in which nobody plays."""
    (log,) = (fixtures_dir / "v6").glob("*.rcg.gz")
    match = read_match(log)
    alone = dataclasses.replace(match, log=None, rcl_path=None)
    mode = match.frames | {"playmode": np.full_like(match.frames["playmode"], 1)}
    idle = dataclasses.replace(match, game=dataclasses.replace(match.game, frames=mode))
    made = create_store(tmp_path_factory.mktemp("mixed") / "store")
    for number, one in enumerate((match, alone, idle) * 3):
        made.add(dataclasses.replace(one, match_id=f"{number:016x}"))
    return made


@pytest.mark.parametrize(
    ("source", "sources", "without"),
    [
        (Sources.ANY, ["logged", "recovered"] * 3, 3),
        (Sources.LOGGED, ["logged"] * 3, 6),
        (Sources.RECOVERED, ["recovered"] * 6, 3),
    ],
)
def test_sources_of_commands(mixed: Store, tmp_path: Path, source: Sources, sources: list[str], without: int) -> None:
    config = DatasetConfig(teams=(TEAM,), source=source)
    report = build_dataset(config, store=mixed, out=tmp_path / "ds", jobs=1)
    assert [match["source"] for match in report["matches"]] == sources
    # Every split has rows: those without commands are in none.
    assert len(report["matches_without_commands"]) == without
    assert len(mixed.match_ids()) - len(report["matches"]) == without
    assert all(sum(report["rows"][split].values()) for split in ("train", "validation", "test"))
    dataset = open_dataset(tmp_path / "ds")
    assert is_current(tmp_path / "ds", config, mixed)
    target = dataset.target(np.arange(len(dataset)))
    if source is Sources.LOGGED:
        assert target.interval is None
        assert report["recovered"] == 0
        return
    assert target.interval is not None
    assert torch.isfinite(target.parameters).all()
    match = dataset.match(np.arange(len(dataset)))
    recovered = torch.tensor([row["source"] == "recovered" for row in dataset.matches])[match]
    assert report["recovered"] == int(recovered.sum())
    assert (target.interval[~recovered] == 0).all()
    assert (target.interval[recovered][..., 0] <= 0).all()
    assert (target.interval[recovered][..., 1] >= 0).all()
    dashes = recovered & (target.kind == 0)
    width = target.interval[dashes, 0, 1] - target.interval[dashes, 0, 0]
    assert 0 < float(width.median()) < 1


def one_sided(fixtures_dir: Path, folder: Path) -> tuple[Match, Store]:
    """A match whose command log has the left team alone, and a store with it."""
    (log,) = (fixtures_dir / "v6").glob("*.rcg.gz")
    match = read_match(log)
    assert match.log is not None
    ours = {name: values[match.commands["side"] >= 0] for name, values in match.log.commands.items()}
    made = create_store(folder)
    made.add(dataclasses.replace(match, log=dataclasses.replace(match.log, commands=ours)))
    return match, made


def test_a_match_of_two_teams_of_which_one_did_nothing(tmp_path: Path, fixtures_dir: Path) -> None:
    match, made = one_sided(fixtures_dir, tmp_path / "store")
    config = DatasetConfig(teams=(match.left.name or "", match.right.name or ""), test=0, validation=0)
    report = build_dataset(config, store=made, out=tmp_path / "ds", jobs=1)
    assert [row["side"] for row in report["matches"]] == ["left"]
    assert report["matches_without_commands"] == []


def test_a_game_log_that_implies_nothing_costs_no_other(
    mixed: Store, config: DatasetConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*arguments: object, **options: object) -> None:
        raise UsageError("says too little")

    monkeypatch.setattr(build, "recovered_commands", fails)
    config = dataclasses.replace(config, source=Sources.RECOVERED)
    report = build_dataset(config, store=mixed, out=tmp_path / "ds", jobs=1)
    assert [sum(match["rows"].values()) > 0 for match in report["matches"]] == [False, True] * 3


@pytest.mark.parametrize(
    ("name", "value"), [("x", np.nan), ("y", np.inf), ("stamina", np.nan), ("vx", -np.inf), ("type", 200)]
)
def test_frames_with_impossible_numbers_are_left_out(
    tmp_path: Path, fixtures_dir: Path, name: str, value: float
) -> None:
    (log,) = (fixtures_dir / "v6").glob("*.rcg.gz")
    match, made = read_match(log), create_store(tmp_path / "store")
    values = match.players[name].copy()
    values[100:110, 15] = value
    game = dataclasses.replace(match.game, players=match.players | {name: values})
    made.add(dataclasses.replace(match, match_id="0" * 16, game=game))
    made.add(match)
    config = DatasetConfig(teams=(TEAM,), test=0, validation=0)
    report = build_dataset(config, store=made, out=tmp_path / "ds", jobs=1)
    odd, sound = report["matches"]
    assert 0 < odd["odd_frames"] <= 10
    assert sound["odd_frames"] == 0
    assert sum(odd["rows"].values()) == sum(sound["rows"].values()) - 10 * odd["odd_frames"]
    dataset = open_dataset(tmp_path / "ds")
    assert torch.isfinite(dataset.frames["position"]).all()
    assert (dataset.frames["measured"] != layout.MISSING).all()


@pytest.mark.parametrize(("name", "value"), [("max_dash_power", 1e308), ("ball_decay", 1.0), ("ball_size", -1.0)])
def test_a_match_by_impossible_rules_is_left_out_and_named(
    tmp_path: Path, fixtures_dir: Path, name: str, value: float
) -> None:
    (log,) = (fixtures_dir / "v6").glob("*.rcg.gz")
    match, made = read_match(log), create_store(tmp_path / "store")
    game = dataclasses.replace(match.game, server_params=match.game.server_params | {name: value})
    made.add(dataclasses.replace(match, match_id="0" * 16, game=game))
    made.add(match)
    config = DatasetConfig(teams=(TEAM,), test=0, validation=0)
    report = build_dataset(config, store=made, out=tmp_path / "ds", jobs=1)
    odd, sound = report["matches"]
    assert f"expected {name} to be" in odd["left_out"]
    assert sum(odd["rows"].values()) == 0
    assert sound["left_out"] is None
    assert (report["player_cycles"], report["idle"]) == (sound["player_cycles"], sound["idle"])
    assert torch.isfinite(open_dataset(tmp_path / "ds").target(np.arange(10)).parameters).all()


def test_a_command_log_that_comes_later_makes_a_dataset_old(
    config: DatasetConfig, tmp_path: Path, fixtures_dir: Path
) -> None:
    (log,) = (fixtures_dir / "v6").glob("*.rcg.gz")
    match, made = read_match(log), create_store(tmp_path / "store")
    made.add(dataclasses.replace(match, log=None, rcl_path=None))
    config = dataclasses.replace(config, test=0, validation=0)
    build_dataset(config, store=made, out=tmp_path / "ds", jobs=1)
    assert is_current(tmp_path / "ds", config, made)
    made.add(match)
    assert not is_current(tmp_path / "ds", config, made)
    recovered = dataclasses.replace(config, source=Sources.RECOVERED)
    build_dataset(recovered, store=made, out=tmp_path / "recovered", jobs=1)
    assert is_current(tmp_path / "recovered", recovered, made)


def test_a_side_that_its_command_log_lacks_is_recovered(tmp_path: Path, fixtures_dir: Path) -> None:
    match, made = one_sided(fixtures_dir, tmp_path / "store")
    config = DatasetConfig(teams=(match.right.name or "",), test=0, validation=0)
    with pytest.raises(DatasetError, match="no match has any"):
        build_dataset(config, store=made, out=tmp_path / "ds", jobs=1)
    config = dataclasses.replace(config, source=Sources.RECOVERED)
    report = build_dataset(config, store=made, out=tmp_path / "ds", jobs=1)
    assert report["recovered"] > 1000


def test_logs_that_do_not_show_what_was_executed_are_in_no_split(tmp_path: Path, fixtures_dir: Path) -> None:
    made = create_store(tmp_path / "store")
    for name in ("native-v1", "native-v2", "v6"):
        (log,) = (fixtures_dir / name).glob("*.rcg*")
        made.add(read_match(log))
    teams = {row[side] for row in made.matches().to_pylist() for side in ("left_name", "right_name")} - {None}
    config = DatasetConfig(teams=tuple(sorted(teams)), test=0, validation=0)
    report = build_dataset(config, store=made, out=tmp_path / "ds", jobs=1)
    assert len({row["match_id"] for row in report["matches"]}) == 1
    assert len(report["matches_without_commands"]) == 2


def test_recovered_when_ingested_or_when_cleaned_is_the_same(
    mixed: Store, config: DatasetConfig, tmp_path: Path
) -> None:
    report = build_dataset(
        dataclasses.replace(config, source=Sources.RECOVERED), store=mixed, out=tmp_path / "ds", jobs=1
    )
    first, second, *_ = report["matches"]  # of a store with and without the command log
    for name in ("frames", "rows", "executed", "turn_zero", "idle"):
        assert first[name] == second[name]


def test_nothing_but_matches_without_commands(mixed: Store, config: DatasetConfig, tmp_path: Path) -> None:
    made = create_store(tmp_path / "store")
    (log,) = (Path(__file__).parents[2] / "data" / "fixtures" / "v6").glob("*.rcg.gz")
    made.add(dataclasses.replace(read_match(log), log=None, rcl_path=None))
    with pytest.raises(DatasetError, match="no match has logged commands of HELIOS_base"):
        build_dataset(dataclasses.replace(config, source=Sources.LOGGED), store=made, out=tmp_path / "ds", jobs=1)
    assert not (tmp_path / "ds").exists()


def test_memory_does_not_grow_with_the_matches(store: Store, config: DatasetConfig, tmp_path: Path) -> None:
    folder = Path(store.location)
    many = Path(shutil.copytree(folder, tmp_path / "many"))
    for number in range(5 * MATCHES):
        copy = many / "matches" / f"f{number:015x}"
        shutil.copytree(folder / "matches" / store.match_ids()[0], copy)
        row = pq.read_table(copy / "matches.parquet")
        pq.write_table(row.set_column(0, row.schema.field(0), pa.array([copy.name])), copy / "matches.parquet")
    peaks = []
    # The first run fills caches; of two the smaller, since threads of earlier tests may be at work.
    for number, made in enumerate((store, store, open_store(many), open_store(many))):
        tracemalloc.start()
        build_dataset(config, store=made, out=tmp_path / f"ds{number}", jobs=1)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    size = sum(path.stat().st_size for path in (tmp_path / "ds1").rglob("*.npy"))
    assert min(peaks[2:]) - peaks[1] < size / 2


def test_a_killed_worker_is_named(store: Store, config: DatasetConfig, tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match=r"HELIOS.*the process that cleaned it was killed"):
        build_dataset(config, store=store, out=tmp_path / "ds", executor=Failing(BrokenExecutor()))
    with pytest.raises(ClusterError, match="connection to the workers was lost"):
        build_dataset(config, store=store, out=tmp_path / "ds", executor=Failing(None))
    assert list(tmp_path.iterdir()) == []


def test_a_worker_that_does_not_see_the_store(store: Store, config: DatasetConfig, tmp_path: Path) -> None:
    marker = Path(store.location) / "store.json"

    class Elsewhere(Executor):
        """A machine on which another store lies at the same place."""

        def submit(self, function: Callable[..., Any], /, *args: Any, **options: Any) -> Future[Any]:
            future: Future[Any] = Future()
            before = marker.stat().st_mtime_ns
            os.utime(marker, ns=(1, 1))
            try:
                future.set_result(function(*args, **options))
            except StoreError as error:
                future.set_exception(error)
            finally:
                os.utime(marker, ns=(before, before))
            return future

    with pytest.raises(StoreError, match=r"the worker on .* does not see this store"):
        build_dataset(config, store=store, out=tmp_path / "ds", executor=Elsewhere())
    assert list(tmp_path.iterdir()) == []


# -- nothing half done -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kilobytes", [16, 400])
def test_a_full_disk(store: Store, config: DatasetConfig, tmp_path: Path, kilobytes: int) -> None:
    with small_disk(tmp_path / "disk", kilobytes=kilobytes) as disk:
        with pytest.raises(DatasetError, match="ds: the disk is full; make room") as caught:
            build_dataset(config, store=store, out=disk / "ds", jobs=1)
        assert "\n" not in str(caught.value)
        assert list(disk.iterdir()) == []


def test_a_folder_that_cannot_be_made(store: Store, config: DatasetConfig, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(DatasetError, match="cannot be written"):
        build_dataset(config, store=store, out=tmp_path / "file" / "ds", jobs=1)


def test_what_is_there_stays_until_the_new_one_is_whole(store: Store, config: DatasetConfig, tmp_path: Path) -> None:
    out = tmp_path / "ds"
    build_dataset(config, store=store, out=out, jobs=1)
    before = content(out)
    with pytest.raises(DatasetError, match="already exists"):
        build_dataset(config, store=store, out=out, jobs=1)
    with pytest.raises(DatasetError, match="was killed"):
        build_dataset(config, store=store, out=out, replace=True, executor=Failing(BrokenExecutor()))
    assert content(out) == before
    build_dataset(dataclasses.replace(config, seed=7), store=store, out=out, replace=True, jobs=1)
    assert json.loads((out / "dataset.json").read_text())["options"]["seed"] == 7
    assert list(tmp_path.iterdir()) == [out]


def test_of_two_writers_at_once_the_later_one_does_not_take_the_place(
    store: Store, config: DatasetConfig, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    build_dataset(dataclasses.replace(config, seed=7), store=store, out=tmp_path / "other", jobs=1)
    meta = build._meta

    def meanwhile(*arguments: Any) -> dict[str, Any]:
        """Another process ends just before ours."""
        (tmp_path / "other").rename(tmp_path / "ds")
        return meta(*arguments)

    monkeypatch.setattr(build, "_meta", meanwhile)
    with pytest.raises(DatasetError, match="another process has just made it"):
        build_dataset(config, store=store, out=tmp_path / "ds", jobs=1)
    assert json.loads((tmp_path / "ds" / "dataset.json").read_text())["options"]["seed"] == 7
    assert list(tmp_path.iterdir()) == [tmp_path / "ds"]


def test_leftovers_of_killed_writers_go_but_not_those_at_work(
    store: Store, config: DatasetConfig, tmp_path: Path
) -> None:
    dead, alive, other = (tmp_path / name for name in (".ds.12.part", ".ds.13.part", ".ds2.14.part"))
    for folder in (dead, alive, other):
        (folder / "frames").mkdir(parents=True)
    handle = os.open(alive, os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        build_dataset(config, store=store, out=tmp_path / "ds", jobs=1)
    finally:
        os.close(handle)
    assert sorted(tmp_path.iterdir()) == [alive, other, tmp_path / "ds"]
