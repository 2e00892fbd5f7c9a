"""`teamclone export`: what it writes is enough, and what was changed afterwards is noticed."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.command import called
from tests.cpp import compiled
from tests.synthetic import make_dataset

import teamclone as tc
from teamclone.dataset.reader import open_dataset
from teamclone.engine.inputs.project import Frames
from teamclone.engine.network.weights import read_weights
from teamclone.export.contract import compared
from teamclone.training.config import load_config
from teamclone.training.loop import train

PAGE = Path(__file__).resolve().parents[2] / "docs" / "reference" / "commands" / "export.md"
needs_compiler = pytest.mark.skipif(shutil.which("g++") is None, reason="no g++: the header is not compiled")


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export")
    make_dataset(folder / "ds", frames_per_match=60)
    settings = [
        *("model.hidden=[24]", "model.parameter_hidden=[16]", "model.kick_hidden=[16]", "model.target_hidden=[16]"),
        *("model.kick_attention=8", "model.extra_kicks=8"),
        *("data.batch_size=128", "data.batches_per_epoch=3", "data.validation_batches=2"),
        *("train.epochs=1", "train.threads=1", "train.precision=fp32", "train.device=cpu"),
    ]
    train(load_config("best", settings), open_dataset(folder / "ds"), folder / "run")
    return folder / "run"


@pytest.fixture(scope="module")
def export(run: Path) -> Path:
    out = run.parent / "export"
    assert "teamclone export --check" in called("export", run, "--out", out).stdout
    return out


def test_the_contract_says_what_goes_in_and_comes_out(run: Path, export: Path) -> None:
    contract = json.loads((export / "contract.json").read_text(encoding="utf-8"))
    assert {path.name for path in export.iterdir()} == {*contract["files"], "contract.json", "check.cpp"}
    data = open_dataset(run.parent / "ds")
    assert contract["dataset"] == {"id": data.meta["id"], "matches": [match["match_id"] for match in data.matches]}
    assert contract["model_id"] == read_weights(export / "weights.bin").model_id
    assert contract["commands"] == ["dash", "turn", "kick", "tackle"]
    assert [one["name"] for one in contract["channels"]][:2] == ["x", "y"]
    assert len(contract["answers"]["near"]["values"]) == 200
    assert 5 < sum(contract["answers"]["near"]["values"]) < 200


@needs_compiler
def test_the_check_passes_in_python_and_compiled(export: Path) -> None:
    found = json.loads(called("export", "--check", export, "--json").stdout)
    for name in ("python", "cpp"):
        assert found[name]["close"]
        assert found[name]["n"] == 200
        assert found[name]["probability"] < 2e-5
    assert found["cpp"]["median_us"][0] > 0
    assert "compiled header" in called("export", "--check", export).stdout


def test_few_other_numbers_are_ties_and_many_are_none() -> None:
    near = {"near": np.ones(100), "answers": np.zeros((100, 4, 3))}
    for apart, close in ((0, True), (2, True), (3, False)):
        made = np.zeros((100, 4, 3))
        made[:apart, 2, 2] = 5.0
        made[50:, 1, 1] = 359.9999
        found = compared({"answers": made}, near, None)
        assert (found.apart, found.close) == (apart, close)
    assert not compared({"answers": np.full((100, 4, 3), 1e-4)}, near, None).close


def test_without_a_compiler_the_kernels_are_checked(export: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert "The header was not compiled" in called("export", "--check", export).stdout


def test_answers_that_differ_are_an_error(export: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    copy = tmp_path / "export"
    shutil.copytree(export, copy)
    contract = json.loads((copy / "contract.json").read_text(encoding="utf-8"))
    contract["answers"]["answers"]["values"][0] += 0.001
    (copy / "contract.json").write_text(json.dumps(contract), encoding="utf-8")
    assert "the answers are not those of the contract" in called("export", "--check", copy, code=1).stderr


@pytest.mark.parametrize("name", ["weights.bin", "teamclone.hpp"])
def test_a_file_that_was_changed_is_named(export: Path, tmp_path: Path, name: str) -> None:
    copy = tmp_path / "export"
    shutil.copytree(export, copy)
    (copy / name).write_bytes((copy / name).read_bytes()[:-1])
    assert f"{name}: missing, or not the file of this contract" in called("export", "--check", copy, code=1).stderr
    (copy / "contract.json").write_text('{"format": 1, "files": {}}', encoding="utf-8")
    assert "contract.json: " in called("export", "--check", copy, code=1).stderr


def test_a_header_from_elsewhere_is_not_compiled(export: Path, tmp_path: Path) -> None:
    """Even where the contract names it."""
    copy = tmp_path / "export"
    shutil.copytree(export, copy)
    header, contract = copy / "teamclone.hpp", json.loads((copy / "contract.json").read_text(encoding="utf-8"))
    header.write_text("#error compiled\n", encoding="utf-8")
    contract["files"]["teamclone.hpp"] = hashlib.sha256(header.read_bytes()).hexdigest()
    (copy / "contract.json").write_text(json.dumps(contract), encoding="utf-8")
    assert "not the header of this version" in called("export", "--check", copy, code=1).stderr


def test_wrong_use_is_told(run: Path, export: Path, tmp_path: Path) -> None:
    assert "give a run and --out FOLDER, or --check FOLDER" in called("export", run, code=2).stderr
    assert "expected cpp, got 'onnx'" in called("export", run, "--to", "onnx", "--out", tmp_path, code=2).stderr
    (tmp_path / "mine.txt").write_text("precious", encoding="utf-8")
    assert "expected a new or an empty folder" in called("export", run, "--out", tmp_path, code=2).stderr
    assert (tmp_path / "mine.txt").read_text(encoding="utf-8") == "precious"
    assert "no such folder" in called("export", "--check", tmp_path / "nowhere", code=1).stderr
    called("export", run, "--out", export)  # again


@needs_compiler
def test_the_example_of_the_page_compiles_and_answers(export: Path, tmp_path: Path) -> None:
    [example, *_] = re.findall(r"```cpp\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    source = tmp_path / "example.cpp"
    source.write_text(example, encoding="utf-8")
    header = (export / "teamclone.hpp").read_text(encoding="utf-8")
    program = compiled(tmp_path / "program", header, "example", source=source)
    done = subprocess.run([program], cwd=export, capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert [line.split()[0] for line in lines] == [str(number) for number in range(1, 12)]
    assert {line.split()[1] for line in lines} <= {"dash", "turn", "kick", "tackle"}


def test_a_compiled_clone_answers_as_the_network(run: Path) -> None:
    clone, data = tc.load(run), open_dataset(run.parent / "ds")
    state = data.state(np.arange(50))
    *frames, frame, actor = (part.numpy() for part in state)
    compiled_clone = clone.compiled()
    answers, near = compiled_clone.answers(Frames(*frames), frame, actor)
    probabilities = [compiled_clone.network.view(one).probabilities for one in answers]
    assert np.abs(np.array(probabilities) - clone.model.answer(state).probabilities.detach().numpy()).max() < 1e-5
    assert compiled_clone.commands == clone.commands
    one = compiled_clone.answer(Frames(*frames), int(actor[7]), frame=int(frame[7]))
    assert (one.probabilities == probabilities[7]).all()
    assert bool(one.asked[0]) == near[7]
