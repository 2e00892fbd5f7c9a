"""The events of real matches against a count by another algorithm, a plain walk over the frames."""

from __future__ import annotations

from pathlib import Path

from made_match import rows
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
