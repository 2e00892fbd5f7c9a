"""What a search tries next."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from teamclone.errors import RunError, UsageError
from teamclone.models.clone import Clone, parameter_count
from teamclone.models.config import ACTIVATIONS, EgocentricConfig
from teamclone.search.run import _folder_of
from teamclone.search.strategies import Beam, Optimisers, Strategy, Study
from teamclone.search.trials import (
    FORMAT,
    Mode,
    Objective,
    Search,
    SearchConfig,
    Status,
    Trial,
    config_of,
    open_search,
    rank,
)
from teamclone.training.config import load_config

Hidden = tuple[int, ...]


def beam(**options: Any) -> Beam:
    return Beam(SearchConfig(mode=Mode.BEAM, base=load_config("paper"), **options))


def study(preset: str = "paper", overrides: tuple[str, ...] = (), **options: Any) -> Study:
    return Study(SearchConfig(mode=Mode.STUDY, base=load_config(preset, overrides), **options))


def finish(trial: Trial, accuracy: float, *, weights: float = 0) -> Trial:
    trial.status = Status.FINISHED
    trial.figures = {"accuracy": accuracy, "cross_entropy": 1 - accuracy, "weights": weights}
    return trial


def searched(plan: Strategy, accuracy: Callable[[Hidden], float], trials: list[Trial] | None = None) -> list[Trial]:
    """All trials of a beam search in which every architecture is as accurate as a function says."""
    trials = [] if trials is None else trials
    while found := plan.propose(trials):
        for trial in found:
            hidden = tuple(trial.settings["model.hidden"])
            finish(trial, accuracy(hidden), weights=sum(hidden))
        trials += found
    return trials


def near(best: Hidden) -> Callable[[Hidden], float]:
    """Accuracy that falls by one for every halving, doubling and layer between an architecture and the best one."""

    def accuracy(hidden: Hidden) -> float:
        steps = sum(abs(a.bit_length() - b.bit_length()) for a, b in zip(hidden, best, strict=False))
        return -float(steps + abs(len(hidden) - len(best)))

    return accuracy


def test_the_neighbours_of_an_architecture() -> None:
    assert beam(smallest=32, largest=256).neighbours((256, 32)) == [(256, 32, 32), (128, 32), (256, 64), (256,)]
    assert beam(smallest=32, largest=256).neighbours((64,)) == [(64, 64), (64, 32), (128,), (32,)]


def test_a_beam_search_begins_with_one_layer_of_each_width() -> None:
    first = beam(smallest=64, largest=512).propose([])
    assert [trial.settings["model.hidden"] for trial in first] == [[64], [128], [256], [512]]
    assert [trial.name for trial in beam(start=((256, 128), (64,), (64,))).propose([])] == ["256-128", "64"]


def test_a_beam_search_finds_the_best_and_stops_when_the_beam_stays() -> None:
    plan = beam(iterations=100)
    trials = searched(plan, near((512, 256, 128)))
    names = [trial.name for trial in trials]
    assert len(set(names)) == len(names)
    assert rank(trials, Objective.ACCURACY)[0].name == "512-256-128"
    beams = plan.beams(trials)
    assert beams[-1] == beams[-2]
    assert all(before != after for before, after in pairwise(beams[:-1]))
    for trial in trials:
        if trial.parent:
            parent = next(other for other in trials if other.name == trial.parent)
            assert tuple(trial.settings["model.hidden"]) in plan.neighbours(tuple(parent.settings["model.hidden"]))
            assert parent in beams[trial.step - 1]


def test_a_beam_search_stops_after_its_iterations_and_goes_on_with_more() -> None:
    best = near((1024, 1024, 1024, 1024))
    whole = searched(beam(iterations=4, beam=1), best)
    assert max(trial.step for trial in whole) == 4
    part = searched(beam(iterations=2, beam=1), best)
    assert max(trial.step for trial in part) == 2
    assert part == whole[: len(part)]
    assert searched(beam(iterations=4, beam=1), best, part) == whole


def test_a_step_waits_for_all_trials_and_leaves_failed_ones_out() -> None:
    plan = beam(smallest=32, largest=64, beam=1)
    small, large = plan.propose([])
    finish(small, 0.5)
    for status in (Status.WAITING, Status.RUNNING):
        large.status = status
        assert plan.propose([small, large]) == []
    large.status = Status.FAILED
    assert {trial.parent for trial in plan.propose([small, large])} == {"32"}
    small.status = Status.FAILED
    assert plan.propose([small, large]) == []


def test_of_equally_good_architectures_the_beam_takes_the_smaller() -> None:
    trials = searched(beam(iterations=0, smallest=32, largest=256), lambda hidden: 0.5)
    assert [trial.name for trial in beam(beam=2).beams(trials)[0]] == ["32", "64"]


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"smallest": 48}, "smallest: expected a power of two, got 48"),
        ({"largest": 1000}, "largest: expected a power of two, got 1000"),
        ({"smallest": 512, "largest": 64}, "smallest, 512, is above largest, 64"),
        ({"start": ((256, 100),)}, "start 256-100: expected powers of two from 32 to 1024"),
        ({"start": ((2048,),)}, "start 2048: expected powers of two from 32 to 1024"),
        ({"held": ("model.hidden",)}, "chooses model.hidden; set its first architectures with --start"),
    ],
)
def test_wrong_options_of_a_beam_search(options: dict[str, Any], text: str) -> None:
    with pytest.raises(UsageError, match=text):
        beam(**options)


def told(plan: Study, n: int) -> list[Trial]:
    """Trials of a study that runs one at a time, better the nearer the learning rate is to 1e-3."""
    trials: list[Trial] = []
    while len(trials) < n:
        (trial,) = plan.propose(trials)
        trials.append(finish(trial, 1 / (1 + abs(trial.settings["train.learning_rate"] - 1e-3))))
    return trials


def test_a_study_proposes_settings_that_can_be_trained() -> None:
    for preset in ("paper", "best"):
        plan = study(preset, trials=40)
        base = plan.config.base
        seen: dict[str, set[Any]] = {}
        for trial in told(plan, 40):
            config = config_of(trial, base)
            samples = [
                of.data.batch_size * n
                for of in (base, config)
                for n in (of.data.batches_per_epoch, of.data.validation_batches)
            ]
            assert samples[:2] == samples[2:]
            for key, value in trial.settings.items():
                seen.setdefault(key, set()).add(str(value))
        assert seen["model.activation"] == set(ACTIVATIONS)
        assert seen["data.batch_size"] == {"1024", "2048", "4096", "8192"}
        assert len(seen["train.learning_rate"]) == 40
        assert ("model.parameter_weight" in seen) == ("model.target_points" in seen) == (preset == "best")


@pytest.mark.parametrize("overrides", [(), ("model.target_hidden=[8]", "model.target_weight=0.2")])
def test_a_study_may_leave_the_target_points_out(overrides: tuple[str, ...]) -> None:
    """With them go the settings that only they use."""
    held = tuple(study("best").space().keys() - {"model.target_points"})
    plan = study("best", overrides, trials=40, held=held)
    trials: list[Trial] = []
    while found := plan.propose(trials):
        trials.append(finish(found[0], 0.5))
    configs = [config_of(trial, plan.config.base) for trial in trials]
    assert {config.model.target_points for config in configs} == {0, 2, 4, 6, 8, 10, 12}
    assert all(parameter_count(Clone(config.model)) for config in configs)
    base = plan.config.base.model
    for model in (config.model for config in configs):
        points = model.target_points
        assert model == (replace(base, target_points=points) if points else EgocentricConfig(target_points=0))


def test_a_study_is_the_same_whenever_it_is_gone_on_with() -> None:
    whole = told(study(trials=14), 14)
    assert study(trials=14).propose(whole) == []
    for n in (0, 1, 12):
        assert study(trials=14).propose(whole[:n])[0].settings == whole[n].settings
    other = told(study("paper", ("train.seed=1",), trials=1), 1)
    assert other[0].settings != whole[0].settings


def test_a_study_varies_neither_what_is_held_nor_what_has_no_effect() -> None:
    assert "train.learning_rate" not in study(held=("train.learning_rate",)).space()
    assert "train.weight_decay" not in study("paper", ("train.optimiser=adagrad",)).space()
    assert "model.target_points" not in study("best", ("model.target_points=0",)).space()
    assert (
        768
        not in study("paper", ("data.batch_size=384", "data.batches_per_epoch=3")).space()["data.batch_size"].choices
    )
    with pytest.raises(UsageError, match="holds every setting"):
        study(held=tuple(study().space()))


@pytest.mark.parametrize("objective", Objective)
def test_a_study_gives_up_what_is_worse_than_the_median(objective: Objective) -> None:
    plan = study(trials=10, objective=objective)
    trials = told(plan, 6)
    for place, trial in enumerate(trials):
        trial.curve = [0.5 + 0.01 * place] * 6
    for value, worse in ((0.4, objective is Objective.ACCURACY), (0.7, objective is Objective.CROSS_ENTROPY)):
        (trial,) = plan.propose(trials)
        trial.status = Status.RUNNING
        given_up = []
        for _ in range(4):
            trial.curve.append(value)
            given_up.append(plan.prunes(trial, [*trials, trial]))
        assert given_up == [False, False, worse, worse]


@pytest.mark.parametrize("preset", ["paper", "best"])
def test_the_comparison_of_optimisers(preset: str) -> None:
    base = load_config(preset)
    trials = Optimisers(SearchConfig(mode=Mode.OPTIMISERS, base=base)).propose([])
    configs = [config_of(trial, base).train for trial in trials]
    assert [(of.optimiser, of.learning_rate) for of in configs] == [
        (optimiser, rate) for optimiser in ("adam", "rmsprop", "adagrad") for rate in (0.01, 0.001, 0.0001)
    ]
    assert {of.weight_decay for of in configs if of.optimiser == "adam"} == {base.train.weight_decay}
    with pytest.raises(UsageError, match=r"chooses train.learning_rate; leave --set of it out"):
        Optimisers(SearchConfig(mode=Mode.OPTIMISERS, base=base, held=("train.learning_rate",)))


def record(epoch: int, accuracy: float, cross_entropy: float) -> dict[str, Any]:
    return {
        "epoch": epoch,
        "validation_accuracy": accuracy,
        "validation_cross_entropy": cross_entropy,
        "validation_loss": cross_entropy + 1,
        "seconds": 2.0,
    }


def test_a_trial_has_the_figures_of_its_best_epoch() -> None:
    records = [record(1, 0.5, 1.0), record(2, 0.8, 0.7), record(3, 0.7, 0.4)]
    common = {"epochs": 3, "seconds": 6.0, "weights": 9}
    for objective, best in ((Objective.ACCURACY, records[1]), (Objective.CROSS_ENTROPY, records[2])):
        trial = Trial(name="a", settings={})
        for row in records:
            trial.add(row, 9, objective)
        figures = {name: best[f"validation_{name}"] for name in ("accuracy", "cross_entropy", "loss")}
        assert trial.figures == figures | {"epoch": best["epoch"]} | common
    assert trial.curve == [1.0, 0.7, 0.4]


def test_best_trials_come_first() -> None:
    trials = [Trial(name=name, settings={}) for name in "abcdef"]
    finish(trials[0], 0.5, weights=3)
    finish(trials[1], 0.7, weights=9)
    finish(trials[2], 0.7, weights=8)
    finish(trials[3], 0.9).status = Status.PRUNED
    trials[4].status = Status.FAILED
    assert [trial.name for trial in rank(trials, Objective.ACCURACY)] == list("cbadef")
    assert [trial.name for trial in rank(trials, Objective.CROSS_ENTROPY)] == list("cbadef")


def test_a_search_is_read_as_it_was_written(tmp_path: Path) -> None:
    for config in (
        SearchConfig(mode=Mode.BEAM, base=load_config("best"), beam=2, start=((64,), (64, 32)), held=("train.epochs",)),
        SearchConfig(mode=Mode.STUDY, base=load_config("paper"), trials=7, objective=Objective.CROSS_ENTROPY),
    ):
        trials = [
            finish(Trial(name="64", settings={"model.hidden": [64]}), 0.5),
            Trial(name="b", settings={}, error="x"),
        ]
        written = Search(path=tmp_path, config=config, dataset={"id": "i", "path": "p", "team": "t"}, trials=trials)
        written.save()
        assert open_search(tmp_path) == written


def test_a_folder_that_is_no_search_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RunError, match="nowhere: no such folder; make one with `teamclone search`"):
        open_search(tmp_path / "nowhere")
    with pytest.raises(RunError, match=r"not a search, it has no search\.json"):
        open_search(tmp_path)
    for text, words in (
        ("[]", "not the description of a search"),
        ("{", "not the description of a search"),
        (json.dumps({"format": FORMAT, "mode": "beam"}), "dataset: missing; search again"),
        (json.dumps({"format": 99}), f"search of format 99, this version reads {FORMAT}"),
    ):
        (tmp_path / "search.json").write_text(text)
        with pytest.raises(RunError, match=words):
            open_search(tmp_path)


@pytest.mark.parametrize("name", ["/tmp/elsewhere", "../up", "a/b", "", ".", "..", ".hidden", "a\n", 7, "a" * 300])
def test_a_trial_whose_name_is_a_path_is_refused(tmp_path: Path, name: object) -> None:
    """A search folder from somebody else must not make trainings write elsewhere."""
    config = SearchConfig(mode=Mode.OPTIMISERS, base=load_config("paper"))
    dataset = {"id": "i", "path": "p", "team": "t"}
    Search(path=tmp_path, config=config, dataset=dataset, trials=[Trial(name="good", settings={})]).save()
    document = json.loads((tmp_path / "search.json").read_text())
    document["trials"][0]["name"] = name
    (tmp_path / "search.json").write_text(json.dumps(document))
    with pytest.raises(RunError, match=r"a trial is called|trials\[0\].name: expected a text, got 7"):
        open_search(tmp_path)


def test_a_trial_whose_folder_is_a_link_is_not_trained(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "trials").mkdir()
    (tmp_path / "trials" / "linked").symlink_to(tmp_path / "elsewhere")
    assert _folder_of(Trial(name="fine", settings={}), tmp_path) == tmp_path / "trials" / "fine"
    with pytest.raises(RunError, match="linked: is a link"):
        _folder_of(Trial(name="linked", settings={}), tmp_path)
