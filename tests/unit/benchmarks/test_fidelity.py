"""The fidelity benchmark: its arithmetic by hand, its folder on a made dataset, its page from results."""

from __future__ import annotations

import json
import re
from pathlib import Path

import fidelity
import fidelity_page
import numpy as np
import pytest
import torch
from tests.synthetic import make_dataset

from teamclone.dataset.layout import Split
from teamclone.dataset.reader import open_dataset
from teamclone.evaluation.predict import predict
from teamclone.models.clone import Clone
from teamclone.models.inputs.egocentric import EgocentricFeatures
from teamclone.rcss.player_types import DEFAULTS
from teamclone.training.config import load_config
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD
from teamclone.world.state import State

MATCHES = [1, 2, 5, 10, 22]


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> fidelity.Work:
    """A benchmark whose dataset is made: four matches, three of them for training."""
    out = tmp_path_factory.mktemp("fidelity")
    splits = [Split.TRAIN, Split.TRAIN, Split.TRAIN, Split.VALIDATION]
    n, rows = 40, 40 * 10
    # The last match is cut: its frames are for validation, test and unseen.
    values = np.repeat(np.array(splits, np.uint8), rows)
    values[-rows * 3 // 4 : -rows // 2], values[-rows // 2 :] = Split.TEST, Split.UNSEEN
    document = make_dataset(out / "dataset", frames_per_match=n, **{"samples/split": values}) / "dataset.json"
    meta = json.loads(document.read_text())
    for match, opponent in zip(meta["matches"], ("Red", "Red", "Blue", "Green"), strict=True):
        match |= {"opponent": opponent, "rows": dict.fromkeys(fidelity.CLONED, 5)}
    meta |= {"options": {"test_matches": []}, "cleaning": {"matches": meta["matches"]}}
    document.write_text(json.dumps(meta))
    return fidelity.Work(fidelity.parser().parse_args(["LOGS", "--out", str(out), "--test-match"]))


def test_a_power_law_is_found_again_with_its_floor() -> None:
    loss = [0.2 + 0.3 * n**-0.7 for n in MATCHES]
    fit = fidelity.learning_curve(MATCHES, loss)
    assert fit["floor"] == pytest.approx(0.2, abs=2e-3)
    assert fit["exponent"] == pytest.approx(0.7, abs=0.02)
    assert fit["floor_low"] == pytest.approx(0.2, abs=5e-3)
    assert fit["leads_to"]["220"] == pytest.approx(0.2 + 0.3 * 220**-0.7, abs=2e-3)


def test_a_curve_that_does_not_fall_is_its_mean() -> None:
    assert fidelity.power_law(MATCHES, [0.3, 0.31, 0.32, 0.33, 0.34])[:2] == pytest.approx((0.32, 0.0))


def test_a_floor_is_never_below_zero() -> None:
    assert fidelity.power_law(MATCHES, [1.0 - 0.2 * np.log10(n) for n in MATCHES])[0] >= 0.0


def test_errors_are_shared_out_among_the_seeds() -> None:
    """Row 0: both wrong and sure; 1: both wrong, unsure; 2: one wrong; 3: both right. Of 5 errors 2, 2 and 1."""
    kind = np.zeros(4, np.int64)
    sure, unsure, right = [0.1, 0.9, 0, 0], [0.4, 0.6, 0, 0], [1.0, 0, 0, 0]
    found = fidelity.agreement(np.array([[sure, unsure, unsure, right], [sure, unsure, right, right]]), kind)
    assert found["error"] == 5 / 8
    assert [found[key] for key in ("systematic", "shared", "by_seed")] == pytest.approx([2 / 5, 2 / 5, 1 / 5])
    mixed = -(0.7 * np.log(0.7) + 0.3 * np.log(0.3))  # what the seeds make of row 2 together
    of_sure, of_unsure = (-sum(p * np.log(p) for p in row[:2]) for row in (sure, unsure))
    assert found["entropy"] == pytest.approx((of_sure + of_unsure + mixed) / 4)
    assert found["chance"] == pytest.approx((2 * of_sure + 3 * of_unsure) / 8)
    assert found["doubt"] == pytest.approx(found["entropy"] - found["chance"])


def test_situations_of_a_player() -> None:
    """He has the ball at his feet; is three metres from it and all others far; is far and a team mate has it."""
    players = torch.zeros(3, 22, len(CHANNEL))
    players[..., CHANNEL["flags"]] = FLAG_ON_FIELD
    players[..., CHANNEL["x"]] = 40.0
    players[:, 4, CHANNEL["x"]] = torch.tensor([0.5, 3.0, 30.0])
    players[2, 7, CHANNEL["x"]] = 0.5
    types = torch.tensor(list(DEFAULTS.values())).expand(3, 22, -1)
    state = State.now(ball=torch.zeros(3, 4), players=players, types=types, actor=torch.full((3,), 4))
    assert fidelity.situations(state).tolist() == [0, 1, 2]


def test_shares_of_situations_add_up() -> None:
    probabilities, kind = np.array([[[0.8, 0.2, 0, 0], [0.8, 0.2, 0, 0], [0.5, 0.5, 0, 0]]]), np.array([0, 1, 0])
    found = fidelity.by_situation(probabilities, kind, np.array([0, 0, 2]))
    assert list(found) == [fidelity.SITUATIONS[0], fidelity.SITUATIONS[2]]
    assert found[fidelity.SITUATIONS[0]]["error"] == 0.5
    for share in ("share", "share_of_errors", "share_of_nats"):
        assert sum(row[share] for row in found.values()) == pytest.approx(1)


@pytest.mark.parametrize("quick", [False, True])
def test_every_experiment_is_a_training_of_its_own(quick: bool) -> None:
    made = fidelity.experiments(n_train=22, scale=0.5, short_epochs=6, quick=quick)
    configs = {experiment.name: load_config(experiment.preset, experiment.overrides) for experiment in made}
    assert len(configs) == len(made)
    variants = [
        configs[name] for name in (*fidelity.KICKS, *fidelity.ablations(), *fidelity.REMEDIES, "short", "plain")
    ]
    assert all(one != other for i, one in enumerate(variants) for other in variants[:i])
    assert {experiment.step for experiment in made} == {"c", "t", "b", "k", "f", "def", "d", "e"}
    if not quick:
        assert configs["short"].train.epochs == 3
        assert configs["curve-1"] == configs["plain"]
        assert configs["paper"].train.max_minutes == 4


def test_training_matches_take_turns_by_opponent(work: fidelity.Work) -> None:
    assert [work.dataset.matches[index]["opponent"] for index in work.training_matches] == ["Red", "Blue", "Red"]
    subset = open_dataset(work.subset(2))
    used = np.unique(subset.match(subset.split(Split.TRAIN)).numpy()).tolist()
    assert used == sorted(work.training_matches[:2])
    assert len(subset.split(Split.VALIDATION)) == len(work.dataset.split(Split.VALIDATION))
    assert not len(subset.split(Split.TEST))


def test_inputs_made_once_are_those_of_each_choice_of_blocks(work: fidelity.Work) -> None:
    features = EgocentricFeatures(("ball", "past", "rivals"))
    state = work.dataset.state(work.rows, history=features.history)
    torch.testing.assert_close(work.inputs_of(features), features.project(state))
    model = Clone(load_config("best", ["model.hidden=[8]"]).model)
    made = work.inputs_of(model.features)
    model.inputs.fit([made])
    quick, plain = predict(model, work.dataset, work.rows, inputs=made), predict(model, work.dataset, work.rows)
    np.testing.assert_allclose(quick.probabilities, plain.probabilities, atol=1e-6)
    np.testing.assert_array_equal(quick.position, plain.position)


def test_results_are_kept_and_their_page_has_their_numbers(work: fidelity.Work, tmp_path: Path) -> None:
    for name in ("markov", "majority"):
        work.result(name, {}, lambda name=name: work.rule(name))
    work.result("tree", {"rows": 300}, lambda: work.tree(rows=300, iterations=2))
    work.result("markov", {}, lambda: pytest.fail("it is there"))
    with pytest.raises(SystemExit, match="other settings"):
        work.result("tree", {"rows": 400}, lambda: {})
    results = work.load()
    assert list(results["markov"]["sets"]) == ["test Green", "unseen"]
    options = {"variants": {}, "commands": ["teamclone ingest"], "sure": 0.8}
    options |= {"situations": fidelity.SITUATIONS}
    fidelity_page.write(
        tmp_path / "page.md", results=results, left={}, cleaning=work.dataset.meta["cleaning"], **options
    )
    text = (tmp_path / "page.md").read_text()
    shown = [
        " / ".join(f"{row['all']['model']['accuracy']['value']:.3f}" for row in results[name]["sets"].values())
        for name in ("tree", "markov", "majority")
    ]
    assert f"| accuracy | .93 / .925 / .91 | {' | '.join(shown)} |" in text
    # Steps that were not run have no section.
    assert re.findall(r"^## (.*)$", text, re.MULTILINE) == [
        *("Protocol", "Goals and figures", "Field players, and players 2 to 11", "Reproduce")
    ]
    assert not (tmp_path / "page.svg").exists()


def test_the_learning_curve_is_a_table_and_a_plot(work: fidelity.Work, tmp_path: Path) -> None:
    base = work.rule("majority")
    results = {
        "plain" if count == 22 else f"curve-{count}": {
            **base,
            "name": "x",
            "training_matches": count,
            "seconds": 60.0 * count,
            "machine": dict.fromkeys(("processor", "threads", "teamclone", "torch", "numpy", "python"), "?"),
        }
        for count in MATCHES
    }
    left = work.what_is_left(results)
    left["kicks"] = {"unseen": {"kicks": 1234, "as_planned": 0.91, "among": 0.95, "clone": None}}
    left["choices"] = {"pass": {"rows": 321, "as_planned": 0.9, "other_kick": 0.04, "dash": 0.06}}
    left["choices"]["pass"] |= {"turn": 0.0, "tackle": None}
    left["tackles"] = {"unseen": {"tackles": 64, "as_planned": 0.93, "clone": 0.89}}
    # All of these say the same, whatever the number of matches.
    for name, fit in left["curve"].items():
        assert fit["scale"] == pytest.approx(0.0, abs=1e-9)
        assert fit["floor"] == pytest.approx(base["sets"][name]["all"]["model"]["cross_entropy"]["value"])
    fidelity_page.write(
        tmp_path / "page.md",
        results=results,
        left=left,
        variants={},
        cleaning=None,
        commands=[],
        situations=fidelity.SITUATIONS,
        sure=0.8,
    )
    text = (tmp_path / "page.md").read_text()
    assert "![Cross-entropy by training matches](page.svg)" in text
    assert "| unseen | 1,234 | 91 % | 95 % | - |" in text
    assert "| unseen | 64 | 93 % | 89 % |" in text
    assert "| pass | 321 | 90 % | 4 % | 6 % | 0 % | - |" in text
    assert (tmp_path / "page.svg").read_text().startswith("<?xml")
