"""The benchmark of a panel of teams: what is done, what is kept, and its page, from a small run on a made dataset."""

from __future__ import annotations

import json
import re
import shutil
from pathlib import Path

import panel
import pytest
from tests.synthetic import make_dataset

from teamclone.dataset.reader import open_dataset
from teamclone.evaluation.evaluate import evaluate_and_save
from teamclone.training.adapt import adaptation
from teamclone.training.config import load_config
from teamclone.training.loop import train
from teamclone.training.run import open_run

TINY = (
    *("data.batch_size=128", "data.batches_per_epoch=3", "data.validation_batches=2", "train.epochs=1"),
    *("model.hidden=[16]", "model.kick_hidden=[16]", "model.parameter_hidden=[16]", "model.target_hidden=[16]"),
    "train.precision=fp32",
)


def options(out: Path, *more: str) -> list[str]:
    return ["LOGS", "--out", str(out), "--seeds", "1", *more, *(part for item in TINY for part in ("--set", item))]


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """All commands of three entries have been run: one has a clone, one tests it, one adapts it."""
    folder = tmp_path_factory.mktemp("panel")
    for name in ("full", "tournament", "all"):
        (folder / "stores" / name).mkdir(parents=True)
    for name, frames in (("helios", 120), ("helios-in-tournament", 110), ("yushan", 100)):
        make_dataset(folder / "datasets" / name, frames_per_match=frames)
    run = folder / "runs" / "helios-0"
    data = open_dataset(folder / "datasets" / "helios")
    train(load_config("best", [*TINY, "train.seed=0", "train.threads=1"]), data, run)
    (folder / "runs" / "helios-0.json").write_text('{"seconds": 61.0}')
    evaluate_and_save(open_run(run))
    evaluate_and_save(open_run(run), dataset=folder / "datasets" / "helios-in-tournament")
    base = Path(shutil.copytree(run, folder / "runs" / "base-0"))
    config, start = adaptation(open_run(base), ["train.seed=0", "train.threads=1"])
    adapted = folder / "runs" / "yushan-adapted-0"
    train(config, open_dataset(folder / "datasets" / "yushan"), adapted, base=start)
    (folder / "runs" / "yushan-adapted-0.json").write_text('{"seconds": 9.0}')
    evaluate_and_save(open_run(adapted))
    return folder


def work(out: Path, *more: str) -> panel.Work:
    return panel.Work(panel.parser().parse_args(options(out, *more)))


def test_results_are_kept_and_their_page_has_their_numbers(out: Path) -> None:
    made = work(out)
    for name in ("helios", "helios-in-tournament", "yushan-adapted"):
        assert made.tried(panel.BY_NAME[name], 0) is None
    before = {path: path.stat().st_mtime_ns for path in (out / "results").iterdir()}
    assert made.tried(panel.PANEL[0], 0) is None
    assert {path: path.stat().st_mtime_ns for path in (out / "results").iterdir()} == before
    text = panel.page(made, made.results())
    for team, evaluation in (
        ("HELIOS_base | full state", "helios-0/evaluation.json"),
        ("HELIOS_base | tournament, trained with full state", "helios-0/evaluation-helios-in-tournament.json"),
        ("YuShan2024 | tournament; adapted", "yushan-adapted-0/evaluation.json"),
    ):
        model = json.loads((out / "runs" / evaluation).read_text())["splits"]["test"]["model"]
        row = next(line for line in text.splitlines() if line.startswith(f"| {team} |"))
        assert f"| {model['accuracy']['value']:.3f} |" in row
        assert f"| {model['cross_entropy']['value']:.3f} |" in row
    assert "| 0.955 |" in text
    assert "seeds" not in re.search(r"## Goals.*?\n\n(.*?)\n\n", text, re.DOTALL)[1]
    assert "teamclone train DIR/datasets/helios --preset best --set data.batch_size=128" in text
    assert "teamclone evaluate DIR/runs/helios-0 --data DIR/datasets/helios-in-tournament" in text
    assert "teamclone adapt DIR/runs/base-0 DIR/datasets/yushan --set train.seed=0" in text


def test_what_was_made_with_other_settings_is_not_taken(out: Path) -> None:
    assert work(out).tried(panel.PANEL[0], 0) is None
    made = work(out, "--set", "model.kick_candidates=8")
    assert "made with other settings" in (made.tried(panel.PANEL[0], 0) or "")
    (out / "results" / "helios-0.json").unlink()  # its run is there still
    assert "trained with other settings" in (made.tried(panel.PANEL[0], 0) or "")


def test_seeds_lie_apart() -> None:
    assert panel.spread([0.5], 3) == "0.500"
    assert panel.spread([0.5, 0.6, 0.52], 3) == "0.540 ± 0.050"
    assert panel.spread([float("nan")], 1) == "-"


def test_entries_without_matches_are_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "1-WEBase_0-vs-HELIOS_base_20.rcg.xz").touch()
    chosen = panel.parser().parse_args([str(tmp_path), "--out", "OUT"])
    assert [entry.name for entry in panel.wanted(chosen)] == ["helios", "webase"]
    assert "yushan: no match of YuShan2024" in capsys.readouterr().err
    (tmp_path / "2-WEBase_1-vs-Cyrus2DBase_0.rcg.xz").touch()
    assert "base" in [entry.name for entry in panel.wanted(chosen)]
    chosen.only = ["webase-adapted"]
    assert panel.wanted(chosen) == []
    said = capsys.readouterr().err
    assert "base-without-webase: no match of YuShan2024 in" in said
    assert "webase-adapted: nothing to adapt without base-without-webase" in said
    chosen.only = ["helios-in-tournament", "nobody"]
    with pytest.raises(SystemExit, match="no nobody; there are helios,"):
        panel.wanted(chosen)
    chosen.only, chosen.set = ["webase"], ["model.nothing=1"]
    with pytest.raises(Exception, match="nothing"):
        panel.wanted(chosen)
