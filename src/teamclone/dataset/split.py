"""Which match is for training, validation and test: whole matches, by hash, stratified by opponent."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset.layout import Split

PAPER_TRAIN_SHARE = 0.95
"""The paper trains on 95 % of the rows and shares the rest between validation and test."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchKey:
    """What splitting knows of a match."""

    match_id: str
    opponent: str


def split_matches(
    matches: Sequence[MatchKey],
    *,
    unseen: Sequence[str] = (),
    fixed: Mapping[str, Split] | None = None,
    validation: float = 0.15,
    test: float = 0.15,
    seed: int = 0,
) -> dict[str, Split]:
    """The split of each match id.

    Within each opponent the matches are ordered by a hash of seed and match id, so the answer depends on nothing but
    the set of matches. Test and validation get their share of all matches; opponents take turns by how much of their
    own share they still lack. An opponent keeps at least one training match.

    Args:
        unseen: opponents of which every match is UNSEEN.
        fixed: matches whose split is given; they count towards their split's share.
        validation, test: share of the seen matches; at least one match each where there are three or more.
    """
    fixed = fixed or {}
    chosen = {match.match_id: Split.UNSEEN for match in matches if match.opponent in unseen}
    chosen |= {match.match_id: fixed[match.match_id] for match in matches if match.match_id in fixed}
    seen = [match for match in matches if match.opponent not in unseen]
    free: dict[str, list[str]] = {}
    for match in sorted(seen, key=lambda match: _hash(match.match_id, seed)):
        if match.match_id not in chosen:
            free.setdefault(match.opponent, []).append(match.match_id)
    size = {opponent: len(ids) for opponent, ids in free.items()}
    given = dict.fromkeys(free, 0)
    shares = {}
    for split, share in ((Split.TEST, test), (Split.VALIDATION, validation)):
        already = sum(chosen.get(match.match_id) is split for match in seen)
        want = max(round(share * len(seen)), 1 if len(seen) >= 3 and share > 0 else 0)
        shares[split] = 0 if split in fixed.values() else max(want - already, 0)
    for split in (Split.TEST, Split.VALIDATION):
        for _ in range(shares[split]):
            able = [opponent for opponent, ids in free.items() if len(ids) > 1]
            if not able:
                break
            # The opponent furthest below its share gives the next match; the hash breaks ties.
            opponent = min(able, key=lambda name: (given[name] / size[name], _hash(name, seed + int(split))))
            chosen[free[opponent].pop(0)] = split
            given[opponent] += 1
    return {match.match_id: chosen.get(match.match_id, Split.TRAIN) for match in matches}


def split_rows(n: int, *, match_id: str, seed: int = 0) -> NDArray[np.uint8]:
    """The paper's split: the rows of a match at random, neighbouring cycles on both sides. For comparison: it leaks.

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
