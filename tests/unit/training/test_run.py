from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest
import safetensors.torch
import torch
from tests.synthetic import make_dataset

from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import RunError
from teamclone.models.clone import Clone
from teamclone.training.checkpoint import load_progress, load_weights, save_progress, save_weights
from teamclone.training.config import Config, load_config
from teamclone.training.optimiser import Optimiser, optimiser_of
from teamclone.training.run import FORMAT, create_run, locked, open_run


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return open_dataset(make_dataset(tmp_path_factory.mktemp("data") / "ds", frames_per_match=4))


@pytest.fixture
def config() -> Config:
    return load_config("small", ["model.hidden=[8]"])


def test_a_run_folder_says_what_it_was_made_from(tmp_path: Path, dataset: Dataset, config: Config) -> None:
    create_run(tmp_path / "run", config, dataset, device="cpu", precision="fp32")
    run = open_run(tmp_path / "run")
    assert run.config == config
    assert run.dataset_path == dataset.path
    assert run.dataset_id == dataset.id
    assert run.environment["precision"] == "fp32"
    assert run.history() == []
    with pytest.raises(RunError, match="no checkpoint 'best-loss'; there are none yet"):
        run.load_model()


def test_folders_in_use_are_left_alone(tmp_path: Path, dataset: Dataset, config: Config) -> None:
    create_run(tmp_path / "run", config, dataset, device="cpu", precision="fp32")
    with pytest.raises(RunError, match="already holds a run; add --resume"):
        create_run(tmp_path / "run", config, dataset, device="cpu", precision="fp32")
    (tmp_path / "other").mkdir()
    create_run(tmp_path / "other", config, dataset, device="cpu", precision="fp32")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "thesis.tex").touch()
    with pytest.raises(RunError, match="is not an empty folder"):
        create_run(tmp_path / "full", config, dataset, device="cpu", precision="fp32")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["full", "other", "run"]


def test_missing_foreign_or_other_format(tmp_path: Path, dataset: Dataset, config: Config) -> None:
    with pytest.raises(RunError, match="no such folder; make one with `teamclone train`"):
        open_run(tmp_path / "nowhere")
    with pytest.raises(RunError, match="not a run"):
        open_run(tmp_path)
    run = create_run(tmp_path / "run", config, dataset, device="cpu", precision="fp32")
    environment = run.path / "environment.json"
    environment.write_text(json.dumps(run.environment | {"format": 99}))
    with pytest.raises(RunError, match=f"run of format 99, this version reads {FORMAT}"):
        open_run(run.path)
    for text in ("{", "[]", "{}"):
        environment.write_text(text)
        with pytest.raises(RunError, match="not the description of a run"):
            open_run(run.path)
    environment.write_text(json.dumps(run.environment))
    for text, answer in (("[model", "not TOML"), ("[model]\nwidth = 3\n", "no setting model.width")):
        (run.path / "config.toml").write_text(text)
        with pytest.raises(RunError, match=answer):
            open_run(run.path)


def test_weights_survive_a_round_trip(tmp_path: Path, config: Config) -> None:
    torch.manual_seed(0)
    saved, loaded = Clone(config.model), Clone(config.model)
    saved.inputs.fit([torch.rand(10, 119)])
    save_weights(tmp_path / "w.safetensors", saved, epoch=3)
    assert load_weights(tmp_path / "w.safetensors", loaded) == 3
    for name, tensor in saved.state_dict().items():
        assert torch.equal(tensor, loaded.state_dict()[name])
    assert "features.normalisation.mean" in saved.state_dict()


