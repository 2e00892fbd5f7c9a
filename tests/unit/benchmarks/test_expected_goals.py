"""The benchmark of expected goals on the bundled matches."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import expected_goals as benchmark
import numpy as np
import pytest
from sklearn.neighbors import KNeighborsClassifier

from teamclone.events.expected_goals import TERMS, chance, terms


@pytest.fixture(scope="module")
def read(samples_dir: Path) -> tuple[benchmark.Shots, list[str]]:
    return benchmark.read([samples_dir, samples_dir])


def test_matches_count_once(read: tuple[benchmark.Shots, list[str]], samples_dir: Path) -> None:
    shots, names = read
    assert set(names) <= {path.name for path in samples_dir.glob("*.rcg.xz")}
    assert len(names) == len(set(names)) == len(np.unique(shots.match)) == 5, "one of the six has no shot"
    assert np.bincount(shots.match).sum() == len(shots) > 30
    assert set(shots.by) == {"HELIOS_base", "WEBase", "Cyrus2DBase", "YuShan2024"}
    assert set(shots.against) <= set(shots.by)
    assert not (shots.by == shots.against).any()


def test_a_match_is_not_in_its_own_fit(read: tuple[benchmark.Shots, list[str]]) -> None:
    """Every second match scores always: the nearest match among the others says the opposite."""
    shots, _ = read
    every_second = replace(shots, goal=shots.match % 2 == 0)
    nearest = KNeighborsClassifier(n_neighbors=1)
    found = benchmark.left_out(nearest, shots.match[:, None].astype(float), every_second, groups=shots.match)
    assert found.tolist() == (~every_second.goal).astype(float).tolist()


def test_the_written_numbers_are_those_of_the_fit(
    samples_dir: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(benchmark, "PATH", tmp_path / "made.json")
    benchmark.main([str(samples_dir), "--write"])
    made = json.loads((tmp_path / "made.json").read_text())
    shots, names = benchmark.read([samples_dir])
    assert (made["shots"], made["goals"], made["matches"]) == (len(shots), shots.goal.sum(), names)
    fitted = benchmark.regression().fit(terms(shots.found), shots.goal).predict_proba(terms(shots.found))[:, 1]
    coefficients = [made["coefficients"][name] for name in TERMS]
    logit = made["intercept"] + terms(shots.found) @ coefficients
    assert 1 / (1 + np.exp(-logit)) == pytest.approx(fitted, abs=2e-3)
    assert np.corrcoef(fitted, chance(shots.found))[0, 1] > 0.7
    printed = capsys.readouterr().out
    assert "boosted trees, all columns" in printed
    assert "0.9 to 1.0" in printed
