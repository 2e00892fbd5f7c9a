"""What a match says of a team, by hand and against the log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from compared import TEAM, made_store, variant
from teamclone.comparison.profile import N_BINS, NUMBERS, Profile, profile, zones
from teamclone.logs import Match, read_match
from teamclone.play.holes import count_holes
from teamclone.rcss import state_bits
from teamclone.rcss.playmodes import PlayMode
from teamclone.store.store import Store


@pytest.fixture(scope="module")
def match(samples_dir: Path) -> Match:
    return read_match(next(samples_dir.glob("*Cyrus2DBase_0-vs-HELIOS_base*.rcg.xz")))


@pytest.fixture(scope="module")
def store(match: Match, tmp_path_factory: pytest.TempPathFactory) -> Store:
    return made_store(tmp_path_factory.mktemp("profile") / "store", [match])


@pytest.fixture(scope="module")
def made(store: Store) -> Profile:
    (row,) = store.matches().to_pylist()
    return profile(store, row, side=-1)


def value(made: Profile, name: str) -> float:
    return float(made.numbers[[one.name for one in NUMBERS].index(name)])


def test_zones_are_thirds_of_the_pitch() -> None:
    assert zones(np.array([[-50, -30], [-50, 0], [0, 0], [17, 12], [18, 34], [60, -40]])).tolist() == [0, 1, 4, 5, 8, 6]


def test_names_are_unique() -> None:
    assert len({one.name for one in NUMBERS}) == len(NUMBERS)


def test_the_score_is_that_of_the_log(made: Profile, match: Match) -> None:
    assert (match.left.name, match.right.name) == (made.opponent, TEAM)
    assert value(made, "goals") == match.right.score
    assert value(made, "goals_against") == match.left.score
    assert value(made, "draw") == (match.left.score == match.right.score)


def test_places_are_those_of_the_log_turned(made: Profile, match: Match) -> None:
    play_on = match.frames["playmode"] == PlayMode.PLAY_ON
    x = -match.players["x"][play_on, 11 + 6].astype(float)
    assert made.positions[6, 0].sum() == len(x)
    centres = np.arange(N_BINS) - N_BINS / 2 + 0.5
    assert (made.positions[6, 0].sum(0) * centres).sum() / len(x) == pytest.approx(x.mean(), abs=0.1)


def test_shares_and_speeds_are_of_field_players(made: Profile, match: Match) -> None:
    names = [one.name for one in NUMBERS if one.name.endswith("_share")]
    assert sum(value(made, name) for name in names) == pytest.approx(1.0, abs=0.005)
    goalie = (match.players["state"][:, 11:] & state_bits.GOALIE) != 0
    ways = np.hypot(*(np.diff(match.players[name][:, 11:].astype(float), axis=0) for name in "xy"))
    mode = match.frames["playmode"] == PlayMode.PLAY_ON
    ways = ways[(mode[1:] & mode[:-1])[:, None] & ~goalie[1:]]
    assert value(made, "speed") == pytest.approx(ways.mean(), rel=0.01)
    assert made.speeds.sum() == pytest.approx(len(ways), rel=0.01)


def test_stamina_is_that_of_the_last_cycles_of_the_halves(made: Profile, match: Match) -> None:
    play_on = np.flatnonzero(match.frames["playmode"] == PlayMode.PLAY_ON)
    half = play_on[match.frames["cycle"][play_on] <= 1000][-1]
    for name, frame in (("stamina_half", half), ("stamina_end", play_on[-1])):
        field = (match.players["state"][frame, 11:] & state_bits.GOALIE) == 0
        assert value(made, name) == pytest.approx(match.players["stamina"][frame, 11:][field].mean(), rel=1e-5)


def test_holes_need_a_command_log(made: Profile, match: Match, tmp_path: Path) -> None:
    assert value(made, "holes") == count_holes(match).holes[11:].sum()
    without = made_store(tmp_path / "store", [variant(match, 0)])
    (row,) = without.matches().to_pylist()
    assert np.isnan(value(profile(without, row, side=-1), "holes"))
