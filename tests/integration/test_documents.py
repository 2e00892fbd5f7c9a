"""The documents of stores, datasets, runs and searches, in every wrong shape: read, or refused in words."""

from __future__ import annotations

import json
import shutil
import tomllib
from pathlib import Path

import pytest

from mutations import OTHERS, check_readers, texts
from synthetic import make_dataset
from teamclone.dataset.build import DatasetConfig, is_current
from teamclone.dataset.reader import open_dataset
from teamclone.errors import RunError, TeamcloneError
from teamclone.evaluation.evaluate import evaluate_and_save
from teamclone.evaluation.latency import measure_run
from teamclone.logs import read_match
from teamclone.report.page import fresh_bench, fresh_evaluation, make_report
from teamclone.search.run import search
from teamclone.search.trials import Mode, SearchConfig, config_of, open_search
from teamclone.store import create_store, open_store
from teamclone.store.ingest import ingest
from teamclone.system.settings import to_toml
from teamclone.training.config import load_config
from teamclone.training.loop import train
from teamclone.training.run import Run, open_run

SETTINGS = ["model.hidden=[4]", "data.batch_size=64", "data.batches_per_epoch=1", "train.epochs=1", "train.threads=1"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A dataset, and a run with its evaluation and response times."""
    made = tmp_path_factory.mktemp("documents")
    make_dataset(made / "ds", frames_per_match=30)
    dataset = open_dataset(made / "ds")
    run = train(load_config("small", SETTINGS), dataset, made / "run")
    evaluate_and_save(run)
    measure_run(run, n=30)
    return made


def test_stores(tmp_path: Path, fixtures_dir: Path) -> None:
    (log,) = (fixtures_dir / "refused").glob("*.rcg.gz")
    store, match = create_store(tmp_path / "store"), read_match(log)
    ingest([log], store, jobs=1)
    check_readers(tmp_path / "store" / "store.json", lambda: open_store(tmp_path / "store"))
    (tmp_path / "store" / "store.json").touch()
    for path in (tmp_path / "store" / "files").iterdir():
        check_readers(path, lambda: [status.describes(log) for status in store.files()])
    (meta,) = (tmp_path / "store" / "matches").glob("*/meta.json")
    check_readers(meta, lambda: store._sources(match.match_id))


def test_datasets(folder: Path, tmp_path: Path) -> None:
    shutil.copytree(folder / "ds", tmp_path / "ds")
    store = create_store(tmp_path / "store")
    config = DatasetConfig(teams=("A",))

    def read() -> None:
        dataset = open_dataset(tmp_path / "ds")
        _ = dataset.id, dataset.commands, [match["opponent"] for match in dataset.matches]
        is_current(tmp_path / "ds", config, store)

    with pytest.raises(TeamcloneError, match="team 'A' is in no match"):
        read()
    check_readers(tmp_path / "ds" / "dataset.json", lambda: open_dataset(tmp_path / "ds").commands)


@pytest.fixture
def run(folder: Path, tmp_path: Path) -> Run:
    """A copy that a test may change."""
    shutil.copytree(folder / "run", tmp_path / "run")
    return open_run(tmp_path / "run")


def test_runs(run: Run) -> None:
    def read() -> None:
        opened = open_run(run.path)
        _ = opened.dataset_path, opened.dataset_id, opened.team, opened.history(), opened.best()
        fresh_evaluation(opened)
        fresh_bench(opened, checkpoint="best-loss")

    for name in ("environment.json", "metrics.jsonl"):
        check_readers(run.path / name, read)
    # Whether they are current is looked at before anything else.
    for name, few in (("evaluation.json", ("run", "dataset")), ("bench.json", ("model_id",))):
        whole = json.loads((run.path / name).read_bytes())
        for key in few:
            for other in OTHERS:
                (run.path / name).write_text(json.dumps(whole | {key: other}))
                read()
        (run.path / name).write_text(json.dumps(whole))


def test_settings_of_a_run(run: Run) -> None:
    path = run.path / "config.toml"
    whole = tomllib.loads(path.read_text())
    for words, text in texts(whole):
        try:
            written = to_toml(json.loads(text)).encode()
        except (AttributeError, ValueError, TypeError, RecursionError):  # no tables: the text as it is
            written = text
        path.write_bytes(written)
        try:
            open_run(run.path)
        except TeamcloneError:
            continue
        except Exception as error:
            raise AssertionError(f"{words}: {error!r}") from error
    for nested in (b"a = " + b"[" * 100_000, b"[" + b"a." * 100_000 + b"a]"):
        path.write_bytes(nested)
        with pytest.raises(RunError, match=r"config\.toml"):
            open_run(run.path)


def test_a_report_of_a_damaged_evaluation(run: Run) -> None:
    path = run.path / "evaluation.json"
    document = json.loads(path.read_bytes())
    document["splits"]["test"]["model"]["accuracy"] = "high"
    path.write_text(json.dumps(document))
    with pytest.raises(
        RunError, match=r"evaluation\.json or bench\.json is not what teamclone wrote .*make them again"
    ):
        make_report(run)


def test_searches(folder: Path, tmp_path: Path) -> None:
    base, dataset = load_config("small", SETTINGS), open_dataset(folder / "ds")
    search(SearchConfig(mode=Mode.BEAM, base=base, smallest=4, start=((4,),), iterations=0), dataset, tmp_path)

    def read() -> None:
        found = open_search(tmp_path)
        for trial in found.ranked():
            config_of(trial, found.config.base)

    check_readers(tmp_path / "search.json", read)
