"""Matches as a scouted team sees them: made ones, and the samples."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import ModuleType

from made_match import PARAMS, MadeMatch
from teamclone.events.find import find_events
from teamclone.logs import Match, read_match
from teamclone.logs.match import Columns
from teamclone.plots.page import svg
from teamclone.scout.findings import Findings
from teamclone.scout.measures import Look, Looks
from teamclone.scout.seen import Seen
from teamclone.scout.subject import Played, Subject


def of_made(made: MadeMatch, *, side: int = 1, types: Columns | None = None) -> Seen:
    """A made match, by default as the left team sees it."""
    return Seen.of(made.frames, made.players, made.events(), side=side, types=types, params=PARAMS, match_id="made")


def of_match(match: Match, *, side: int = 1, frames: slice = slice(None)) -> Seen:
    """Some frames of a match."""
    game = match.game
    there, players = ({name: of[frames] for name, of in columns.items()} for columns in (game.frames, game.players))
    return Seen.of(
        there,
        players,
        find_events(there, players, game.server_params),
        side=side,
        types=game.player_types,
        params=game.server_params,
        match_id=match.match_id,
        opponent="Them",
    )


def both_sides(folder: Path, opponent: str, team: str = "HELIOS_base") -> list[tuple[Seen, Seen]]:
    """The sample matches against an opponent, as the team and as its opponent see them."""
    matches = [read_match(path) for path in sorted(folder.glob(f"*{opponent}*.rcg.xz"))]
    sides = [1 if match.left.name == team else -1 for match in matches]
    return [(of_match(match, side=s), of_match(match, side=-s)) for match, s in zip(matches, sides, strict=True)]


def of_looks(
    section: ModuleType, own: Sequence[Look], other: Sequence[Look] | None = None, opponents: Sequence[str] = ()
) -> Subject:
    """A team of which a section kept this; where nothing is said, the same of its opponents."""
    names = opponents or ["Other"] * len(own)
    played = [
        Played(match_id=f"m{at}", started_at=None, opponent=name, side=1, score=(0, 0), complete=True)
        for at, name in enumerate(names)
    ]
    kept = (Looks(looks, section.MEASURES) for looks in (own, own if other is None else other))
    return Subject(team="Made {team}", played=played, own={section.KEY: next(kept)}, other={section.KEY: next(kept)})


def subject_of(section: ModuleType, pairs: Sequence[tuple[Seen, Seen]]) -> Subject:
    """What a section keeps of matches, as the team and as its opponent see them."""
    return of_looks(section, *([section.look(pair[at]) for pair in pairs] for at in (0, 1)))


def check_told(found: Findings, *, least: int) -> None:
    """Sentences have all their numbers, pictures can be drawn, tables have their columns."""
    texts = [one.text for one in found.claims]
    assert len(texts) >= least
    assert not any("{" in text or "nan" in text for text in texts)
    for picture in found.pictures:
        assert svg(picture.draw(), name=picture.name, alt=picture.alt).startswith("<svg")
    for table in found.tables:
        assert {len(row) for row in table.rows} <= {len(table.columns)}


def share(look: Look, key: str) -> float:
    """A measure of one match."""
    part, whole = look.numbers[key]
    return part / whole
