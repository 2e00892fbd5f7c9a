"""Pictures of real matches: what they count, and which way the teams play."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.patches import FancyArrowPatch

import teamclone as tc
from teamclone.events.definitions import EventKind

TEAM = "HELIOS_base"


@pytest.fixture(autouse=True)
def backend() -> Iterator[None]:
    """No window, and no figure that stays."""
    with mpl.rc_context():
        pyplot.switch_backend("agg")
        yield
        pyplot.close("all")


@pytest.fixture(scope="module")
def left(samples_dir: Path) -> tc.Match:
    """HELIOS_base 8 : 0 WEBase."""
    return tc.read_match(next(samples_dir.glob("*HELIOS_base_8-vs-WEBase_0.rcg.xz")))


@pytest.fixture(scope="module")
def right(samples_dir: Path) -> tc.Match:
    """WEBase 1 : 8 HELIOS_base."""
    return tc.read_match(next(samples_dir.glob("*WEBase_1-vs-HELIOS_base_8.rcg.xz")))


def discs(axes: Any) -> list[tuple[int, float, float]]:
    """Number and place of each player, in the order in which they were drawn."""
    return [(int(one.get_text()), *map(float, one.xy)) for one in axes.texts if one.get_text().isdigit()]


def test_a_named_team_attacks_to_the_right(left: tc.Match, right: tc.Match) -> None:
    for match in (left, right):
        for team in (TEAM, "WEBase"):
            places = discs(tc.plot.formation(match, team=team))
            assert [unum for unum, _, _ in places] == list(range(1, 12))
            assert places[0][1] < -40, "the goalkeeper stands in its own goal"
            assert all(places[0][1] < x for _, x, _ in places[1:])


def test_mean_places_are_those_of_the_log(right: tc.Match) -> None:
    """HELIOS_base is the right team: its places are turned by 180 degrees."""
    play_on = right.frames["playmode"] == 3
    x, y = (-right.players[name][play_on, 11:].astype(float).mean(0) for name in "xy")
    drawn = np.array(discs(tc.plot.formation(right, team=TEAM)))
    np.testing.assert_allclose(drawn[:, 1:], np.stack([x, y], -1), atol=1e-4)
    assert np.array_equal(drawn, discs(tc.plot.formation(right, side="right")))


def test_both_teams_play_as_in_the_log(left: tc.Match) -> None:
    axes = tc.plot.formation(left)
    ours, theirs = discs(axes)[:11], discs(axes)[11:]
    assert ours[0][1] < -40
    assert theirs[0][1] > 40
    assert [one.get_text() for one in axes.get_legend().get_texts()] == [TEAM, "WEBase"]
    np.testing.assert_allclose(ours, discs(tc.plot.formation(left, team=TEAM)))
    turned = np.array(discs(tc.plot.formation(left, team="WEBase"))) * (1, -1, -1)
    np.testing.assert_allclose(theirs, turned)


def cycles(axes: Any) -> int:
    """How many cycles a title speaks of."""
    return int(axes.get_title("left").partition(" cycles")[0].rpartition(" ")[2].replace(",", ""))


def test_phases_are_parts_of_the_match(right: tc.Match) -> None:
    """Each cycle of play_on is one of the team with the ball, of the other one, or of nobody yet."""
    parts = {phase: cycles(tc.plot.formation(right, team=TEAM, with_ball=phase)) for phase in (True, False, None)}
    assert parts[None] == (right.frames["playmode"] == 3).sum()
    spells = tc.match_events(right).select(kinds=[EventKind.POSSESSION]).columns
    length = spells["end_frame"] - spells["frame"]
    assert parts[True] == length[spells["side"] == -1].sum()
    assert parts[False] == length[spells["side"] == 1].sum()
    halves = [tc.plot.formation(right, team=TEAM, ball=half) for half in ("own half", "other half")]
    assert sum(map(cycles, halves)) == parts[None]
    behind, ahead = (np.mean([x for _, x, _ in discs(axes)]) for axes in halves)
    assert behind < ahead - 10, "who has the ball in the own half stands farther back"


def test_several_matches_are_taken_together(left: tc.Match, right: tc.Match) -> None:
    together = tc.plot.formation([left, right], team=TEAM)
    assert cycles(together) == sum((match.frames["playmode"] == 3).sum() for match in (left, right))
    assert together.get_title("left").endswith("2 matches")


@pytest.mark.parametrize("given", ["match", "events", "path"])
def test_a_pass_network_has_the_passes_of_the_events(right: tc.Match, given: str) -> None:
    events = tc.match_events(right)
    axes = tc.plot.pass_network({"match": right, "events": events, "path": right.rcg_path}[given], team=TEAM)
    rows = [
        (one["unum"], one["other_unum"], -one["x"], -one["y"])
        for one in events.to_arrow().to_pylist()
        if (one["kind"], one["outcome"], one["team"]) == ("pass", "completed", TEAM) and one["other_unum"]
    ]
    assert axes.get_title("left") == f"{TEAM}, {len(rows)} completed passes"
    assert sum(isinstance(one, FancyArrowPatch) for one in axes.patches) == len({row[:2] for row in rows})
    assert {unum for unum, _, _ in discs(axes)} == {unum for row in rows for unum in row[:2]}


def test_heat_has_every_cycle_of_a_player(right: tc.Match, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []
    monkeypatch.setattr(tc.plot.maps, "draw_heat", lambda axes, counts, **_: seen.append(counts))
    play_on = right.frames["playmode"] == 3
    tc.plot.heat_map(right, team=TEAM, unum=7)
    x, y = (-right.players[name][play_on, 17] for name in "xy")
    along, across = (np.arange(53) + 0.5) * 105 / 53 - 52.5, (np.arange(34) + 0.5) * 2 - 34
    assert seen[0].sum() == ((np.abs(x) < 52.5) & (np.abs(y) < 34)).sum()
    assert (seen[0].sum(1) @ along) / seen[0].sum() == pytest.approx(x.mean(), abs=0.5)
    assert (seen[0].sum(0) @ across) / seen[0].sum() == pytest.approx(y.mean(), abs=0.5)
    tc.plot.heat_map(right)
    assert (seen[1].sum(1) @ along) / seen[1].sum() == pytest.approx(right.frames["ball_x"][play_on].mean(), abs=0.5)
    events = tc.match_events(right)
    axes = tc.plot.heat_map(events, team=TEAM, kinds=["pass"])
    passes = events.select(kinds=[EventKind.PASS], teams=[TEAM]).columns
    assert axes.get_title("left") == f"{TEAM}: pass, {len(passes['x'])} events"
    assert seen[2].sum() == (np.abs(passes["y"]) <= 34).sum()
    assert (seen[2].sum(1) @ along) / seen[2].sum() == pytest.approx(-passes["x"].mean(), abs=0.5)
    tc.plot.heat_map(events, kinds=["shot", "tackle"])
    assert seen[3].sum() <= sum(events.counts()[kind] for kind in ("shot", "tackle"))
    tc.plot.heat_map(np.array([[0.1, 0.1], [np.nan, 3], [60, 0]]))
    assert seen[4].sum() == seen[4][26, 17] == 1


@pytest.mark.parametrize(("team", "goals"), [(TEAM, 8), ("WEBase", 1)])
def test_a_shot_map_has_the_goals_of_the_score_at_the_right(right: tc.Match, team: str, goals: int) -> None:
    axes = tc.plot.shot_map(right, team=team)
    scored, *others = (one.get_offsets() for one in axes.collections if len(one.get_offsets()))
    assert len(scored) == goals
    assert (np.concatenate([scored, *others])[:, 0] > 52.5 - 36).all()
    expected = getattr(
        tc.match_events(right).statistics(), "left" if right.left.name == team else "right"
    ).expected_goals
    assert f"{expected:.1f} goals expected" in axes.get_title(loc="left")


def test_a_moment_is_the_frame_of_the_log(right: tc.Match) -> None:
    axes = tc.plot.moment(right, cycle=700)
    (at,) = np.flatnonzero(right.frames["cycle"] == 700)
    there = np.stack([right.players["x"][at], right.players["y"][at]], -1)
    np.testing.assert_allclose([place for _, *place in discs(axes)], there, atol=1e-5)
    ball = [right.frames["ball_x"][at], right.frames["ball_y"][at]]
    assert any(np.allclose(one.get_xydata(), [ball]) for one in axes.lines)
    assert axes.get_title("left").startswith("cycle 700, play_on, ")
    stopped = np.flatnonzero(right.frames["stoppage"] == 5)[0]
    again = tc.plot.moment(right.rcg_path, cycle=int(right.frames["cycle"][stopped]), stoppage=5)
    assert "play_on" not in again.get_title("left")


def test_pictures_go_where_they_are_asked_for(left: tc.Match) -> None:
    _, (one, two) = pyplot.subplots(1, 2)
    assert tc.plot.pitch(axes=one) is one
    assert tc.plot.shot_map(left, team=TEAM, axes=two) is two
    own = tc.plot.pitch()
    assert own.figure is not one.figure
    assert own.get_ylim()[0] > own.get_ylim()[1], "y points down the page"


def test_places_can_be_drawn() -> None:
    places = np.array([[-50.0, 0.0], [-10, -20], [np.nan, np.nan], [0, 20]])
    assert discs(tc.plot.formation(places)) == [(1, -50, 0), (2, -10, -20), (4, 0, 20)]


def test_names_are_no_formulas(left: tc.Match) -> None:
    named = replace(left, game=replace(left.game, left=replace(left.left, name="$\\frac{$")))
    for axes in (tc.plot.formation(named), tc.plot.formation(named, side="left"), tc.plot.moment(named, cycle=1)):
        axes.figure.canvas.draw()


def test_a_fan_is_that_of_a_roll_out() -> None:
    fan = {"cycle": 7, "ahead": 2, "others": [], "bodies": [{"of": 3, "truth": [[0, 0]], "samples": [[[0, 0]]] * 4}]}
    axes = tc.plot.fan(fan)
    assert axes.get_title("left") == "cycle 7, 2 cycles ahead"


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda match: tc.plot.formation(match, team="HELIOS"), "no team 'HELIOS'; did you mean HELIOS_base"),
        (tc.plot.pass_network, "name either a team"),
        (tc.plot.shot_map, "name either a team"),
        (lambda match: tc.plot.formation([match, match]), "expected one match, or a team of these 2"),
        (lambda match: tc.plot.formation(tc.match_events(match), team=TEAM), "got its events"),
        (lambda match: tc.plot.formation(match, team=TEAM, ball="left"), "expected the ball in the own half"),
        (lambda match: tc.plot.heat_map(match, team=TEAM, kinds=["passes"]), "did you mean pass"),
        (lambda match: tc.plot.heat_map(match, team=TEAM, unum=12), "from 1 to 11 and its team, got 12"),
        (lambda match: tc.plot.heat_map(match, unum=7), "from 1 to 11 and its team, got 7"),
        (lambda match: tc.plot.moment(match, cycle=9999), "no frame of cycle 9999, stoppage 0; its cycles: 1 to 2000"),
    ],
)
def test_what_cannot_be_drawn(left: tc.Match, draw: Any, message: str) -> None:
    with pytest.raises(tc.TeamcloneError, match=message):
        draw(left)
    assert not pyplot.get_fignums(), "no empty figure is left"


def test_without_matplotlib_it_says_what_to_install() -> None:
    code = (
        "import sys; sys.modules['matplotlib'] = None; import teamclone as tc\n"
        "try: tc.plot\nexcept tc.TeamcloneError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "tc.plot needs matplotlib: pip install 'teamclone[report]'\n"
