"""From an outcome to the document that report and command line read."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from teamclone.evaluation import metrics
from teamclone.evaluation.baselines import Baselines
from teamclone.evaluation.describe import describe, unseen_numbers
from teamclone.evaluation.predictions import Predictions
from teamclone.report.page import listing, number, percent, points, sentences
from teamclone.system.documents import write_document

MATCHES = [{"match_id": f"m{index}", "opponent": "Red" if index < 2 else "Blue"} for index in range(12)]
BASELINES = Baselines(transitions=np.full((5, 4), 9), parameters=np.full(6, 5.0))


def outcome(n: int = 600, n_matches: int = 3) -> Predictions:
    generator = np.random.default_rng(8)
    kind = generator.choice(3, n, p=[0.6, 0.35, 0.05])  # no tackle occurs
    issued = np.full((n, 6), np.nan, np.float32)
    issued[kind == 0, 0] = 60
    return Predictions(
        probabilities=(0.2 * generator.dirichlet(np.ones(4), n) + 0.8 * np.eye(4)[kind]).astype(np.float32)[
            generator.permutation(n)
        ],
        parameters=np.full((n, 6), 50, np.float32),
        parameter_log_loss=np.where(kind == 0, generator.normal(3, 1, n), np.nan).astype(np.float32),
        kind=kind,
        issued=issued,
        last=kind[generator.permutation(n)],
        match=np.sort(generator.integers(0, n_matches, n)),
        position=np.zeros((n, 2), np.float32),
    )


def test_figures_are_those_of_the_metrics() -> None:
    made = outcome()
    section = describe(made, baselines=BASELINES, matches=MATCHES)
    scores = metrics.scores(metrics.measure(made)[1].total())
    for name, value in section["model"].items():
        assert value["value"] == pytest.approx(float(getattr(scores, name)))
        assert value["low"] < value["value"] < value["high"]
    assert np.array(section["confusion"]).sum() == section["rows"] == 600
    assert section["commands"]["tackle"]["recall"]["value"] is None
    dash = section["parameters"]["dash_power"]
    assert dash["mean"] == {"value": 10.0, "low": 10.0, "high": 10.0}
    assert (dash["median"], dash["constant"]["mean"], dash["constant"]["guess"]) == (10.0, 55.0, 5.0)
    assert section["parameters"]["kick_power"]["mean"]["value"] is None
    assert sum(match["rows"] for match in section["matches"]) == 600
    loss = section["commands"]["dash"]["parameter_log_loss"]
    assert loss["value"] == pytest.approx(float(np.nanmean(made.parameter_log_loss)), abs=1e-6)
    assert loss["low"] < loss["value"] < loss["high"]
    assert section["commands"]["turn"]["parameter_log_loss"] == {"value": None, "low": None, "high": None}


def test_gain_over_a_baseline_is_paired() -> None:
    section = describe(outcome(), baselines=BASELINES, matches=MATCHES)
    for row in section["baselines"].values():
        gain = row["accuracy_gain"]
        assert gain["value"] == pytest.approx(section["model"]["accuracy"]["value"] - row["accuracy"]["value"])
        assert gain["low"] <= gain["value"] <= gain["high"]
        skill = 1 - section["model"]["cross_entropy"]["value"] / row["cross_entropy"]["value"]
        assert row["cross_entropy_skill"]["value"] == pytest.approx(skill)


def test_opponents_are_the_split_in_parts() -> None:
    made = outcome()
    section = describe(made, baselines=BASELINES, matches=MATCHES)
    by_name = {row["opponent"]: row for row in section["opponents"]}
    assert by_name["Red"]["matches"] == 2
    assert by_name["Blue"]["matches"] == 1
    assert by_name["Blue"]["accuracy"]["low"] is None
    red = made.rows(made.match < 2)
    assert by_name["Red"]["accuracy"]["value"] == pytest.approx((red.probabilities.argmax(1) == red.kind).mean())


def test_two_entries_of_one_match_are_one_draw() -> None:
    """Seen from both teams it is still the same game."""
    made = outcome(n_matches=4)
    twins = [{"match_id": f"m{index // 2}", "opponent": "Red" if index % 2 else "Blue"} for index in range(4)]
    section = describe(made, baselines=BASELINES, matches=twins)
    joined = describe(replace(made, match=made.match // 2), baselines=BASELINES, matches=MATCHES)
    for figure, value in joined["model"].items():
        assert section["model"][figure] == pytest.approx(value)
    for rule, row in joined["baselines"].items():
        assert section["baselines"][rule]["accuracy_gain"] == pytest.approx(row["accuracy_gain"])
    assert section["commands"]["kick"]["recall"] == pytest.approx(joined["commands"]["kick"]["recall"])
    apart = describe(made, baselines=BASELINES, matches=MATCHES)
    assert section["model"]["accuracy"]["low"] != pytest.approx(apart["model"]["accuracy"]["low"])
    assert [row["match_id"] for row in section["matches"]] == ["m0", "m1"]
    assert section["matches"][0]["opponent"] == "Blue and Red"
    assert section["matches"][0]["rows"] == (made.match < 2).sum()
    assert {row["opponent"]: (row["matches"], row["rows"]) for row in section["opponents"]} == {
        "Blue": (2, (made.match % 2 == 0).sum()),
        "Red": (2, (made.match % 2 == 1).sum()),
    }
    one = describe(outcome(n_matches=2), baselines=BASELINES, matches=twins)
    assert one["model"]["accuracy"]["low"] is None


def test_one_match_has_no_interval() -> None:
    section = describe(outcome(n_matches=1), baselines=BASELINES, matches=MATCHES)
    assert all(value["low"] is None and value["high"] is None for value in section["model"].values())
    assert section["baselines"]["markov"]["accuracy_gain"]["low"] is None


def test_the_same_seed_gives_the_same_document(tmp_path) -> None:
    made = outcome(n_matches=12)
    documents = [describe(made, baselines=BASELINES, matches=MATCHES, seed=seed) for seed in (1, 1, 2)]
    assert documents[0] == documents[1] != documents[2]
    write_document(tmp_path / "a.json", documents[0])
    assert json.loads((tmp_path / "a.json").read_text()) == documents[0]


def document(**splits: Predictions) -> dict:
    sections = {name: describe(made, baselines=BASELINES, matches=MATCHES) for name, made in splits.items()}
    return {"splits": sections, "dataset": {"team": "HELIOS_base", "options": {"split": "match"}}}


def test_the_headline_claims_only_what_the_numbers_hold() -> None:
    evaluation = document(test=outcome())
    text = " ".join(sentences(evaluation))
    assert "In 3 matches it never saw" in text
    model = evaluation["splits"]["test"]["model"]["accuracy"]
    assert percent(model["value"]) in text
    assert "95 % interval" in text
    for baseline in evaluation["splits"]["test"]["baselines"].values():
        baseline["accuracy_gain"] = {"value": 0.031, "low": 0.02, "high": 0.04}
    assert "3.1 points above the strongest rule" in " ".join(sentences(evaluation))
    for baseline in evaluation["splits"]["test"]["baselines"].values():
        baseline["accuracy_gain"] = {"value": 0.01, "low": -0.01, "high": 0.03}
    assert "not certain" in " ".join(sentences(evaluation))
    for baseline in evaluation["splits"]["test"]["baselines"].values():
        baseline["accuracy_gain"] = {"value": -0.01, "low": None, "high": None}
        baseline["cross_entropy_skill"] = {"value": 0.031, "low": None, "high": None}
    text = " ".join(sentences(evaluation))
    assert "does not beat" in text
    assert "3\N{NARROW NO-BREAK SPACE}% less surprise" in text
    for baseline in evaluation["splits"]["test"]["baselines"].values():
        baseline["cross_entropy_skill"] = {"value": -0.2, "low": None, "high": None}
    assert "surprise" not in " ".join(sentences(evaluation))


def test_the_headline_names_unseen_opponents_and_a_leaking_split() -> None:
    evaluation = document(test=outcome(), unseen=outcome())
    assert "Against Red and Blue, never met in training" in " ".join(sentences(evaluation))
    assert "the same." in " ".join(sentences(evaluation))
    evaluation["dataset"]["options"]["split"] = "rows"
    assert "never saw" not in " ".join(sentences(evaluation))
    assert "trained on" in " ".join(sentences(evaluation))


def test_numbers_as_readers_see_them() -> None:
    assert percent(0.8456) == "84.6\N{NARROW NO-BREAK SPACE}%"
    assert percent(None) == number(None) == points(None) == "\N{EN DASH}"
    assert number(1234.5678, 1) == "1,234.6"
    assert points(-0.015) == "\N{MINUS SIGN}1.5"
    assert points(0.0812) == "+8.1"
    assert listing(["A"]) == "A"
    assert listing(["A", "B", "C"]) == "A, B and C"
    assert listing(["A", "B", "C", "D", "E", "F"]) == "A, B, C, D and 2 more"


def test_numbers_that_never_played_in_training_are_named():
    """Player 0 (number 1) is in the split and not in training; 3 of his 4 commands are predicted right."""
    kind = np.array([0, 0, 1, 1, 0], np.int64)
    probabilities = np.eye(4, dtype=np.float32)[[0, 0, 1, 0, 0]]
    outcome = Predictions(
        probabilities=probabilities,
        parameters=np.zeros((5, 6), np.float32),
        parameter_log_loss=np.zeros(5, np.float32),
        kind=kind,
        issued=np.zeros((5, 6), np.float32),
        last=kind,
        match=np.zeros(5, np.int64),
        position=np.zeros((5, 2), np.float32),
    )
    players = np.array([0, 0, 0, 0, 7], np.uint8)
    trained = np.array([5, 7, 7], np.uint8)
    assert unseen_numbers(outcome, players=players, trained=trained) == {"1": {"rows": 4, "accuracy": 0.75}}
    assert unseen_numbers(outcome, players=players, trained=players) == {}
