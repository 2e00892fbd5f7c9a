"""The events of real matches against a count by another algorithm, a plain walk over the frames."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np

from made_match import PARAMS, MadeMatch, rows
from plain_events import PlainEvents
from teamclone.events.definitions import EventKind
from teamclone.events.find import find_events
from teamclone.logs import find_matches, read_pair

FIXTURES = Path(__file__).resolve().parents[2] / "data" / "fixtures"
BY_WORDS = {EventKind.FOUL, EventKind.OFFSIDE, EventKind.CARD, EventKind.PLAYER, EventKind.PERIOD}
"""Kinds that a plain walk could only read off again."""


def test_a_plain_walk_finds_the_same(samples_dir: Path) -> None:
    """In every version of the logs, in shoot-outs, with one team and with odd numbers."""
    seen: set[str] = set()
    matches = 0
    for pair in find_matches([samples_dir, FIXTURES]):
        match = read_pair(pair)
        if not len(match.frames["cycle"]):
            continue
        found = rows(find_events(match.frames, match.players, match.game.server_params))
        found = sorted(row for row in found if row[0] not in BY_WORDS)
        assert found == PlainEvents(match).rows(), pair.path.name
        seen |= {row[0] for row in found}
        matches += 1
    assert matches > 20
    assert seen == set(EventKind) - BY_WORDS


def test_it_does_so_in_matches_of_noise() -> None:
    """Bits, modes and places as no match has them, unknown modes among them; nothing of it is an error or a warning."""
    rng = np.random.default_rng(0)
    seen: set[str] = set()
    for _ in range(150):
        n = int(rng.integers(1, 60))
        made = MadeMatch(n)
        state = made.players["state"]
        for bit, share in ((0x1, 0.1), (0x2, 0.04), (0x1000, 0.02), (0x2000, 0.01), (0x8, 0.3), (0x4, 0.01)):
            np.copyto(state, state | bit if bit != 0x1 else state & ~np.uint32(1), where=rng.random((n, 22)) < share)
        caught = np.flatnonzero(rng.random(n) < 0.1)  # by one player at once: there is one ball
        state[caught, rng.integers(0, 22, len(caught))] |= 0x10
        for start in rng.integers(0, n, int(rng.integers(0, 6))):
            made.frames["playmode"][start : start + int(rng.integers(1, 12))] = rng.integers(0, 60)
        for name in ("ball_x", "ball_y"):
            made.frames[name][:] = np.cumsum(rng.normal(0, 1.5, n))
        made.players["x"][:], made.players["y"][:] = rng.uniform(-34, 34, (2, n, 22))
        made.players["count_dash"][:] = np.cumsum(rng.random((n, 22)) < 0.5, axis=0)
        events = made.events()
        found = sorted(row for row in rows(events) if row[0] not in BY_WORDS)
        game = SimpleNamespace(server_params=PARAMS)
        assert found == PlainEvents(SimpleNamespace(frames=made.frames, players=made.players, game=game)).rows()
        seen |= set(events["kind"].tolist())
    assert {"pass", "interception", "multi touch", "tackle", "catch", "possession", "foul", "set play"} <= seen
