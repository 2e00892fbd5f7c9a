"""The chance of shots: against a plain computation, by what football says of it, and on real matches."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import teamclone as tc
from made_match import LEFT_9, RIGHT_1, RIGHT_2, RIGHT_4, MadeMatch
from teamclone.errors import TeamcloneError
from teamclone.events import expected_goals as module
from teamclone.events.expected_goals import (
    FRAME_COLUMNS,
    PATH,
    PLAYER_COLUMNS,
    SHADOW_M,
    SITUATIONS,
    TERMS,
    expected_goals,
    situations,
)
from teamclone.events.find import find_events
from teamclone.logs import Match, read_match
from teamclone.logs.match import Columns
from teamclone.rcss.playmodes import OTHER_SIDE, PlayMode

GOAL_X, POST_Y = 52.5, 7.01


@pytest.fixture(scope="module")
def matches(samples_dir: Path) -> list[Match]:
    return [read_match(path) for path in sorted(samples_dir.glob("*.rcg.xz"))]


def shots(match: Match) -> Columns:
    events = find_events(match.frames, match.players, match.game.server_params)
    return {name: values[events["kind"] == "shot"] for name, values in events.items()}


def chance(match: MadeMatch, frame: int = 0) -> float:
    """Of a shot of the left team."""
    [found] = expected_goals(match.frames, match.players, frame=np.array([frame]), side=np.array([1]))
    return float(found)


def attack(*, ball: tuple[float, float] = (40, 3), goalkeeper: tuple[float, float] = (50, 1)) -> MadeMatch:
    """The left team at the right one's goal; everybody else is far away."""
    match = MadeMatch(3)
    match.players["x"][:], match.players["y"][:] = -20.0, 30.0
    match.ball(0, *ball)
    match.stand(RIGHT_1, *goalkeeper)
    return match


# -- once more, ray by ray


def plain(match: Match, frame: int, side: int) -> dict[str, float]:
    """Situation of a shot by a walk over opponents and 20,000 directions."""
    ball = [float(match.frames[name][frame]) * side for name in ("ball_x", "ball_y")]
    opponents, keeper = [], None
    for slot in range(11, 22) if side == 1 else range(11):
        state = int(match.players["state"][frame, slot])
        place = [float(match.players[name][frame, slot]) * side for name in "xy"]
        if state & 0x1 and state & 0x8:
            keeper = place
        elif state & 0x1:
            opponents.append(place)
    assert keeper is not None
    first, last = (math.atan2(y - ball[1], GOAL_X - ball[0]) for y in (-POST_Y, POST_Y))
    rays = 20_000
    free = 0
    for ray in range(rays):
        angle = first + (last - first) * (ray + 0.5) / rays
        ahead = (math.cos(angle), math.sin(angle))
        for x, y in opponents:
            along = (x - ball[0]) * ahead[0] + (y - ball[1]) * ahead[1]
            beside = (y - ball[1]) * ahead[0] - (x - ball[0]) * ahead[1]
            if along > 0 and abs(beside) < SHADOW_M:
                break
        else:
            free += 1
    inside = 0
    for x, y in opponents:
        if x < GOAL_X and x > ball[0]:
            # Where the line from the ball through the opponent meets the goal line.
            inside += abs(ball[1] + (y - ball[1]) * (GOAL_X - ball[0]) / (x - ball[0])) < POST_Y
    to_keeper = math.atan2(keeper[1] - ball[1], keeper[0] - ball[0])
    return {
        "distance": math.dist(ball, (GOAL_X, 0)),
        "opening": math.degrees(last - first),
        "free_opening": math.degrees(last - first) * free / rays,
        "blockers": inside,
        "opponent_distance": min(math.dist(ball, place) for place in opponents),
        "goalkeeper_distance": math.dist(ball, keeper),
        "goalkeeper_off_line": GOAL_X - keeper[0],
        "goalkeeper_gap": math.degrees(max(abs(to_keeper - first), abs(last - to_keeper))),
        "set_play": float(match.frames["playmode"][frame] != PlayMode.PLAY_ON),
    }


