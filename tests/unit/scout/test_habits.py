"""What each number does next with the ball: by hand and against the log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from made_match import LEFT_1, LEFT_7, LEFT_9, RIGHT_4, MadeMatch
from scouted import of_looks, of_made
from teamclone.events.definitions import EventKind
from teamclone.events.find import find_events
from teamclone.logs import Match, read_match
from teamclone.rcss.playmodes import RESTARTS, PlayMode
from teamclone.scout.decisions import CLEARANCE, DRIBBLE, HOLD, LOST_PASS, SHOT, decisions
from teamclone.scout.distribution import NOBODY, RESTART_KINDS, keeper, restarts
from teamclone.scout.sections import habits
from teamclone.scout.seen import Seen


def passing() -> MadeMatch:
    """7 kicks twice, at last to 9, which dribbles and plays the ball to 4 of the others, all on the left."""
    match = MadeMatch(60)
    match.ball(0, 0, -30)
    match.stand(LEFT_7, 0, -30)
    match.stand(LEFT_9, 20, -30)
    match.stand(RIGHT_4, 40, -28)
    match.kick(2, LEFT_7)
    match.kick(3, LEFT_7)
    match.ball(12, 20, -30)
    match.kick(12, LEFT_9)
    match.dash(14, LEFT_9)
    match.ball(20, 22, -30)
    match.stand(LEFT_9, 22, -30, 20)
    match.kick(20, LEFT_9)
    match.ball(30, 40, -28)
    match.kick(30, RIGHT_4)
    return match


def test_decisions_by_hand() -> None:
    made = decisions(of_made(passing()))
    assert made.frame.tolist() == [2, 12, 20]
    assert made.answer.tolist() == [8, DRIBBLE, LOST_PASS]
    number, third, lane, pressed = made.cell.tolist()
    assert number == [6, 8, 8]
    assert third == [1, 2, 2]
    assert lane == [0, 0, 0]
    assert pressed == [0, 0, 0]
    assert made.start[0].tolist() == [0, -30]
    assert made.end[0].tolist() == [20, -30]


def test_an_opponent_within_five_metres_presses() -> None:
    match = passing()
    match.stand(RIGHT_4, 4, -27)
    assert decisions(of_made(match)).cell[3].tolist() == [1, 0, 0]
    match.players["state"][:6, RIGHT_4] = 0
    assert decisions(of_made(match)).cell[3].tolist() == [0, 0, 0]


def test_kicks_without_a_dash_for_long_are_holding() -> None:
    match = passing()
    for frame in (4, 8):
        match.kick(frame, LEFT_7)
    assert decisions(of_made(match)).answer.tolist()[0] == 8
    match = passing()
    match.ball(14, 0, -30)
    for frame in (8, 14):
        match.kick(frame, LEFT_7)
    match.players["state"][13, LEFT_9] = 1
    assert decisions(of_made(match)).answer.tolist()[0] == HOLD


def test_the_other_team_sees_it_turned() -> None:
    match = passing()
    match.turn()
    one, other = habits.look(of_made(passing())), habits.look(of_made(match, side=-1))
    assert one.numbers == other.numbers
    for name, values in one.arrays.items():
        np.testing.assert_array_equal(values, other.arrays[name], err_msg=name)


def test_how_often_two_decisions_are_the_same() -> None:
    """Of 3 and 1: pairs 3 x 2 of 4 x 3, that is half, among 4 decisions; a single decision is no pair."""
    assert habits.same(np.array([[3, 1], [1, 0], [0, 2]])) == (pytest.approx(4 * 0.5 + 2), 6)
    assert habits.same(np.zeros((2, 3), int)) == (0, 0)


def kick_in() -> MadeMatch:
    match = passing()
    match.mode(0, PlayMode.KICK_IN_L, 4)
    return match


def test_a_restart_by_hand() -> None:
    counts, when = restarts(of_made(kick_in()))
    kind = [name for _, name, _ in RESTART_KINDS].index("kick-in")
    assert counts.sum() == counts[kind, 0, 6, 8] == 1
    assert when[kind, 0, 6, 8].tolist() == [103, 0]
    assert restarts(of_made(kick_in(), side=-1))[0].sum() == 0


def test_balls_of_the_goalkeeper_by_hand() -> None:
    match = MadeMatch(40)
    match.ball(0, -48, 0)
    match.stand(LEFT_1, -48, 0)
    match.stand(LEFT_7, -10, 20)
    match.kick(2, LEFT_1)
    match.ball(14, -10, 20)
    match.kick(14, LEFT_7)
    found = keeper(of_made(match))
    assert found == {"long": (1, 1), "lost": (0, 1), "left": (0, 1), "right": (1, 1)}
    assert set(keeper(of_made(match, side=-1)).values()) == {(0, 0)}


@pytest.fixture(scope="module")
def match(samples_dir: Path) -> Match:
    return read_match(next(samples_dir.glob("*Cyrus2DBase_0-vs-HELIOS_base*.rcg.xz")))


@pytest.fixture(scope="module")
def seen(match: Match) -> Seen:
    events = find_events(match.frames, match.players, match.game.server_params)
    return Seen.of(match.frames, match.players, events, side=-1, params=match.game.server_params, match_id="real")


def test_every_action_is_the_answer_of_one_decision(seen: Seen) -> None:
    """But those of tackles, which are no kicks, and those that end a hold."""
    made = decisions(seen)
    kicked = set(zip(*(seen.pick(EventKind.KICK)[name].tolist() for name in ("frame", "unum")), strict=True))
    for kind, answers in (
        (EventKind.PASS, [*range(11), LOST_PASS]),
        (EventKind.DRIBBLE, [DRIBBLE]),
        (EventKind.SHOT, [SHOT]),
        (EventKind.CLEARANCE, [CLEARANCE]),
    ):
        events = seen.pick(kind)
        rows = zip(events["frame"].tolist(), events["unum"].tolist(), events["outcome"].tolist(), strict=True)
        n = sum((frame, unum) in kicked and outcome != "restart" for frame, unum, outcome in rows)
        assert n - (made.answer == HOLD).sum() <= np.isin(made.answer, answers).sum() <= n, kind


def test_receivers_and_places_by_a_plain_walk(match: Match, seen: Seen) -> None:
    """Completed passes of one kick, straight from the events; third and lane by the numbers of the pitch."""
    made = decisions(seen)
    passes = seen.pick(EventKind.PASS, "completed")
    found = {(frame, number): at for at, (frame, number) in enumerate(zip(made.frame, made.cell[0], strict=True))}
    walked = 0
    for at, (frame, unum) in enumerate(zip(passes["frame"].tolist(), passes["unum"].tolist(), strict=True)):
        if (frame, unum - 1) not in found:
            continue
        one, x, y = found[frame, unum - 1], -match.frames["ball_x"][frame], -match.frames["ball_y"][frame]
        assert made.answer[one] == passes["other_unum"][at] - 1
        assert made.cell[1, one] == (0 if x <= -17.5 else 1 if x <= 17.5 else 2)
        assert made.cell[2, one] == (0 if y <= -20.16 else 1 if y <= 20.16 else 2)
        walked += 1
    assert walked > len(passes["frame"]) / 3


def test_restarts_are_those_of_the_log(match: Match, seen: Seen) -> None:
    passes = find_events(match.frames, match.players, match.game.server_params)
    ours = (passes["kind"] == "pass") & (passes["side"] == -1) & (passes["outcome"] != "restart")
    ours &= (RESTARTS[passes["playmode"]] == -1) & (passes["playmode"] != PlayMode.PLAY_ON)
    counts, _ = restarts(seen)
    assert counts.sum() == ours.sum() > 0
    received = ours & (passes["other_side"] == -1) & (passes["other_unum"] > 0)
    assert counts[..., :NOBODY].sum() == received.sum()


def test_it_tells_habits_with_moments_of_shown_matches() -> None:
    looks = []
    for at in range(4):
        look = habits.look(of_made(passing()))
        look.arrays["counts"][6, 1, 0, 0, 8] += 9 + at
        looks.append(look)
    subject = of_looks(habits, looks)
    subject.own[habits.KEY].shown = frozenset({"m1", "m3"})
    findings = habits.tell(subject)
    (habit,) = (one for one in findings.claims if "7 passes to 9" in one.text)
    assert habit.text.startswith("On the left of the middle third, 7 passes to 9: 100 %")
    assert "of the 46 times in 4 matches that it lets the ball go there" in habit.text
    assert [(one.match_id, one.cycle) for one in habit.moments] == [("m3", 102), ("m1", 102)]
    for picture in findings.pictures:
        picture.draw()
    assert not any("goalkeeper" in one.text for one in findings.claims)
    assert [row[0] for table in findings.tables if table.name == "predictability" for row in table.rows] == [
        "Made {team}",
        "Other",
    ]


def test_a_real_match_alone_can_be_told(seen: Seen) -> None:
    look = habits.look(seen)
    alone, twice = (habits.tell(of_looks(habits, [look] * n)) for n in (1, 2))
    # Nothing is foreseen of the only match; two tell of each other.
    assert "foreseen" not in {one.name for one in alone.pictures}
    assert "foreseen" in {one.name for one in twice.pictures}
    assert not any("foresees" in one.text for one in alone.claims)
    for picture in (*alone.pictures, *twice.pictures):
        picture.draw()


def test_nothing_happens_and_nothing_breaks() -> None:
    nowhere = MadeMatch(5)
    nowhere.players["state"][:] = 0
    nowhere.frames["ball_x"][:] = np.nan
    nowhere.players["x"][:] = np.nan
    lost = passing()
    lost.frames["ball_y"][:] = np.nan
    for match in (MadeMatch(1), nowhere, lost):
        look = habits.look(of_made(match))
        assert not look.arrays["counts"].any()
        assert habits.tell(of_looks(habits, [look])).notes
