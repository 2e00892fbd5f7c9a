"""What a scouted team does without the ball."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from made_match import LEFT_1, LEFT_7, LEFT_9, RIGHT_1, RIGHT_4, RIGHT_9, MadeMatch
from scouted import both_sides, check_told, of_made, of_match, share, subject_of
from teamclone.logs import read_match
from teamclone.rcss import state_bits
from teamclone.rcss.playmodes import PlayMode
from teamclone.scout.sections import defence, pressing


def defending(frames: int = 60) -> MadeMatch:
    """The left team stands in lines of four, four and two; the right one has the ball from frame 3 on."""
    made = MadeMatch(frames)
    made.stand(LEFT_1, -50.0, 0.0)
    for slot, (x, y) in zip(
        range(1, 11),
        [(-30, -5), (-28, 5), (-26, -15), (-25, 20), (-15, -12), (-15, -4), (-15, 4), (-15, 12), (0, -5), (0, 5)],
        strict=True,
    ):
        made.stand(slot, float(x), float(y))
    made.ball(0, 10.0, 0.0)
    made.kick(2, RIGHT_9)
    return made


def test_the_last_line() -> None:
    look = defence.look(of_made(defending()))
    assert share(look, "defence_line") == pytest.approx(22.5)
    assert share(look, "defence_line_middle") == pytest.approx(22.5)
    assert look.numbers["defence_line_low"] == look.numbers["defence_line_high"] == (0, 0)
    assert share(look, "defence_behind") == pytest.approx(20.0)
    # Across the pitch the four stand at -15, -5, 5 and 20.
    assert [share(look, f"defence_gap_{one}") for one in ("left", "centre", "right")] == pytest.approx([10, 10, 15])
    assert share(look, "defence_gap") == pytest.approx(15)


def test_the_line_follows_the_ball() -> None:
    made = defending(103)
    for frame in range(3, 103):
        made.ball(frame, 10.0 - 0.3 * (frame - 3), 0.0)
        for slot in (1, 2, 3, 4):
            made.players["x"][frame, slot] -= 0.15 * (frame - 3)
    # Half as fast as the ball.
    assert share(defence.look(of_made(made)), "defence_follow") == pytest.approx(5.0, rel=1e-3)


def test_free_opponents() -> None:
    made = defending()
    for slot in range(11, 22):
        made.stand(slot, 30.0, 0.0)
    made.stand(RIGHT_9, -28.0, -13.0)
    made.stand(RIGHT_4, -40.0, 30.0)
    look = defence.look(of_made(made))
    assert share(look, "defence_marking") == pytest.approx((math.hypot(2, 2) + math.hypot(15, 10)) / 2, rel=1e-4)
    assert [share(look, f"defence_{key}") for key in ("free", "free_deep", "free_right")] == [0.5, 0.5, 1.0]
    assert share(look, "defence_free_centre") == 0.0


def test_a_press_and_its_trigger() -> None:
    made = defending(120)
    # A pass backwards from 9 to 4, who is then pressed by 9, who wins the ball.
    made.ball(10, 20.0, 0.0)
    made.kick(20, RIGHT_4)
    for frame in range(20, 36):
        made.stand(LEFT_9, 12.0 + 0.5 * (frame - 20), 0.0, frame=frame)
    made.kick(34, LEFT_9)
    look = defence.look(of_made(made))
    assert look.numbers["defence_press_won"] == (1, 1)
    held = look.numbers["defence_press"][1]
    assert look.numbers["defence_press"] == (100, held)
    assert held == 32
    backwards = pressing.TRIGGERS.index("after a pass backwards")
    assert look.arrays["press_triggers"][backwards].tolist() == [1, 1, 0, 0]
    assert look.arrays["press_by"][9] == 1
    (moment,) = look.moments["press_won"]
    assert (moment.unum, moment.own) == (9, True)


def test_a_through_pass_against() -> None:
    made = defending(90)
    for step in range(1, 21):
        made.ball(2 + step, 10.0 - 2.5 * step, 1.2 * step)
    made.kick(23, 17)
    look = defence.look(of_made(made))
    assert look.numbers["defence_through"][0] == 1
    assert look.numbers["defence_through_completed"] == (1, 1)
    assert look.numbers["defence_through_right"][0] == 1
    assert look.moments["through"][0].text == "their 9 plays 7 through"
    assert not look.moments["through"][0].own


def test_tackles() -> None:
    made = defending(80)
    made.tackle(20, LEFT_7)
    made.tackle(40, LEFT_9, missed=True)
    look = defence.look(of_made(made))
    assert look.numbers["defence_tackles"][0] == 2
    assert look.numbers["defence_tackles_missed"] == (1, 2)
    assert look.arrays["tackles_by"][[7, 9]].sum(1).tolist() == [1, 1]


def test_marking_counted_once_more_by_walking(samples_dir: Path) -> None:
    match = read_match(next(samples_dir.glob("*HELIOS_base_0-vs-YuShan2024_3.rcg.xz")))
    seen = of_match(match, frames=slice(0, 300))
    distances = []
    for frame in range(len(seen.world)):
        if seen.has[frame] != -1:
            continue
        place, keeps = seen.places[frame], seen.goalies[frame]
        for other in range(11, 22):
            if not keeps[other] and place[other, 0] < 0:
                apart = [math.dist(place[own], place[other]) for own in range(11) if not keeps[own]]
                distances.append(min(apart))
    assert len(distances) > 100
    look = defence.look(seen)
    assert share(look, "defence_marking") == pytest.approx(np.mean(distances), rel=1e-4)
    assert look.numbers["defence_free"] == (sum(one > 5 for one in distances), len(distances))


def test_what_is_told_of_real_matches(samples_dir: Path) -> None:
    found = defence.tell(subject_of(defence, both_sides(samples_dir, "YuShan2024")))
    check_told(found, least=5)


def hostile() -> dict[str, MadeMatch]:
    """Matches in which something is missing."""
    nothing, nobody, stopped, alone, lost = (MadeMatch(frames) for frames in (1, 30, 30, 30, 30))
    nobody.players["state"][:] = 0
    nobody.kick(3, RIGHT_9)
    stopped.mode(0, PlayMode.BEFORE_KICK_OFF)
    alone.players["state"][:, 1:11] = 0
    alone.kick(3, RIGHT_9)
    lost.players["x"][:] = lost.players["y"][:] = lost.players["body"][:] = np.nan
    lost.kick(3, RIGHT_9)
    lost.kick(9, RIGHT_4)
    return {
        "one frame": nothing,
        "nobody on the field": nobody,
        "no play": stopped,
        "a goalkeeper alone": alone,
        "no places": lost,
    }


@pytest.mark.parametrize("name", hostile())
def test_a_match_in_which_something_is_missing(name: str) -> None:
    made = hostile()[name]
    found = defence.tell(subject_of(defence, [(of_made(made), of_made(made, side=-1))] * 2))
    assert not any("nan" in one.text for one in found.claims)
    for picture in found.pictures:
        picture.draw()


def test_a_team_whose_opponents_never_have_the_ball() -> None:
    made = MadeMatch(30)
    made.kick(3, LEFT_9)
    found = defence.tell(subject_of(defence, [(of_made(made), of_made(made, side=-1))]))
    assert not found.claims
    assert "never have the ball" in found.notes[0]


def test_nobody_is_the_goalkeeper() -> None:
    made = defending()
    made.players["state"][:, [LEFT_1, RIGHT_1]] = state_bits.STAND
    look = defence.look(of_made(made))
    assert look.numbers["defence_behind"] == (0, 0)
