"""What players are sent: against what four of them wrote down on a real server, and in made situations."""

from __future__ import annotations

import lzma
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from looking import DATA, situation
from teamclone.errors import LogError
from teamclone.logs import Match, read_match
from teamclone.logs.match import Columns
from teamclone.percepts.agreement import Agreement, agreement
from teamclone.percepts.offline_log import OfflineLog, read_offline_log
from teamclone.percepts.sight import BALL, HIDDEN, N_OBJECTS, NEAR, SEEN, Sight, messages, sight
from teamclone.rcss.players import N_PLAYERS

LOGS = {path.name.split(".")[0]: path for path in DATA.glob("*.ocl.xz")}
TEAMS = ("helios_L", "helios_R")


@pytest.fixture(scope="module")
def match() -> Match:
    return read_match(next(DATA.glob("*.rcg.xz")))


@pytest.fixture(scope="module")
def seen(match: Match) -> Sight:
    return sight(match.game.frames, match.game.players, match.game.server_params)


@pytest.fixture(scope="module")
def logs() -> dict[str, OfflineLog]:
    return {name: read_offline_log(path) for name, path in LOGS.items()}


def test_messages_are_those_that_players_wrote_down(match: Match, seen: Sight, logs: dict[str, OfflineLog]) -> None:
    of_all = [agreement(match.game.frames, TEAMS, seen, log) for log in logs.values()]
    total = sum(of_all, Agreement())
    shares = total.shares()
    assert total.same_cycles == total.cycles > 500
    assert total.shown > 3000
    assert total.changes > 1500
    assert shares["shown"] > 0.999
    assert shares["distance"] > 0.999
    assert shares["direction"] > 0.999
    assert shares["distance_change"] > 0.998  # a velocity in the log has four digits
    assert shares["direction_change"] > 0.997


def test_of_the_cycles_before_a_narrow_look_messages_are_a_guess(match: Match, seen: Sight) -> None:
    first_narrow = np.argmax(match.game.players["view_width"] < 61, axis=0)
    for player in range(N_PLAYERS):
        assert not seen.sure[: first_narrow[player], player].any()
    assert 0.5 < seen.sure.mean() < 1


def shown(frames: Columns, players: Columns) -> Sight:
    return sight(frames, players, {})


@pytest.mark.parametrize(
    ("x", "y", "what"),
    [
        (10.0, 0.0, SEEN),
        (10.0, 5.7, SEEN),  # 29.7 degrees, of a cone of 60
        (10.0, 5.85, HIDDEN),  # 30.3 degrees
        (-2.9, 0.0, NEAR),
        (-3.1, 0.0, HIDDEN),
        (0.5, -2.9, NEAR),
        (60.0, 0.0, SEEN),
    ],
)
def test_what_is_shown_follows_from_the_view_cone_and_from_nearness(x: float, y: float, what: int) -> None:
    frames, players = situation()
    frames["ball_x"][:], frames["ball_y"][:] = x, y
    assert shown(frames, players).what[0, 0, BALL] == what


def test_neck_and_body_both_turn_the_view_cone() -> None:
    frames, players = situation(body=120.0, neck=-90.0)
    frames["ball_x"][:], frames["ball_y"][:] = 8.66, 5.0  # 30 degrees
    seen = shown(frames, players)
    assert seen.what[0, 0, BALL] == SEEN
    assert seen.direction[0, 0, BALL] == 0


def test_distances_are_on_the_grid_of_the_server() -> None:
    frames, players = situation()
    frames["ball_x"][:] = 20.0
    # ln 20 = 2.996, in steps of 0.1 3.0: e^3 = 20.09.
    assert shown(frames, players).distance[0, 0, BALL] == pytest.approx(20.1)
    frames["ball_x"][:] = 21.0  # e^3 again
    assert shown(frames, players).distance[0, 0, BALL] == pytest.approx(20.1)


def test_looking_at_an_object_halves_the_error() -> None:
    frames, players = situation(focus_distance=21.0)
    frames["ball_x"][:] = 21.0
    # The error of the distance to the focus point is nearly none: half of that from 21 to 20.09 is left.
    assert shown(frames, players).distance[0, 0, BALL] == pytest.approx(20.5)


def test_changes_are_of_the_motion_against_the_player() -> None:
    frames, players = situation(vx=0.4, vy=0.1)
    frames["ball_x"][:], frames["ball_vx"][:], frames["ball_vy"][:] = 10.0, 1.4, 0.6
    seen = shown(frames, players)
    assert seen.distance[0, 0, BALL] == pytest.approx(10.0)
    assert seen.change[0, 0, BALL] == pytest.approx([1.0, 2.9])  # away; 0.5 m aside at 10 m are 2.86 degrees