def test_a_plain_computation_sees_the_same(matches: list[Match]) -> None:
    seen = 0
    numbers = json.loads(PATH.read_text())
    for match in matches[:3]:
        events = shots(match)
        found = situations(match.frames, match.players, frame=events["frame"], side=events["side"])
        assert list(found) == [one.name for one in SITUATIONS]
        for at, (frame, side) in enumerate(zip(events["frame"].tolist(), events["side"].tolist(), strict=True)):
            expected = plain(match, frame, side)
            assert {name: values[at] for name, values in found.items()} == pytest.approx(expected, abs=5e-3)
            logit = numbers["intercept"] + sum(
                numbers["coefficients"][name] * value
                for name, value in (
                    ("free_opening", expected["free_opening"]),
                    ("log_goalkeeper_gap", math.log(min(expected["goalkeeper_gap"], 90.0))),
                    ("log_goalkeeper_distance", math.log(max(expected["goalkeeper_distance"], 1.0))),
                    ("set_play", expected["set_play"]),
                )
            )
            assert events["expected_goals"][at] == pytest.approx(1 / (1 + math.exp(-logit)), abs=1e-3)
            seen += 1
    assert seen > 20


# -- what football says


def test_the_nearer_the_goal_the_better() -> None:
    for y in (0.0, 5.0, -12.0):
        along = [chance(attack(ball=(x, y * (GOAL_X - x) / 20), goalkeeper=(51, 0))) for x in range(22, 50, 3)]
        assert (np.diff(along) > 0).all(), (y, along)


def test_the_farther_the_goalkeeper_is_out_of_the_way_the_better() -> None:
    for way in (1, -1):
        along = [chance(attack(ball=(38, 0), goalkeeper=(50, way * y))) for y in np.arange(0, 12, 0.5)]
        assert (np.diff(along) > 0).all()
        assert along[-1] > 0.95


def test_opponents_in_the_way_hide_the_goal() -> None:
    match = attack(ball=(36, 0), goalkeeper=(51, 0))
    chances = [chance(match)]
    for slot, y in ((RIGHT_2, 1.5), (RIGHT_4, -1.5), (RIGHT_4 + 1, -4.5), (RIGHT_4 + 2, 4.5)):
        match.stand(slot, 48, y)
        chances.append(chance(match))
    assert (np.diff(chances) < 0).all()
    # Who stands in another's shadow hides nothing more, nor does who is behind the ball or beside the goal.
    for slot, x, y in ((RIGHT_4 + 3, 50, 1.75), (RIGHT_4 + 4, 30, 0), (RIGHT_4 + 5, 45, 20)):
        match.stand(slot, x, y)
    assert chance(match) == pytest.approx(chances[-1])


def test_teammates_hide_nothing() -> None:
    match = attack()
    before = chance(match)
    match.stand(LEFT_9, 44, 2)
    assert chance(match) == before


def test_a_player_at_the_ball_hides_half_of_the_directions() -> None:
    match = attack(ball=(40, 0))
    match.stand(RIGHT_4, 40, 0.5)
    [free] = situations(match.frames, match.players, frame=np.array([0]), side=np.array([1]))["free_opening"]
    assert free == pytest.approx(math.degrees(math.atan2(POST_Y, 12.5)))


def test_set_plays_score_less_and_other_modes_are_not_known() -> None:
    match = attack()
    before = chance(match)
    match.frames["playmode"][:] = PlayMode.INDIRECT_FREE_KICK_L
    assert chance(match) < before / 5
    for mode in (PlayMode.PENALTY_TAKEN_L, PlayMode.TIME_OVER, PlayMode.NULL):
        match.frames["playmode"][:] = mode
        assert math.isnan(chance(match)), mode


def test_coefficients_have_the_signs_that_football_gives_them() -> None:
    """A goalkeeper that is far from the ball has the time to get into its way."""
    signs = {name: np.sign(value) for name, value in json.loads(PATH.read_text())["coefficients"].items()}
    assert signs == dict(zip(TERMS, (1, 1, -1, -1), strict=True))


# -- mirrors


