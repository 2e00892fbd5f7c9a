"""Who gets tired when, who gets which type, who is substituted: by hand and against the log."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from made_match import PARAMS, MadeMatch
from scouted import of_looks, of_made
from teamclone.events.find import find_events
from teamclone.logs import Match, read_match
from teamclone.logs.match import default_player_types
from teamclone.rcss import state_bits
from teamclone.rcss.playmodes import PlayMode
from teamclone.scout.sections import stamina
from teamclone.scout.seen import Seen


def tired() -> MadeMatch:
    """Cycles 2700 to 2719: numbers 2 to 4 of ten field players have no stamina from 2710 on; 11 runs 0.5 m a cycle."""
    match = MadeMatch(20)
    match.frames["cycle"] += 2600
    match.players["stamina"][:] = 4000
    match.players["stamina"][10:, [1, 2, 3]] = 50
    match.players["capacity"][:] = 13060
    match.players["x"][:, :11] = np.linspace(-45, 5, 11)
    match.players["x"][:, 10] += 0.5 * np.arange(20)
    return match


def test_tired_players_by_hand() -> None:
    look = stamina.look(of_made(tired()))
    assert look.numbers["stamina_empty_first"] == (30, 200)
    assert look.numbers["stamina_empty_second"] == (0, 0)
    # The hindmost four field players are 2 to 5.
    assert look.numbers["stamina_empty_last"] == (30, 80)
    assert look.numbers["stamina_empty_front"] == (0, 60)
    assert look.numbers["stamina_late"] == (pytest.approx(170 * 0.5 + 30 * 50 / 8000), 200)
    assert look.numbers["stamina_before"] == (0, 0)
    assert look.numbers["stamina_many_empty"] == (2710, 1)
    assert look.numbers["stamina_halves"] == (1, 1)
    (moment,) = look.moments["stamina_many_empty"]
    assert (moment.cycle, moment.unum, moment.text) == (2710, 2, "3 of its players are empty")
    assert look.arrays["capacity"][4].tolist() == [pytest.approx(0.1), 1]


def test_pace_is_of_field_players_in_consecutive_cycles_of_play() -> None:
    match = tired()
    assert stamina.look(of_made(match)).numbers["stamina_pace_late"] == (pytest.approx(19 * 0.5), 190)
    match.mode(10, PlayMode.KICK_IN_L)
    assert stamina.look(of_made(match)).numbers["stamina_pace_late"] == (pytest.approx(9 * 0.5), 90)
    match = tired()
    match.frames["cycle"][10:] += 5
    assert stamina.look(of_made(match)).numbers["stamina_pace_late"] == (pytest.approx(18 * 0.5), 180)


def test_the_other_team_is_asked_as_well() -> None:
    look = stamina.look(of_made(tired(), side=-1))
    assert look.numbers["stamina_late"] == (100, 200)
    assert look.numbers["stamina_pace_late"] == (0, 190)


def test_types_by_rank() -> None:
    """Number n has type n; types accelerate better and kick less precisely, the higher their number."""
    types = default_player_types(12)
    types["dash_power_rate"] = np.linspace(0.005, 0.006, 12)
    types["kick_rand"] = np.linspace(0.0, 0.2, 12)
    types["player_speed_max"] = np.full(12, 9.0)
    match = tired()
    match.players["type"][:, :11] = np.arange(1, 12)
    look = stamina.look(of_made(match, types=types))
    ranks = look.arrays["types"]
    names = [key for key, *_ in stamina.TRAITS.values()]
    expected = np.arange(1, 12) / 11
    np.testing.assert_allclose(ranks[:, names.index("acceleration")], expected)
    np.testing.assert_allclose(ranks[:, names.index("speed")], expected)
    np.testing.assert_allclose(ranks[:, names.index("precision")], 1 - expected)
    np.testing.assert_allclose(ranks[:, names.index("reach")], 0.5)
    assert look.numbers["stamina_types_acceleration"] == (pytest.approx(expected[1:].sum()), 10)
    said = [one.text for one in stamina.tell(of_looks(stamina, [look] * 3)).claims if "types" in one.text]
    assert said == [
        "8, 9, 10 and 11 get the fastest types: 86 % (86 to 86) of the others are worse.",
        "8, 9, 10 and 11 get the quickest off the mark types: 86 % (86 to 86) of the others are worse.",
        "8, 9, 10 and 11 get the least precise types: 86 % (86 to 86) of the others are better.",
    ]
    assert not stamina.tell(of_looks(stamina, [look] * 3)).notes
    # Two matches may be chance.
    assert not any("types" in one.text for one in stamina.tell(of_looks(stamina, [look] * 2)).claims)


def test_a_team_that_does_not_choose_types_is_named() -> None:
    """Every number has the same type, and so none a better one than the others."""
    look = stamina.look(of_made(tired(), types=default_player_types(12)))
    (note,) = stamina.tell(of_looks(stamina, [look] * 3)).notes
    assert note.startswith("No number regularly gets better or worse types")


def test_a_substitution_is_a_change_of_type_during_the_match() -> None:
    match = tired()
    match.players["type"][5:, 6] = 3
    look = stamina.look(of_made(match))
    assert look.arrays["substituted"].tolist() == [[7, pytest.approx(2705 / 6000)]]
    assert [(one.text, one.cycle) for one in look.moments["stamina_substitutions"]] == [("7 is substituted", 2705)]
    match.frames["cycle"][:] = 0
    assert not len(stamina.look(of_made(match)).arrays["substituted"])


@pytest.fixture(scope="module")
def match(samples_dir: Path) -> Match:
    return read_match(next(samples_dir.glob("*Cyrus2DBase_0-vs-HELIOS_base*.rcg.xz")))


def test_stamina_and_pace_by_a_plain_walk(match: Match) -> None:
    """The right team's field players in the last quarter of halves, straight from the log's columns."""
    frames, players, params = match.frames, match.players, match.game.server_params
    seen = Seen.of(
        frames,
        players,
        find_events(frames, players, params),
        side=-1,
        types=match.game.player_types,
        params=params,
    )
    cycles = 2 * float(params["half_time"]) * 10
    stands, empty, way = [], 0, []
    keeper = [slot for slot in range(11, 22) if (players["state"][:, slot] & state_bits.GOALIE).any()]
    assert len(keeper) == 1
    for frame in np.flatnonzero(frames["playmode"] == PlayMode.PLAY_ON).tolist():
        half = frames["cycle"][frame] / cycles * 2
        if half >= 2 or half % 1 < 0.75:
            continue
        for slot in range(11, 22):
            if slot in keeper or not players["state"][frame, slot] & state_bits.STAND:
                continue
            stands.append(players["stamina"][frame, slot] / 8000)
            empty += players["stamina"][frame, slot] < 100
            after = frame + 1
            if after < len(frames["cycle"]) and frames["playmode"][after] == PlayMode.PLAY_ON:
                way.append(np.hypot(*(players[name][after, slot] - players[name][frame, slot] for name in "xy")))
    look = stamina.look(seen)
    assert look.numbers["stamina_late"] == (pytest.approx(np.sum(stands)), len(stands))
    assert look.numbers["stamina_empty"] == (empty, len(stands))
    assert look.numbers["stamina_pace_late"] == (pytest.approx(np.sum(way), rel=1e-4), len(way))
    findings = stamina.tell(of_looks(stamina, [look]))
    assert findings.claims
    assert not findings.notes
    for picture in findings.pictures:
        picture.draw()


def test_what_the_log_lacks_is_said() -> None:
    bare = MadeMatch(20)
    bare.players["stamina"][:] = np.nan
    found = stamina.tell(of_looks(stamina, [stamina.look(of_made(bare))]))
    assert any("stamina" in note for note in found.notes)
    assert not any("empty" in one.text for one in found.claims)
    early = tired()
    early.frames["cycle"] -= 2600
    notes = stamina.tell(of_looks(stamina, [stamina.look(of_made(early))])).notes
    assert any("last quarter" in note for note in notes)


@pytest.mark.parametrize("half_time", [0.0, -1.0, float("inf")])
def test_nothing_breaks(half_time: float) -> None:
    for frames in (1, 5):
        match = MadeMatch(frames)
        match.players["state"][:] = 0
        for name in ("x", "y"):
            match.players[name][:] = np.nan
        seen = Seen.of(match.frames, match.players, match.events(), side=1, params=PARAMS | {"half_time": half_time})
        look = stamina.look(seen)
        for picture in stamina.tell(of_looks(stamina, [look])).pictures:
            picture.draw()