def test_nobody_sees_itself_nor_who_is_not_on_the_field() -> None:
    frames, players = situation()
    players["x"][0, 1], players["y"][0, 1] = 5.0, 0.0
    assert shown(frames, players).what[0, 0, 1] == SEEN
    players["state"][0, 1] = 0
    seen = shown(frames, players)
    assert seen.what[0, 0, 1] == HIDDEN
    assert not seen.received[0, 1]
    assert (seen.what[0, range(N_PLAYERS), range(N_PLAYERS)] == HIDDEN).all()


@pytest.mark.parametrize(("width", "every"), [(60.0, 1), (120.0, 2), (180.0, 3)])
def test_a_wider_view_has_fewer_messages(width: float, every: int) -> None:
    widths = np.full((30, 1), width)
    widths[:3] = 60.0
    received, sure = messages(widths, np.ones((30, 1), np.bool_), np.ones(29, np.bool_))
    assert np.flatnonzero(received[:, 0])[3:].tolist() == list(range(2 + every, 30, every))
    assert sure.all()


def test_after_lost_cycles_a_message_is_due_and_not_sure() -> None:
    followed = np.ones(9, np.bool_)
    followed[4] = False
    widths = np.full((10, 1), 180.0)
    widths[0] = 60.0
    received, sure = messages(widths, np.ones((10, 1), np.bool_), followed)
    assert np.flatnonzero(received[:, 0]).tolist() == [0, 3, 5, 8]
    assert sure[:, 0].tolist() == [True] * 5 + [False] * 5


def test_what_is_not_shown_has_no_numbers(seen: Sight) -> None:
    hidden = seen.what == HIDDEN
    assert np.isnan(seen.distance[hidden]).all()
    assert np.isnan(seen.change[seen.what != SEEN]).all()
    assert not np.isnan(seen.distance[~hidden]).any()
    assert (seen.what[~seen.received] == HIDDEN).all()
    assert seen.what.shape[2] == N_OBJECTS


def test_a_log_that_was_cut_off_counts_as_far_as_it_goes(tmp_path: Path, logs: dict[str, OfflineLog]) -> None:
    content = lzma.decompress(LOGS["helios_L-7"].read_bytes())
    cut = tmp_path / "cut.ocl"
    cut.write_bytes(content[: len(content) // 2])
    half, whole = read_offline_log(cut), logs["helios_L-7"]
    n = len(half.cycle)
    assert 50 < n < len(whole.cycle)
    assert (half.cycle == whole.cycle[:n]).all()
    assert (half.received[:-1] == whole.received[: n - 1]).all()
    assert (half.side, half.unum) == (1, 7)


@pytest.mark.parametrize(
    "content",
    [
        b"\x00\xff" * 100,
        b"(init l 7 before_kick_off)\n",
        b"(init l 99 before_kick_off)\n(sense_body 1 )\n",
        b"(init l 0 before_kick_off)\n(sense_body 1 )\n",
        b"(sense_body 1 (view_mode high wide))\n(see 1 ((b) 1 2))\n",
        b"(init l 7 before_kick_off)\n(sense_body 99999999999999999999 )\n(see 1 ((b) 1 2))\n",
    ],
)
def test_what_is_no_such_log_is_refused_with_its_name(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "odd.ocl"
    path.write_bytes(content)
    with pytest.raises(LogError, match=r"odd\.ocl"):
        read_offline_log(path)


def test_odd_objects_are_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "odd.ocl"
    path.write_bytes(
        b"(init r 3 play_on)\n(sense_body 5 )\n"
        b'(see 5 ((b) 1.2.3 4) ((p "a b" 300) 1 2) ((p "T" 99) 5.5 -3) ((P) 1.1 90) ((b) 1e9999 3) ((B) 2 -170)((p'
    )
    log = read_offline_log(path)
    assert log.objects.unum.tolist() == [99, 0, 0]
    assert log.objects.ball.tolist() == [False, False, True]
    assert log.objects.near.tolist() == [False, True, True]
    assert log.objects.teams == ("T",)


def test_logs_of_another_match_are_told(match: Match, seen: Sight, logs: dict[str, OfflineLog]) -> None:
    with pytest.raises(LogError, match=r"helios_R.*Hamburg and Bremen"):
        agreement(match.game.frames, ("Hamburg", "Bremen"), seen, logs["helios_L-7"])
    late = {name: match.game.frames[name] + 5000 for name in ("cycle", "stoppage")}
    with pytest.raises(LogError, match="player 7 has no cycle"):
        agreement(late, TEAMS, seen, logs["helios_L-7"])


def test_a_wrong_number_is_found(match: Match, seen: Sight, logs: dict[str, OfflineLog]) -> None:
    """The comparison itself: of a player that is taken for another one little agrees."""
    log = logs["helios_L-7"]
    shares = agreement(match.game.frames, TEAMS, seen, replace(log, unum=8)).shares()
    assert shares["shown"] < 0.6
    assert shares["direction"] < 0.2
