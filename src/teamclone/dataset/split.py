"""The split into training, validation and test: whole matches, by hash, stratified by opponent."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset.layout import Split

PAPER_TRAIN_SHARE = 0.95
"""The paper trains on 95 % of the rows and shares the rest between validation and test."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchKey:
    """A match, for splitting; one between two teams that are both modelled has a key of each."""

    match_id: str
    opponent: str
    team: str = ""


def split_matches(
    matches: Sequence[MatchKey],
    *,
    unseen: Sequence[str] = (),
    fixed: Mapping[str, Split] | None = None,
    validation: float = 0.15,
    test: float = 0.15,
    seed: int = 0,
) -> dict[str, Split]:
    """Return the split of each match id.

    Within each opponent the matches are ordered by a hash of seed and match id, so the answer depends on nothing but
    the set of matches. Test and validation get their share of all matches; opponents take turns by how much of their
    own share they still lack. An opponent keeps at least one training match.

    With several teams the same is done within each pairing. Where no pairing has a match to spare, as in a tournament
    in which all meet once, one is taken whose teams have others to train on.

    Args:
        unseen: opponents of which every match is UNSEEN.
        fixed: matches whose split is given; they count towards their split's share.
        validation, test: share of the seen matches; at least one match each where there are three or more.
    """
    fixed = fixed or {}
    teams: dict[str, set[str]] = {}
    for match in matches:
        teams.setdefault(match.match_id, set()).add(match.team)
    several = len(set().union(*teams.values())) > 1
    groups = {
        match.match_id: " - ".join(sorted((match.team, match.opponent))) if several else match.opponent
        for match in matches
    }
    chosen = {match.match_id: Split.UNSEEN for match in matches if match.opponent in unseen}
    seen = [match_id for match_id in groups if match_id not in chosen]
    chosen |= {match_id: fixed[match_id] for match_id in groups if match_id in fixed}
    free: dict[str, list[str]] = {}
    for match_id in sorted(seen, key=lambda match_id: _hash(match_id, seed)):
        if match_id not in chosen:
            free.setdefault(groups[match_id], []).append(match_id)
    size = {group: len(ids) for group, ids in free.items()}
    given = dict.fromkeys(free, 0)
    shares = {}
    for split, share in ((Split.TEST, test), (Split.VALIDATION, validation)):
        already = sum(chosen.get(match_id) is split for match_id in seen)
        want = max(round(share * len(seen)), 1 if len(seen) >= 3 and share > 0 else 0)
        shares[split] = 0 if split in fixed.values() else max(want - already, 0)
    for split in (Split.TEST, Split.VALIDATION):
        for _ in range(shares[split]):
            able = [group for group, ids in free.items() if len(ids) > 1]
            if not able and several:
                left = Counter(team for ids in free.values() for match_id in ids for team in teams[match_id])
                able = [group for group, ids in free.items() if ids and all(left[team] > 1 for team in teams[ids[0]])]
            if not able:
                break
            # The group furthest below its share gives the next match; the hash breaks ties.
            group = min(able, key=lambda name: (given[name] / size[name], _hash(name, seed + int(split))))
            chosen[free[group].pop(0)] = split
            given[group] += 1
    return {match_id: chosen.get(match_id, Split.TRAIN) for match_id in groups}


def split_rows(n: int, *, match_id: str, seed: int = 0) -> NDArray[np.uint8]:
    """Return the paper's split: the rows of a match at random.

    Neighbouring cycles fall into different splits, so it leaks; it is here for comparison.

    Returns:
        (n,) Split values: 95 % TRAIN, the rest halved between VALIDATION and TEST.
    """
    order = np.random.default_rng(int.from_bytes(_hash(match_id, seed))).permutation(n)
    train = round(n * PAPER_TRAIN_SHARE)
    held = (n - train) // 2
    split = np.full(n, Split.TRAIN, np.uint8)
    split[order[train : train + held]] = Split.VALIDATION
    split[order[train + held :]] = Split.TEST
    return split


def _hash(text: str, seed: int) -> bytes:
    return hashlib.blake2b(f"{seed}:{text}".encode(), digest_size=8).digest()
