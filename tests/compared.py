"""Stores of short pieces of the sample matches, for comparisons: no two alike, with a shift on request."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

from teamclone.logs import Match, read_match
from teamclone.rcss.players import TEAM_SLOTS
from teamclone.store import create_store
from teamclone.store.store import Store
from teamclone.system.files import digest

TEAM = "HELIOS_base"


def variant(match: Match, number: int, *, shift: float = 0.0, opponent: str | None = None) -> Match:
    """Return 200 frames of a match as one of its own, the team moved by metres across the pitch.

    Its opponent may get another name.
    """
    game, part = match.game, slice(60 + 200 * number, 260 + 200 * number)
    players = {name: values[part].copy() for name, values in game.players.items()}
    left = game.left.name == TEAM
    players["y"][:, TEAM_SLOTS[0 if left else 1]] += shift if left else -shift
    made = replace(game, frames={name: values[part] for name, values in game.frames.items()}, players=players)
    if opponent is not None:
        other = replace(made.right if left else made.left, name=opponent)
        made = replace(made, right=other) if left else replace(made, left=other)
    return replace(match, match_id=digest(f"{match.match_id} {number} {shift}".encode()), game=made, log=None)


def made_store(folder: Path, matches: Iterable[Match]) -> Store:
    """Return a store with these matches."""
    store = create_store(folder)
    with store.writing():
        for match in matches:
            store.add(match)
    return store


def samples(folder: Path, *opponents: str) -> list[Match]:
    """Return the sample matches against some opponents."""
    return [read_match(path) for name in opponents for path in sorted(folder.glob(f"*{name}*.rcg.xz"))]
