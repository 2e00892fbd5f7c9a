"""Training as a whole, on a made dataset with something to learn."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file
from tests.synthetic import make_dataset

from teamclone.dataset.layout import MEASURED_INDEX, MISSING, Split
from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.errors import DatasetError, RunError, UsageError
from teamclone.evaluation.evaluate import evaluate
from teamclone.evaluation.latency import measure_latency
from teamclone.models.clone import Clone
from teamclone.training.config import Config, load_config, setting_names
from teamclone.training.loop import Progress, train
from teamclone.training.run import Run, open_run

TINY = (
    "model.hidden=[16]",
    "data.batch_size=64",
    "data.batches_per_epoch=3",
    "data.validation_batches=2",
    "train.epochs=3",
    "train.threads=1",
    "train.precision=fp32",
    "train.device=cpu",
)
TIMES = ("seconds", "samples_per_s")


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return open_dataset(make_dataset(tmp_path_factory.mktemp("data") / "ds", frames_per_match=50))


def tiny(*overrides: str) -> Config:
    return load_config("small", [*TINY, *overrides])


def figures(run: Run) -> list[dict[str, Any]]:
    """The history without what the clock says."""
    return [{key: value for key, value in record.items() if key not in TIMES} for record in run.history()]


def weights(run: Run) -> dict[str, bytes]:
    return {name: run.checkpoint_path(name).read_bytes() for name in (*run.checkpoints(), "resume")}


def stop_at(epoch: int, batch: int) -> Any:
    def report(at: Progress) -> None:
        if (at.epoch, at.batch) == (epoch, batch) and at.record is None:
            raise KeyboardInterrupt

    return report


def test_learns_what_is_there_to_learn(tmp_path: Path) -> None:
    dataset = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=600))
    config = load_config("small", ["data.batch_size=128", "train.epochs=6", "train.threads=1"])
    run = train(config, dataset, tmp_path / "run")
    rows = dataset.split(Split.TEST)
    kind = dataset.target(rows).kind
    majority = int(kind.bincount().max()) / len(kind)
    probabilities, parameters = run.load_model("best-accuracy").predict(dataset.state(rows))
    accuracy = float((probabilities.argmax(1) == kind).float().mean())
    assert accuracy > majority + 0.2
    # The dash direction is minus the body's: better than always saying nothing.
    dashes = kind == 0
    truth = dataset.target(rows).parameters[dashes, 1]
    assert (parameters[dashes, 1] - truth).abs().mean() < 0.8 * truth.abs().mean()


def test_a_run_folder_is_complete(dataset: Dataset, tmp_path: Path) -> None:
    run = train(tiny(), dataset, tmp_path / "run")
    assert open_run(run.path).config == tiny()
    history = run.history()
    assert [record["epoch"] for record in history] == [1, 2, 3]
    assert {"train_loss", "validation_accuracy", "validation_recall_dash", "validation_parameter_mae"} <= set(
        history[0]
    )
    assert {"last", "best-loss", "best-accuracy", "best-parameters", "best-recall-turn"} <= set(run.checkpoints())
    assert list((run.path / "tensorboard").glob("events*"))
    for best in run.best():
        values = [record[best.figure] for record in history]
        chosen = max(values) if "recall" in best.figure or "accuracy" in best.figure else min(values)
        assert best.value == chosen
        assert best.epoch == values.index(chosen) + 1


def test_best_checkpoints_hold_the_weights_of_their_epoch(dataset: Dataset, tmp_path: Path) -> None:
    run = train(tiny("train.learning_rate=0.3", "train.epochs=6"), dataset, tmp_path / "run")
    best = {best.checkpoint: best for best in run.best()}["best-loss"]
    assert best.epoch < 6, "the rate is meant to be too high"
    short = train(tiny("train.learning_rate=0.3", f"train.epochs={best.epoch}"), dataset, tmp_path / "short")
    assert run.checkpoint_path("best-loss").read_bytes() == short.checkpoint_path("last").read_bytes()


def test_the_normalisation_is_fitted_on_training_samples_only(dataset: Dataset, tmp_path: Path) -> None:
    model = train(tiny("train.epochs=1"), dataset, tmp_path / "run").load_model("last")
    projected = model.inputs.project(dataset.state(dataset.split(Split.TRAIN)))
    assert torch.allclose(model.features.normalisation.mean, projected.mean(0), atol=1e-5)
    assert torch.allclose(model.features.normalisation.std, projected.std(0, correction=0), atol=1e-4)


@pytest.mark.parametrize(("epoch", "batch"), [(1, 1), (2, 1), (3, 3)])
def test_interrupted_and_resumed_is_as_never_interrupted(
    dataset: Dataset, tmp_path: Path, epoch: int, batch: int
) -> None:
    whole = train(tiny("train.epochs=4"), dataset, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        train(tiny("train.epochs=4"), dataset, tmp_path / "run", on_progress=stop_at(epoch, batch))
    assert len(open_run(tmp_path / "run").history()) == epoch - 1
    resumed = train(tiny("train.epochs=4"), dataset, tmp_path / "run", resume=True)
    assert figures(resumed) == figures(whole)
    assert weights(resumed) == weights(whole)


@pytest.mark.parametrize("optimiser", ["rmsprop", "adagrad", "muon"])
def test_resume_with_every_optimiser(dataset: Dataset, tmp_path: Path, optimiser: str) -> None:
    config = tiny(f"train.optimiser={optimiser}")
    whole = train(config, dataset, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        train(config, dataset, tmp_path / "run", on_progress=stop_at(2, 2))
    assert weights(train(config, dataset, tmp_path / "run", resume=True)) == weights(whole)


@pytest.mark.parametrize("rest", ["", '{"epoch": 2, "tra', '{"epoch": 2, "train_loss": 9.0}\n'])
def test_a_kill_between_the_files_of_an_epoch_is_made_good(dataset: Dataset, tmp_path: Path, rest: str) -> None:
    """The last write of an epoch is what counts; whatever came before it is written again."""
    whole = train(tiny(), dataset, tmp_path / "whole")
    run = train(tiny("train.epochs=1"), dataset, tmp_path / "run")
    with run.metrics_path.open("a") as file:
        file.write(rest)
    run.checkpoint_path("best-loss").write_bytes(b"half")
    (run.path / "checkpoints" / ".last.safetensors.part").write_bytes(b"half")
    resumed = train(tiny(), dataset, tmp_path / "run", resume=True)
    assert figures(resumed) == figures(whole)
    assert weights(resumed)["last"] == weights(whole)["last"]
    assert len(resumed.metrics_path.read_text().splitlines()) == 3
    assert ".last" not in resumed.checkpoints()


@pytest.mark.parametrize("writes", range(12))
def test_a_full_disk_at_any_write_costs_an_epoch_at_most(
    dataset: Dataset, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, usual: tuple[Any, ...], writes: int
) -> None:
    left = writes

    def fsync(_: int) -> None:
        nonlocal left
        left -= 1
        if left < 0:
            raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr("teamclone.system.files.os.fsync", fsync)
        with pytest.raises(OSError, match="No space left"):
            train(tiny("train.epochs=2"), dataset, tmp_path / "run")
    # Two writes make the folder; where it was not made, training begins anew.
    begun = (tmp_path / "run").exists()
    assert begun == (writes >= 2)
    assert not list(tmp_path.rglob("*.part"))
    assert outcome(train(tiny("train.epochs=2"), dataset, tmp_path / "run", resume=begun)) == usual


def test_more_epochs_may_be_added(dataset: Dataset, tmp_path: Path) -> None:
    train(tiny("train.epochs=2"), dataset, tmp_path / "run")
    longer = train(tiny("train.epochs=4"), dataset, tmp_path / "run", resume=True)
    assert figures(longer) == figures(train(tiny("train.epochs=4"), dataset, tmp_path / "whole"))
    assert longer.config.train.epochs == 4


def test_resume_refuses_another_dataset_or_other_settings(dataset: Dataset, tmp_path: Path) -> None:
    run = train(tiny("train.epochs=1"), dataset, tmp_path / "run")
    other = open_dataset(make_dataset(tmp_path / "other", frames_per_match=50, seed=9))
    with pytest.raises(RunError, match=f"was trained on dataset {dataset.id}.* is {other.id}"):
        train(tiny(), other, run.path, resume=True)
    with pytest.raises(RunError, match=r"cannot resume with other settings \(train\.seed: 0 became 1\)"):
        train(tiny("train.seed=1"), dataset, run.path, resume=True)
    with pytest.raises(RunError, match="already holds a run; add --resume"):
        train(tiny(), dataset, run.path)
    with pytest.raises(RunError, match="no such folder"):
        train(tiny(), dataset, tmp_path / "nowhere", resume=True)
    assert len(run.history()) == 1


def outcome(run: Run) -> tuple[Any, ...]:
    """All that a setting can change: weights, figures, and how they were found."""
    tensors = {name: tensor.tolist() for name, tensor in load_file(run.checkpoint_path("last")).items()}
    return tensors, figures(run), run.environment["threads"], run.environment["precision"]


RELATIVE = (
    "model.family=egocentric",
    "model.blocks=self,role,ball",
    "model.kick_blocks=self,ball,mates",
    "model.target_points=2",
    "model.target_hidden=8",
    "model.parameter_hidden=8",
    "model.kick_hidden=8",
    *("model.kick_attention=0", "model.kick_dropout=0", "model.extra_kicks=0", "model.target_weight=0"),
    "model.parameter_weight=0.1",
)
REMEDIES = (
    *RELATIVE,
    *("train.balance=oversample", "train.calibrate=true", "data.mirror=0.5"),
    *("model.kick_attention=4", "model.kick_blocks=ball,plan", "model.kick_dropout=0.1", "model.extra_kicks=8"),
)
BASES: dict[str, Sequence[str]] = {
    "paper": (),
    "few": ("data.batches_per_epoch=50",),
    "relative": RELATIVE,
    "weights": ("train.balance=weights",),
}
CHANGES: dict[str, tuple[str, Sequence[str]]] = {
    "model.family": ("paper", ["model.family=egocentric-point", "model.blocks=self", "model.target_points=0"]),
    "model.own_type": ("paper", ["model.own_type=true"]),
    "model.all_types": ("paper", ["model.all_types=kick"]),
    "model.blocks": ("relative", ["model.blocks=self,role"]),
    "model.kick_blocks": ("relative", ["model.kick_blocks=ball"]),
    "model.target_points": ("relative", ["model.target_points=3"]),
    "model.target_hidden": ("relative", ["model.target_hidden=9"]),
    "model.parameter_hidden": ("relative", ["model.parameter_hidden=9"]),
    "model.kick_hidden": ("relative", ["model.kick_hidden=9"]),
    "model.kick_attention": ("relative", ["model.kick_attention=4"]),
    "model.kick_candidates": ("relative", ["model.kick_candidates=4"]),
    "model.kick_dropout": ("relative", ["model.kick_dropout=0.5"]),
    "model.hidden": ("paper", ["model.hidden=[17]"]),
    "model.activation": ("paper", ["model.activation=tanh"]),
    "model.dropout": ("paper", ["model.dropout=0.5"]),
    "model.ensemble_size": ("paper", ["model.ensemble_size=2"]),
    "data.batch_size": ("paper", ["data.batch_size=32"]),
    "data.batches_per_epoch": ("paper", ["data.batches_per_epoch=2"]),
    "data.repeat": ("few", ["data.repeat=true"]),
    "data.validation_batches": ("paper", ["data.validation_batches=1"]),
    "data.mirror": ("paper", ["data.mirror=0.5"]),
    "train.epochs": ("paper", ["train.epochs=1"]),
    "train.optimiser": ("paper", ["train.optimiser=rmsprop"]),
    "train.learning_rate": ("paper", ["train.learning_rate=0.01"]),
    "train.schedule": ("paper", ["train.schedule=cosine"]),
    "train.weight_decay": ("paper", ["train.weight_decay=0.1"]),
    "train.betas": ("paper", ["train.betas=[0.8, 0.9]"]),
    "train.epsilon": ("paper", ["train.epsilon=0.1"]),
    "model.parameter_loss": ("paper", ["model.parameter_loss=masked"]),
    "model.parameter_weight": ("paper", ["model.parameter_weight=2"]),
    "model.target_weight": ("relative", ["model.target_weight=1"]),
    "model.extra_kicks": ("relative", ["model.extra_kicks=8"]),
    "train.balance": ("paper", ["train.balance=undersample"]),
    "train.balance_strength": ("weights", ["train.balance_strength=0.5"]),
    "train.prior_correction": ("weights", ["train.prior_correction=false"]),
    "train.calibrate": ("paper", ["train.calibrate=true"]),
    "train.precision": ("paper", ["train.precision=bf16"]),
    "train.threads": ("paper", ["train.threads=2"]),
    "train.seed": ("paper", ["train.seed=1"]),
    "train.max_minutes": ("paper", ["train.max_minutes=1e-9"]),
}
"""For each setting a base on which it has an effect, and what changes it."""
REFUSED = {"train.device", "model.commands"}
"""Only one value works here; the others are refused, which another test shows."""
ONLY_SPEED = {"data.cache_gb"}
"""No result may depend on it, but for rounding."""


def test_every_setting_is_tried() -> None:
    assert set(CHANGES) | REFUSED | ONLY_SPEED == setting_names()


@pytest.fixture(scope="module")
def usual_of(dataset: Dataset, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[Any, ...]]:
    """What comes of each base."""

    @cache
    def trained(base: str) -> tuple[Any, ...]:
        config = tiny("train.epochs=2", *BASES[base])
        return outcome(train(config, dataset, tmp_path_factory.mktemp("usual") / "run"))

    return trained


@pytest.fixture(scope="module")
def usual(usual_of: Callable[[str], tuple[Any, ...]]) -> tuple[Any, ...]:
    return usual_of("paper")


@pytest.mark.parametrize("key", CHANGES)
def test_every_setting_has_an_effect(
    dataset: Dataset, tmp_path: Path, usual_of: Callable[[str], tuple[Any, ...]], key: str
) -> None:
    base, changes = CHANGES[key]
    changed = train(tiny("train.epochs=2", *BASES[base], *changes), dataset, tmp_path / "run")
    assert outcome(changed) != usual_of(base)


def test_nothing_else_has_an_effect(dataset: Dataset, tmp_path: Path, usual: tuple[Any, ...]) -> None:
    assert outcome(train(tiny("train.epochs=2"), dataset, tmp_path / "run")) == usual


def test_what_is_kept_in_memory_changes_no_result(dataset: Dataset, tmp_path: Path) -> None:
    """All or nothing: 4 bytes of each input of 500 training and 128 validation samples, if there is room for them."""
    inputs = len(Clone(tiny(*REMEDIES).model).inputs.names)
    told: list[tuple[int, ...]] = []

    def trained(cache_gb: float) -> dict[str, Any]:
        made: list[Progress] = []
        config = tiny(*REMEDIES, f"data.cache_gb={cache_gb}")
        run = train(config, dataset, tmp_path / f"run{cache_gb}", on_progress=made.append)
        told.append(tuple({at.batches for at in made if at.epoch == 0}))
        return figures(run)[-1]

    usual = trained(8.0)
    assert trained(0.0) == pytest.approx(usual, rel=1e-4)
    assert trained(4e-9 * inputs * 627) == pytest.approx(usual, rel=1e-4)
    assert trained(4e-9 * inputs * 628) == usual
    assert told == [(628,), (), (), (628,)]


def test_the_remedies_resume_bit_for_bit(dataset: Dataset, tmp_path: Path) -> None:
    config = tiny(*REMEDIES, "train.schedule=cosine")
    whole = train(config, dataset, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        train(config, dataset, tmp_path / "run", on_progress=stop_at(3, 2))
    resumed = train(config, dataset, tmp_path / "run", resume=True)
    assert figures(resumed) == figures(whole)
    assert weights(resumed) == weights(whole)


def test_kicks_beside_the_batches_teach_the_layers_of_kicks_and_no_other(dataset: Dataset, tmp_path: Path) -> None:
    def trained(name: str, *settings: str) -> dict[str, Any]:
        run = train(tiny(*RELATIVE, "train.epochs=1", *settings), dataset, tmp_path / name)
        return load_file(run.checkpoint_path("last"))

    plain, taught = trained("plain"), trained("taught", "model.extra_kicks=16")
    for name, weight in plain.items():
        of_kicks = name.startswith(("trunk.kick.", "head.kick.", "head.tackle."))
        assert torch.equal(weight, taught[name]) != of_kicks, name


def test_a_calibrated_model_answers_at_the_temperature_of_its_record(dataset: Dataset, tmp_path: Path) -> None:
    settings = ("data.validation_batches=0", "train.epochs=2")
    plain = train(tiny(*settings), dataset, tmp_path / "plain")
    run = train(tiny(*settings, "train.calibrate=true"), dataset, tmp_path / "run")
    rows = dataset.split(Split.VALIDATION)
    kind = dataset.target(rows).kind
    model, raw = (of.load_model("last") for of in (run, plain))
    for mine, theirs in zip(model.parameters(), raw.parameters(), strict=True):
        assert torch.equal(mine, theirs), "training looks at raw logits"
    record, before = run.history()[-1], plain.history()[-1]
    assert record["temperature"] != pytest.approx(1.0, abs=0.01)
    assert float(model.head.temperature) == pytest.approx(record["temperature"])
    for of, told in ((model, record), (raw, before)):
        probability = of.predict(dataset.state(rows))[0].gather(1, kind[:, None])
        assert float(-probability.log().mean()) == pytest.approx(told["validation_cross_entropy"], rel=1e-4)
    gained = before["validation_cross_entropy"] - record["validation_cross_entropy"]
    assert gained > 0
    assert before["validation_loss"] - record["validation_loss"] == pytest.approx(gained)
    assert "temperature" not in before


@pytest.mark.parametrize("balance", ["oversample", "undersample", "weights"])
def test_prior_correction_keeps_probabilities_honest(tmp_path: Path, balance: str) -> None:
    """On samples of which nothing can be learned but how frequent the commands are."""
    kind = np.random.default_rng(0).choice(4, 24_000, p=[0.55, 0.3, 0.1, 0.05])
    dataset = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=600, **{"samples/kind": kind}))
    means = {}
    for corrected in ("true", "false"):
        config = tiny(
            f"train.balance={balance}",
            f"train.prior_correction={corrected}",
            "model.hidden=[1]",
            "data.batch_size=128",
            "data.batches_per_epoch=100",
            "train.learning_rate=0.01",
            f"train.epochs={25 if balance == 'undersample' else 6}",
        )
        run = train(config, dataset, tmp_path / corrected)
        means[corrected] = run.load_model("last").predict(dataset.state(dataset.split(Split.TRAIN)))[0].mean(0)
    frequent = torch.from_numpy(kind[dataset.split(Split.TRAIN)]).bincount() / 6000
    assert (means["true"] / frequent - 1).abs().max() < 0.2
    assert (means["false"] - 0.25).abs().max() < 0.05


@pytest.mark.skipif(torch.cuda.is_available(), reason="there is a CUDA device")
def test_cuda_is_not_replaced_silently(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"train\.device = cuda, but PyTorch finds no CUDA device"):
        train(tiny("train.device=cuda"), dataset, tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.skipif(not torch.cuda.is_available(), reason="there is no CUDA device")
def test_a_gpu_trains_what_a_processor_trains(dataset: Dataset, tmp_path: Path) -> None:
    card = train(tiny("train.device=cuda"), dataset, tmp_path / "card")
    assert card.environment["device"] == "cuda"
    for mine, theirs in zip(figures(card), figures(train(tiny(), dataset, tmp_path / "processor")), strict=True):
        assert mine == pytest.approx(theirs, rel=1e-2)


def test_a_time_budget_ends_with_a_whole_epoch(dataset: Dataset, tmp_path: Path) -> None:
    run = train(tiny("train.epochs=500", "train.max_minutes=0.01"), dataset, tmp_path / "run")
    epochs = len(run.history())
    assert 1 <= epochs < 500
    assert sum(record["seconds"] for record in run.history()) < 2
    resumed = train(tiny(f"train.epochs={epochs + 1}"), dataset, run.path, resume=True)
    assert len(resumed.history()) == epochs + 1


def test_divergence_is_told_and_the_last_checkpoint_kept(dataset: Dataset, tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"the loss is not a number in epoch \d+; .*smaller train\.learning_rate"):
        train(
            tiny("train.learning_rate=1000", "train.epochs=20", f"model.hidden={[16] * 16}"), dataset, tmp_path / "run"
        )
    history = open_run(tmp_path / "run").history()
    assert all(np.isfinite(record["train_loss"]) for record in history)


def test_datasets_that_cannot_be_trained_on(dataset: Dataset, tmp_path: Path) -> None:
    n = len(dataset)
    for split, text in ((Split.TRAIN, "no validation samples"), (Split.VALIDATION, "no training samples")):
        made = make_dataset(tmp_path / text, frames_per_match=50, **{"samples/split": np.full(n, int(split))})
        with pytest.raises(DatasetError, match=text):
            train(tiny(), open_dataset(made), tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(("channel", "match"), [("vx", 0), ("ball_vx", 0), ("vx", 1)])
def test_a_value_that_a_log_lacks_is_named(dataset: Dataset, tmp_path: Path, channel: str, match: int) -> None:
    """In a match to train on, 0, and in one to validate on, 1."""
    detail, ball = (dataset.frames[name].numpy().copy() for name in ("measured", "ball"))
    frame = 7 + 50 * match
    if channel == "vx":
        detail[frame, :, MEASURED_INDEX["vx"]] = MISSING
    else:
        ball[frame, 2] = np.nan
    changes = {"frames/measured": detail, "frames/ball": ball}
    lacking = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=50, **changes))
    with pytest.raises(DatasetError, match=rf"match 0{{15}}{match} has no {channel} in its log"):
        train(tiny(), lacking, tmp_path / "run")


def test_evaluation_names_a_value_that_a_log_lacks(dataset: Dataset, tmp_path: Path) -> None:
    run = train(tiny(), dataset, tmp_path / "run")
    detail = dataset.frames["measured"].numpy().copy()
    detail[:, :, MEASURED_INDEX["vx"]] = MISSING
    lacking = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=50, **{"frames/measured": detail}))
    with pytest.raises(DatasetError, match="has no vx in its log"):
        evaluate(run, dataset=lacking)
    with pytest.raises(DatasetError, match="has no vx in its log"):
        measure_latency(run.load_model(), lacking, n=10)


def test_tensorboard_shows_each_epoch_once_after_a_resume(dataset: Dataset, tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    with pytest.raises(KeyboardInterrupt):
        train(tiny(), dataset, tmp_path / "run", on_progress=stop_at(3, 1))
    run = train(tiny(), dataset, tmp_path / "run", resume=True)
    events = EventAccumulator(str(run.path / "tensorboard"))
    events.Reload()
    shown = {event.step: event.value for event in events.Scalars("validation/accuracy")}
    assert shown == pytest.approx({record["epoch"]: record["validation_accuracy"] for record in run.history()})
    assert {"train/loss", "validation/recall_dash", "samples_per_s"} <= set(events.Tags()["scalars"])


def test_metrics_are_plain_json(dataset: Dataset, tmp_path: Path) -> None:
    run = train(tiny("train.epochs=1"), dataset, tmp_path / "run")

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    for line in run.metrics_path.read_text().splitlines():
        json.loads(line, parse_constant=refuse)
