from __future__ import annotations

from collections import Counter
from itertools import combinations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from teamclone.dataset.layout import Split
from teamclone.dataset.split import MatchKey, split_matches, split_rows

keys = st.lists(
    st.builds(MatchKey, match_id=st.uuids().map(str), opponent=st.sampled_from(["A", "B", "C", "D"])),
    max_size=40,
    unique_by=lambda key: key.match_id,
)


@given(keys, st.integers(0, 5), st.randoms())
def test_the_split_depends_on_the_set_of_matches_alone(matches: list[MatchKey], seed: int, random: object) -> None:
    shuffled = matches.copy()
    random.shuffle(shuffled)  # type: ignore[attr-defined]
    assert split_matches(matches, seed=seed) == split_matches(shuffled, seed=seed)


@given(keys)
def test_unseen_opponents_are_apart_and_every_other_keeps_a_training_match(matches: list[MatchKey]) -> None:
    split = split_matches(matches, unseen=["D"])
    for match in matches:
        assert (split[match.match_id] is Split.UNSEEN) == (match.opponent == "D")
    for opponent in {match.opponent for match in matches} - {"D"}:
        assert Split.TRAIN in {split[match.match_id] for match in matches if match.opponent == opponent}


def test_shares_are_kept_and_opponents_take_turns() -> None:
    matches = [MatchKey(match_id=f"{opponent}{index}", opponent=opponent) for opponent in "ABC" for index in range(10)]
    split = split_matches(matches, test=0.2, validation=0.1)
    assert Counter(split.values()) == {Split.TRAIN: 21, Split.TEST: 6, Split.VALIDATION: 3}
    for opponent in "ABC":
        own = Counter(split[match.match_id] for match in matches if match.opponent == opponent)
        assert own == {Split.TRAIN: 7, Split.TEST: 2, Split.VALIDATION: 1}


def test_another_seed_gives_another_split() -> None:
    matches = [MatchKey(match_id=str(index), opponent="A") for index in range(30)]
    assert split_matches(matches, seed=0) != split_matches(matches, seed=1)


def test_fixed_matches_stay_and_fill_their_split() -> None:
    matches = [MatchKey(match_id=str(index), opponent="A") for index in range(10)]
    split = split_matches(matches, fixed={"3": Split.TEST}, test=0.3, validation=0.2)
    assert [key for key, value in split.items() if value is Split.TEST] == ["3"]
    assert Counter(split.values())[Split.VALIDATION] == 2


def met(match_id: str, *pair: str, modelled: str) -> list[MatchKey]:
    """The keys of a match of a pair, of which some teams are modelled."""
    sides = (pair, pair[::-1])
    return [MatchKey(match_id=match_id, team=team, opponent=other) for team, other in sides if team in modelled]


games = st.lists(
    st.tuples(st.uuids().map(str), st.permutations("ABCD").map(lambda names: names[:2])),
    max_size=30,
    unique_by=lambda game: game[0],
)


@given(games, st.integers(0, 5), st.randoms())
def test_with_several_teams_a_match_falls_into_one_split(games: list[tuple], seed: int, random: object) -> None:
    keys = [key for match_id, pair in games for key in met(match_id, *pair, modelled="ABC")]
    split = split_matches(keys, seed=seed, unseen=["C", "D"])
    random.shuffle(keys)  # type: ignore[attr-defined]
    assert split == split_matches(keys, seed=seed, unseen=["C", "D"])
    # Seen from C, a match against A has a known opponent; but it is the match in which A meets the unseen C.
    pairs = {match_id: set(pair) for match_id, pair in games}
    assert {match_id for match_id, value in split.items() if value is Split.UNSEEN} == {
        match_id for match_id in split if pairs[match_id] - {"A", "B"}
    }


def test_pairings_take_turns() -> None:
    pairs = [("A", "B"), ("A", "D"), ("B", "D")]
    keys = [
        key
        for number in range(10)
        for index, pair in enumerate(pairs)
        for key in met(f"{index}-{number}", *pair, modelled="AB")
    ]
    split = split_matches(keys, test=0.2, validation=0.1)
    assert len(split) == 30
    for index in range(len(pairs)):
        own = Counter(value for match_id, value in split.items() if match_id.startswith(f"{index}-"))
        assert own == {Split.TRAIN: 7, Split.TEST: 2, Split.VALIDATION: 1}


def test_a_tournament_in_which_all_meet_once_has_every_split_and_trains_every_team() -> None:
    pairs = list(combinations("ABCDEF", 2))
    for seed in range(20):
        split = split_matches(
            [key for pair in pairs for key in met("".join(pair), *pair, modelled="ABCDEF")], seed=seed
        )
        assert Counter(split.values()) == {Split.TRAIN: 11, Split.TEST: 2, Split.VALIDATION: 2}
        assert {team for pair, value in split.items() if value is Split.TRAIN for team in pair} == set("ABCDEF")
    lone = [key for pair in ("AD", "AE", "BD", "BE") for key in met(pair, *pair, modelled="AB")]
    split = split_matches(lone, test=0.4, validation=0.4)
    assert Counter(split.values()) == {Split.TRAIN: 2, Split.TEST: 2}
    assert {pair[0] for pair, value in split.items() if value is Split.TRAIN} == {"A", "B"}


def test_the_row_split_is_the_papers() -> None:
    split = split_rows(10_000, match_id="a", seed=3)
    assert Counter(split.tolist()) == {Split.TRAIN: 9_500, Split.VALIDATION: 250, Split.TEST: 250}
    # At random: neighbours fall on both sides.
    held = np.flatnonzero(split != Split.TRAIN)
    assert (np.diff(held) > 1).mean() > 0.9
    assert np.array_equal(split, split_rows(10_000, match_id="a", seed=3))
    assert not np.array_equal(split, split_rows(10_000, match_id="b", seed=3))
    assert not np.array_equal(split, split_rows(10_000, match_id="a", seed=4))
