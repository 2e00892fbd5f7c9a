"""Matches as a scouted team sees them: made ones, and the samples."""

from __future__ import annotations

from collections.abc import Sequence
from types import ModuleType

from made_match import PARAMS, MadeMatch
from teamclone.events.find import find_events
from teamclone.logs import Match
from teamclone.logs.match import Columns
from teamclone.scout.measures import Look, Looks
from teamclone.scout.seen import Seen, _owned, _turned
from teamclone.scout.subject import Played, Subject
from teamclone.world.view import view_columns


def of_columns(frames: Columns, players: Columns, *, side: int, match_id: str = "made") -> Seen:
    """A match as the team on a side sees it."""
    events = find_events(frames, players, PARAMS)
    return Seen(
        match_id=match_id,
        opponent="Them",
        world=view_columns(frames, players, params=PARAMS, side=side),
        events=_turned(events, side),
        has=_owned(events, side, len(frames["cycle"])),
        cycles=6000,
    )


def of_made(made: MadeMatch, *, side: int = 1) -> Seen:
    """A made match, by default as the left team sees it."""
    return of_columns(made.frames, made.players, side=side)


def of_match(match: Match, *, side: int = 1, frames: slice = slice(None)) -> Seen:
    """Some frames of a match."""
    game = match.game
    return of_columns(
        {name: values[frames] for name, values in game.frames.items()},
        {name: values[frames] for name, values in game.players.items()},
        side=side,
        match_id=match.match_id,
    )


def subject_of(section: ModuleType, pairs: Sequence[tuple[Seen, Seen]]) -> Subject:
    """What a section keeps of matches, as the team and as its opponent see them."""

    def looks(at: int) -> Looks:
        return Looks([section.look(pair[at]) for pair in pairs], section.MEASURES)

    played = [
        Played(match_id=own.match_id, started_at=None, opponent="Them", side=1, score=(0, 0), length=1.0, complete=True)
        for own, _ in pairs
    ]
    return Subject(team="We", played=played, own={section.KEY: looks(0)}, other={section.KEY: looks(1)})


def share(look: Look, key: str) -> float:
    """A measure of one match."""
    part, whole = look.numbers[key]
    return part / whole
