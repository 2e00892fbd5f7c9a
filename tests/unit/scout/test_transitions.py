"""Turnovers, set plays and the goalkeeper of a scouted team."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from made_match import LEFT_1, LEFT_2, LEFT_7, LEFT_9, RIGHT_4, RIGHT_9, MadeMatch
from scouted import both_sides, check_told, of_made, of_match, share, subject_of
from teamclone.logs import read_match
from teamclone.rcss import pitch, state_bits
from teamclone.rcss.playmodes import PlayMode
from teamclone.scout import figures
from teamclone.scout.measures import Looks
from teamclone.scout.places import third
from teamclone.scout.sections import set_plays, transitions
from teamclone.scout.seen import Seen


def test_a_ball_lost_and_won_back() -> None:
    made = MadeMatch(120)
    made.kick(2, LEFT_9)
    made.ball(3, 2.0, 0.0)
    made.kick(10, RIGHT_4)
    made.ball(20, -2.0, 0.0)
    made.kick(30, LEFT_7)
    look = transitions.look(of_made(made))
    assert look.numbers["turnover_regained"] == (1, 1)
    assert look.numbers["turnover_shot_against"] == (0, 1)
    assert look.numbers["turnover_shot_middle"] == (0, 1)
    # All ten field players stand at x = -50, behind the ball.
    assert share(look, "turnover_behind") == 10


def test_a_ball_won_back_too_late_does_not_count() -> None:
    made = MadeMatch(160)
    made.kick(2, LEFT_9)
    made.kick(10, RIGHT_4)
    made.kick(11 + transitions.turnovers.SOON_CYCLES, LEFT_7)
    assert transitions.look(of_made(made)).numbers["turnover_regained"] == (0, 1)


def test_a_ball_won_is_carried_forward_and_shot() -> None:
    made = MadeMatch(120)
    made.kick(2, RIGHT_9)
    made.kick(10, LEFT_7)
    made.ball(20, 21.0, 0.0)
    made.kick(30, LEFT_9)
    for step in range(1, 12):
        made.ball(30 + step, 21.0 + 2.8 * step, 0.0)
    made.ball(42, 53.5, 0.0)
    made.mode(42, PlayMode.GOAL_L)
    look = transitions.look(of_made(made))
    assert look.numbers["turnover_forward"] == (1, 1)
    assert look.numbers["turnover_shot"] == (1, 1)
    (seen,) = look.moments["turnover_shot"]
    assert (seen.cycle, seen.unum, seen.text) == (110, 7, "7 wins it, a goal 20 cycles later")
    theirs = transitions.look(of_made(made, side=-1))
    assert theirs.numbers["turnover_shot_against"] == (1, 1)
    assert theirs.moments["turnover_hurt"][0].text.startswith("their 7 wins it")


def kick_in(*, lost: bool) -> MadeMatch:
    """A kick-in of the left team at the left side line, six cycles after the whistle."""
    made = MadeMatch(120)
    made.ball(0, 20.0, -34.0)
    made.stand(LEFT_7, 20.0, -34.0)
    made.mode(3, PlayMode.KICK_IN_L, 10)
    made.kick(9, LEFT_7)
    made.ball(12, 30.0, -20.0)
    made.kick(15, LEFT_9)
    if lost:
        made.kick(30, RIGHT_4)
    return made


@pytest.mark.parametrize("lost", [False, True])
def test_a_kick_in(lost: bool) -> None:
    look = transitions.look(of_made(kick_in(lost=lost)))
    kick_in_ = set_plays.KICK_IN
    assert look.numbers["set_kick_in"][0] == 1
    assert look.numbers["set_kick_in_wait"] == (6, 1)
    assert look.numbers["set_kick_in_kept"] == (not lost, 1)
    assert look.numbers["set_kick_in_shot"] == (0, 1)
    assert np.argwhere(look.arrays["set_takers"]).tolist() == [[kick_in_, 7]]
    assert np.argwhere(look.arrays["set_receivers"]).tolist() == [[kick_in_, 9]]
    np.testing.assert_allclose(look.arrays["set_balls"], [[0, 20, -34, 30, -20]])
    np.testing.assert_allclose(look.arrays["set_stood"][0, LEFT_7], [20, -34, 1])


def test_where_the_other_team_stands_at_a_kick_in() -> None:
    made = kick_in(lost=False)
    made.stand(RIGHT_4, 25.0, -20.0)
    own, other = of_made(made), of_made(made, side=-1)
    np.testing.assert_allclose(transitions.look(own).arrays["set_faced"][0, 3], [25, -20, 1])
    assert not transitions.look(other).arrays["set_faced"].any()


def test_a_team_is_drawn_in_its_own_frame_at_its_opponents_set_plays(monkeypatch: pytest.MonkeyPatch) -> None:
    made = kick_in(lost=False)
    made.stand(RIGHT_4, 25.0, -20.0)
    theirs, own = (
        Looks([transitions.look(of_made(made, side=side))] * set_plays.LEAST_DRAWN, set_plays.MEASURES)
        for side in (1, -1)
    )
    drawn: list[figures.Panel] = []
    monkeypatch.setattr(figures, "set_plays", drawn.extend)
    (picture,) = set_plays.tell(own, theirs).pictures
    picture.draw()
    ((title, places, start, end),) = drawn
    assert title == "Kick-ins in its half, from their left (3)"
    np.testing.assert_allclose(places[3], [-25, 20])
    np.testing.assert_allclose(start, [[-20, 34]] * set_plays.LEAST_DRAWN)
    np.testing.assert_allclose(end, [[-30, 20]] * set_plays.LEAST_DRAWN)


def test_a_set_play_that_nobody_takes_counts_but_is_not_taken() -> None:
    made = MadeMatch(40)
    made.mode(3, PlayMode.KICK_IN_L, 20)
    look = transitions.look(of_made(made))
    assert look.numbers["set_kick_in"][0] == 1
    assert look.numbers["set_kick_in_kept"] == look.numbers["set_kick_in_wait"] == (0, 0)


def test_the_goalkeeper_kicks_after_a_catch() -> None:
    made = MadeMatch(80)
    made.kick(2, RIGHT_9)
    made.catch(9, LEFT_1)
    made.mode(10, PlayMode.FREE_KICK_L, 30)
    made.kick(29, LEFT_1)
    made.kick(40, LEFT_2)
    look = transitions.look(of_made(made))
    assert look.numbers["set_catch"][0] == 1
    assert look.numbers["set_free_kick"][0] == 0
    assert look.numbers["keeper_catches"][0] == 1
    np.testing.assert_allclose(look.arrays["keeper_caught"], [[made.frames["ball_x"][9], made.frames["ball_y"][9]]])
    assert look.arrays["set_receivers"][set_plays.CATCH, 2] == 1


def test_the_goalkeeper_stands_off_its_line() -> None:
    made = MadeMatch(40)
    made.stand(LEFT_1, -48.5, 0.0)
    made.stand(LEFT_1, -40.0, 25.0, frame=30)
    made.ball(0, 10.0, 0.0)
    made.ball(30, -40.0, 0.0)
    look = transitions.look(of_made(made))
    assert share(look, "keeper_far") == pytest.approx(4.0)
    assert share(look, "keeper_near") == pytest.approx(12.5)
    assert look.numbers["keeper_out"] == (10, 40)
    assert look.arrays["keeper_off"][6] == pytest.approx(30 * 4.0)


def test_where_a_goal_crosses_the_line() -> None:
    made = MadeMatch(60)
    made.ball(0, -40.0, 0.0)
    made.kick(5, RIGHT_9)
    # Six cycles of (-2.5, 0.5): it crosses x = -52.5 after five, at y = 2.5, on the keeper's right.
    for step in range(1, 7):
        made.ball(5 + step, -40.0 - 2.5 * step, 0.5 * step)
    made.mode(11, PlayMode.GOAL_R)
    look = transitions.look(of_made(made))
    assert look.numbers["keeper_goals_right"] == (1, 1)
    assert look.numbers["keeper_saved"] == (0, 1)
    part = int((2.5 / pitch.GOAL_WIDTH + 0.5) * 7)
    assert look.arrays["keeper_goals"].tolist() == [part == one for one in range(7)]


def test_another_one_than_the_servers_goalkeeper_keeps_the_goal() -> None:
    made = MadeMatch(30)
    made.players["state"][:, LEFT_1] = state_bits.STAND
    made.players["state"][:, LEFT_2] |= state_bits.GOALIE
    made.stand(LEFT_2, -20.0, 0.0)
    made.stand(LEFT_1, -50.0, 0.0)
    for slot in range(2, 11):
        made.stand(slot, -10.0, 3.0 * slot)
    seen = of_made(made)
    assert seen.goalies[:, :11].any(0).tolist() == [True] + 10 * [False]
    assert seen.gloves[:, :11].any(0).tolist() == [False, True] + 9 * [False]
    found = transitions.tell(subject_of(transitions, [(seen, of_made(made, side=-1))]))
    assert any("In 1 of 1 matches another number kept its goal" in note for note in found.notes)


def test_the_same_counted_once_more_by_walking(samples_dir: Path) -> None:
    (path,) = samples_dir.glob("*HELIOS_base_8-vs-WEBase_0.rcg.xz")
    seen = of_match(read_match(path))
    look = transitions.look(seen)
    won = [row for row in rows(seen, "interception", "won") if row["own"]]
    lost = [row for row in rows(seen, "interception", "won") if not row["own"]]
    shots = [row["frame"] for row in rows(seen, "shot") if row["own"]]
    cycle = seen.world.cycle

    def soon(start: int, frames: list[int], cycles: int) -> bool:
        frame = start
        while frame < len(cycle) and cycle[frame] <= cycle[start] + cycles:
            if frame in frames:
                return True
            if frame > start and not seen.play_on[frame]:
                return False
            frame += 1
        return False

    assert len(won) > 5
    assert lost
    gained = [row["end_frame"] for row in won]
    assert look.numbers["turnover_shot"] == (sum(soon(one, shots, 100) for one in gained), len(won))
    assert look.numbers["turnover_regained"] == (sum(soon(r["end_frame"], gained, 50) for r in lost), len(lost))
    deep = [row for row in won if third(np.array([row["end_x"]]))[0] == 0]
    assert look.numbers["turnover_shot_own"] == (sum(soon(r["end_frame"], shots, 100) for r in deep), len(deep))


def rows(seen: Seen, kind: str, outcome: str | None = None) -> list[dict[str, object]]:
    """Events as dictionaries."""
    found = [
        {name: values[at].item() for name, values in seen.events.items()} for at in range(len(seen.events["kind"]))
    ]
    return [row for row in found if row["kind"] == kind and outcome in (None, row["outcome"])]


def test_what_is_told_of_real_matches(samples_dir: Path) -> None:
    found = transitions.tell(subject_of(transitions, both_sides(samples_dir, "WEBase")))
    check_told(found, least=4)
    for one in found.claims:
        assert all(0 < at.cycle <= 6000 for at in one.moments)


def hostile() -> dict[str, MadeMatch]:
    """Matches in which something is missing."""
    nothing, nobody, stopped, lost = (MadeMatch(frames) for frames in (1, 30, 30, 30))
    nobody.players["state"][:] = 0
    stopped.mode(0, PlayMode.BEFORE_KICK_OFF)
    lost.players["x"][:] = lost.players["y"][:] = np.nan
    lost.kick(3, LEFT_9)
    lost.kick(9, RIGHT_4)
    lost.catch(12, LEFT_1)
    return {"one frame": nothing, "nobody on the field": nobody, "no play": stopped, "no places": lost}


@pytest.mark.parametrize("name", hostile())
def test_a_match_in_which_something_is_missing(name: str) -> None:
    made = hostile()[name]
    found = transitions.tell(subject_of(transitions, [(of_made(made), of_made(made, side=-1))] * 2))
    assert not any("nan" in one.text for one in found.claims)
    for picture in found.pictures:
        picture.draw()


@pytest.mark.parametrize("frames", [2, 40, 200])
def test_logs_that_end_early(samples_dir: Path, frames: int) -> None:
    match = read_match(next(samples_dir.glob("*HELIOS_base_8-vs-WEBase_0.rcg.xz")))
    for side in (1, -1):
        look = transitions.look(of_match(match, side=side, frames=slice(0, frames)))
        assert all(np.isfinite(pair).all() for pair in look.numbers.values())