def test_damaged_and_foreign_checkpoints(tmp_path: Path, config: Config) -> None:
    path = tmp_path / "w.safetensors"
    model = Clone(config.model)
    with pytest.raises(RunError, match="no such checkpoint"):
        load_weights(path, model)
    save_weights(path, Clone(load_config("small", ["model.hidden=[9]"]).model), epoch=1)
    with pytest.raises(RunError, match=r"of another model than that of config\.toml"):
        load_weights(path, model)
    whole = path.read_bytes()
    for length in (0, 7, 100, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(RunError, match="not a checkpoint of teamclone"):
            load_weights(path, model)


@pytest.mark.parametrize("optimiser", [torch.optim.Adam, torch.optim.RMSprop, torch.optim.Adagrad])
def test_the_optimiser_goes_on_as_if_never_stopped(
    tmp_path: Path, config: Config, optimiser: type[torch.optim.Optimizer]
) -> None:
    def step(model: Clone, stepper: torch.optim.Optimizer) -> None:
        stepper.zero_grad()
        hidden = model.trunk(torch.linspace(-1, 1, 5 * 119).reshape(5, 119))
        answer = model.head(hidden)
        (answer.raw_logits.square().sum() + answer.projected.square().sum()).backward()
        stepper.step()

    torch.manual_seed(0)
    model = Clone(config.model)
    stepper = optimiser(model.parameters(), lr=0.01)  # type: ignore[call-arg]
    for _ in range(3):
        step(model, stepper)
    save_progress(tmp_path / "r.safetensors", model, stepper, epoch=3)
    other = Clone(config.model)
    other_stepper = optimiser(other.parameters(), lr=0.01)  # type: ignore[call-arg]
    assert load_progress(tmp_path / "r.safetensors", other, other_stepper) == 3
    step(model, stepper)
    step(other, other_stepper)
    for name, tensor in model.state_dict().items():
        assert torch.equal(tensor, other.state_dict()[name])


@pytest.mark.parametrize("name", ["adam", "muon", "rmsprop", "adagrad"])
def test_states_of_wrong_shape_are_refused(tmp_path: Path, name: str) -> None:
    """Fused optimisers would read and write beyond them."""
    config = load_config("small", [f"train.optimiser={name}"])
    path, model = tmp_path / "r.safetensors", Clone(config.model)

    def step() -> Optimiser:
        stepper = optimiser_of(config.train, model)
        for weights in model.parameters():
            weights.grad = torch.ones_like(weights)
        stepper.step()
        return stepper

    stepper = step()
    save_progress(path, model, stepper, epoch=1)
    assert load_progress(path, model, stepper) == 1
    whole = safetensors.torch.load_file(path)
    key = next(key for key in sorted(whole) if key.startswith("optimiser.") and whole[key].ndim == 2)
    index, state = key.split(".")[1:]
    for change in (
        {key: torch.zeros(1)},
        {key: torch.zeros_like(whole[key], dtype=torch.int64)},
        {key: None} if name != "muon" else {key: torch.zeros(0)},
        {f"optimiser.{index}.more": torch.zeros(1)},
        {f"optimiser.9999.{state}": torch.zeros(1)},
        {f"optimiser.x.{state}": torch.zeros(1)},
    ):
        tensors = {name: tensor for name, tensor in (whole | change).items() if tensor is not None}
        safetensors.torch.save_file(tensors, path, metadata={"epoch": "1"})
        with pytest.raises(RunError, match=r"of another optimiser than that of config\.toml"):
            load_progress(path, model, stepper)


HOLD = """
import sys, time
from pathlib import Path
from teamclone.training.optimiser import Optimiser, optimiser_of
from teamclone.training.run import locked
with locked(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(100)
"""


def test_one_process_at_a_time_trains_into_a_folder(tmp_path: Path) -> None:
    with subprocess.Popen([sys.executable, "-c", HOLD, tmp_path], stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout
        assert other.stdout.readline() == "held\n"
        with pytest.raises(RunError, match="another process is training into it"), locked(tmp_path):
            pass
        other.kill()
        other.wait()
    with locked(tmp_path):
        pass


def test_two_that_begin_at_once_do_not_mix(
    tmp_path: Path, dataset: Dataset, config: Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    begin = partial(create_run, tmp_path / "run", config, dataset, device="cpu", precision="fp32")
    monkeypatch.setattr("teamclone.training.run.is_run", lambda path: False)
    monkeypatch.setattr(
        "teamclone.training.run._environment", lambda dataset: (tmp_path / "run" / "theirs").mkdir(parents=True) or {}
    )
    with pytest.raises(RunError, match="another process has just begun a run there"):
        begin()
    assert [path.name for path in tmp_path.iterdir()] == ["run"]
    assert [path.name for path in (tmp_path / "run").iterdir()] == ["theirs"]