def mirrored(match: Match) -> Iterator[tuple[str, Columns, Columns, int]]:
    """The frames and players of a match with teams exchanged, and with the field turned over its long axis."""
    frames, players = dict(match.frames), {name: match.players[name] for name in PLAYER_COLUMNS}
    turned = {name: np.roll(values, 11, axis=1) for name, values in players.items()}
    other = {"playmode": OTHER_SIDE[frames["playmode"]], "ball_x": -frames["ball_x"], "ball_y": -frames["ball_y"]}
    yield "teams exchanged", other, turned | {name: -turned[name] for name in "xy"}, -1
    flipped = {name: frames[name] for name in FRAME_COLUMNS} | {"ball_y": -frames["ball_y"]}
    yield "left and right exchanged", flipped, players | {"y": -players["y"]}, 1


def test_mirrors_change_nothing(matches: list[Match]) -> None:
    for match in matches:
        events = shots(match)
        for name, frames, players, sign in mirrored(match):
            again = expected_goals(frames, players, frame=events["frame"], side=events["side"] * sign)
            assert again == pytest.approx(events["expected_goals"], abs=1e-6), name


# -- what a log lacks


def test_what_is_not_known_has_no_chance() -> None:
    assert 0 < chance(attack()) < 1
    for slot, name, value in ((RIGHT_1, "state", 0), (RIGHT_4, "x", np.nan), (RIGHT_1, "y", np.inf)):
        match = attack()
        match.players[name][:, slot] = value
        assert math.isnan(chance(match)), name
    match = attack()
    match.frames["ball_x"][:] = np.nan
    assert math.isnan(chance(match))
    match = attack()
    match.players["state"][:, RIGHT_4] = 0
    match.players["x"][:, RIGHT_4] = np.nan
    assert chance(match) == chance(attack()), "who is not on the field has no place"


def test_only_shots_have_a_chance(matches: list[Match]) -> None:
    for match in matches:
        events = find_events(match.frames, match.players, match.game.server_params)
        assert (np.isfinite(events["expected_goals"]) == (events["kind"] == "shot")).all()
        assert events["expected_goals"].dtype == np.float32


def test_a_store_is_enough(matches: list[Match], tmp_path: Path) -> None:
    store, match = tc.create_store(tmp_path / "store"), matches[0]
    store.add(match)
    frames = store.read_match_columns(match.match_id, "frames", columns=FRAME_COLUMNS)
    players = store.read_match_columns(match.match_id, "player_states", columns=PLAYER_COLUMNS)
    events = shots(match)
    found = expected_goals(frames, players, frame=events["frame"], side=events["side"])
    assert found.astype(np.float32).tolist() == events["expected_goals"].tolist()
    sums = store.sql("select sum(expected_goals) as total, count(expected_goals) as n from match_events").to_pylist()
    assert sums == [{"total": pytest.approx(found.sum(), rel=1e-6), "n": len(found)}]


# -- the model


def test_as_many_goals_as_expected(matches: list[Match]) -> None:
    """Of the bundled matches, which are among those of the fit, together and of likely and unlikely shots alone."""
    every = [shots(match) for match in matches]
    expected, goal = (
        np.concatenate(parts)
        for parts in zip(*((s["expected_goals"], s["outcome"] == "goal") for s in every), strict=True)
    )
    assert goal.sum() > 20
    for these in (expected > 0, expected > 0.7, expected <= 0.7):
        spread = math.sqrt((expected[these] * (1 - expected[these])).sum())
        assert abs(goal[these].sum() - expected[these].sum()) < 2.5 * spread
    assert expected[goal].mean() > expected[~goal].mean() + 0.15


def test_the_file_says_what_it_was_fitted_to(samples_dir: Path) -> None:
    document = json.loads(PATH.read_text())
    assert {path.name for path in samples_dir.glob("*HELIOS_base_8*.rcg.xz")} <= set(document["matches"])
    assert document["shots"] > document["goals"] > len(document["matches"]) > 50
    loss = {name: figures["log_loss"] for name, figures in document["left_out"].items()}
    assert loss["the model"] < loss["distance and opening"] < loss["the same rate always"]


def test_a_foreign_file_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    foreign = tmp_path / "expected_goals.json"
    foreign.write_text(PATH.read_text().replace('"format": 1', '"format": 9'))
    monkeypatch.setattr(module, "PATH", foreign)
    module._model.cache_clear()
    try:
        with pytest.raises(TeamcloneError, match=r"model of expected goals of format 9, this version reads 1; make it"):
            chance(attack())
    finally:
        module._model.cache_clear()
