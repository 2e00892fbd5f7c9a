"""``scout_team``: all that the matches of a team in a store say of it, section by section."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from teamclone import __version__
from teamclone.errors import StoreError, UsageError, choose
from teamclone.scout import advice, changes
from teamclone.scout.findings import Findings, to_json, together
from teamclone.scout.measures import Look, Looks
from teamclone.scout.sections import SECTIONS, habits
from teamclone.scout.seen import see
from teamclone.scout.subject import Played, Subject
from teamclone.store import open_store
from teamclone.store.of_team import TeamMatch, matches_of
from teamclone.store.postgres.location import masked
from teamclone.store.store import Store
from teamclone.system.workers import Died, run_tasks

if TYPE_CHECKING:
    from teamclone.scout.predicted import Foresight

FORMAT = 1
"""Format number of scout.json."""

MOST_PREDICTED = 10
"""In how many matches a clone is asked."""
MOST_SHOWN = 3
"""Of how many matches, the newest, a report shows moments: each needs a replay beside it."""

Progress = Callable[[str, int, int], None]
"""Called with the work, the steps done and their number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chapter:
    """One section of the report: ``key`` for programs, ``title`` for readers, and what it says."""

    key: str
    title: str
    findings: Findings


@dataclass(frozen=True, slots=True, kw_only=True)
class Report:
    """What `scout_team` found.

    Attributes:
        subject: the team, its matches, and what the sections kept of them.
        chapters: what each section says, in reading order.
        document: as in ``scout.json``.
        shown: ids of the matches that its moments are of.
        failed: an error for each match that could not be read.
        foresight: the clone that was held against the matches, and its predictions.
    """

    subject: Subject = field(repr=False)
    chapters: Sequence[Chapter] = field(repr=False)
    document: dict[str, Any] = field(repr=False)
    shown: tuple[str, ...]
    failed: tuple[str, ...]
    foresight: Foresight | None = field(repr=False, default=None)


def scout_team(
    store: Store,
    *,
    team: str,
    opponents: Collection[str] = (),
    against: str | None = None,
    since: str | None = None,
    earlier: Store | None = None,
    run: Path | str | None = None,
    checkpoint: str = "best-loss",
    most_predicted: int = MOST_PREDICTED,
    most_shown: int = MOST_SHOWN,
    jobs: int | None = None,
    on_progress: Progress | None = None,
) -> Report:
    """Say how a team plays, from its matches in a store.

    A match that cannot be read does not stop the others. Matches of the team against itself are left out and named.

    Args:
        store: matches of the team. team: its name.
        opponents: count matches against these only; empty for all.
        against: the team that wants to know: its own numbers, from its matches in the store, stand beside.
        since: a date and time as matches have it, ``2026-11-22`` or ``2026-11-22 11:30``: the report is of the matches
            from then on, and a last section says what has changed since those before.
        earlier: a store with the matches before; those of ``store`` are then all reported.
        run: a run whose clone is held against the matches; None for none. checkpoint: which of its weights.
        most_predicted: in how many matches the clone is asked, the newest of those that it did not learn from.
        most_shown: of how many matches, the newest, moments are shown.
        jobs: how many processes read matches; None for one a processor.
        on_progress: called with the name of the work, the steps done and their number.

    Raises:
        UsageError: a team does not play in the store, no match can be read, or there is none before or since.
        StoreError: the store cannot be read at all.
        RunError: there is no such run or checkpoint, or it is of another format.
    """
    if since is not None and earlier is not None:
        raise UsageError("expected either since or earlier: a date splits the matches of one store")
    telling = on_progress or (lambda work, done, total: None)
    foresight = None if run is None else _foresight(run, checkpoint, most=most_predicted)
    failed: list[str] = []
    left_out: list[dict[str, str]] = []
    watch = partial(_watched, failed=failed, left_out=left_out, jobs=jobs)
    chosen = _chosen(store, team, opponents, failed=failed, left_out=left_out)
    before = us = None
    if since is not None or earlier is not None:
        old, chosen = _split(chosen, since)
        if earlier is not None:
            old = _chosen(earlier, team, opponents, failed=failed, left_out=left_out)
        if not chosen or not old:
            when = "since" if not chosen else "before"
            raise UsageError(
                f"no match of {team!r} {when} {since or 'these'}; see `teamclone matches` for when they began"
            )
        before = watch(earlier or store, team, old, telling=partial(telling, "read earlier matches"))
    subject = watch(store, team, chosen, telling=partial(telling, "read matches"))
    if against is not None:
        ours = _chosen(store, against, (), failed=failed, left_out=left_out)
        us = watch(store, against, ours, telling=partial(telling, "read your matches"))
    shown = _show(subject, most_shown)
    findings: dict[ModuleType, Findings] = {one: one.tell(subject) for one in SECTIONS}
    if foresight is not None:
        foreseen = foresight.tell(store, subject, chosen, shown=shown, on_progress=partial(telling, "predict matches"))
        findings[habits] = together(findings[habits], foreseen)
    chapters = [
        *(Chapter(key=one.KEY, title=one.TITLE, findings=found) for one, found in findings.items()),
        Chapter(key=advice.KEY, title=advice.TITLE, findings=advice.advise(subject, us=us)),
    ]
    if before is not None:
        chapters.append(Chapter(key=changes.KEY, title=changes.TITLE, findings=changes.changes(before, subject)))
    return Report(
        subject=subject,
        chapters=chapters,
        document=_document(store, subject, chapters, left_out, failed),
        shown=shown,
        failed=tuple(failed),
        foresight=foresight,
    )


def _show(subject: Subject, most: int) -> tuple[str, ...]:
    """Let moments be of the newest matches only, and return the ids of these."""
    shown = tuple(one.match_id for one in subject.played[-most:]) if most else ()
    for looks in (*subject.own.values(), *subject.other.values()):
        looks.shown = frozenset(shown)
    return shown


def _foresight(run: Path | str, checkpoint: str, *, most: int) -> Foresight:
    """Return the clone of a run, opened before matches are read: what is wrong with it shows at once."""
    from teamclone.scout.predicted import Foresight

    return Foresight(run, checkpoint, most=most)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Watched:
    """What the sections keep of one match, of the team and of its opponent."""

    played: Played
    own: dict[str, Look]
    other: dict[str, Look]


def _chosen(
    store: Store, team: str, opponents: Collection[str], *, failed: list[str], left_out: list[dict[str, str]]
) -> list[TeamMatch]:
    """Return the matches of a team that count, the oldest first; others are added to ``failed`` and ``left_out``.

    Raises:
        UsageError: the team has none, or has not played an opponent that is asked for.
    """
    found = matches_of(store, team)
    failed += [one.error for one in found if one.error is not None]
    there = sorted({one.opponent for one in found if one.opponent})
    for name in opponents:
        if name not in there:
            raise UsageError(f"no match of {team!r} against {name!r}; {choose(name, there)}")
    chosen = []
    for one in sorted(found, key=lambda match: (match.started, match.match_id)):
        if one.error is not None:
            continue
        if reason := _reason(one, opponents):
            left_out.append({"match_id": one.match_id, "opponent": one.opponent or "", "reason": reason})
        else:
            chosen.append(one)
    return chosen


def _reason(match: TeamMatch, opponents: Collection[str]) -> str | None:
    """Return why a match does not count, None if it does."""
    return match.uncontested or (
        "its opponent was not asked for" if opponents and match.opponent not in opponents else None
    )


def _split(matches: Sequence[TeamMatch], since: str | None) -> tuple[list[TeamMatch], list[TeamMatch]]:
    """Return the matches before a date and those from then on; without a date all are of the second kind."""
    if since is None:
        return [], list(matches)
    return [one for one in matches if one.started < since], [one for one in matches if one.started >= since]


def _watched(
    store: Store,
    team: str,
    matches: Sequence[TeamMatch],
    *,
    failed: list[str],
    left_out: Sequence[dict[str, str]],
    jobs: int | None,
    telling: Callable[[int, int], None],
) -> Subject:
    """Return a team with what the sections keep of its matches; what goes wrong is added to ``failed``.

    Raises:
        UsageError: no match can be read.
    """
    watched: list[_Watched] = []
    results = run_tasks(partial(_watch, store.location), matches, jobs=jobs, in_order=True)
    for done, (_, result) in enumerate(results, start=1):
        telling(done, len(matches))
        if isinstance(result, _Watched):
            watched.append(result)
        else:
            failed.append("a process that read a match was killed" if isinstance(result, Died) else result)
    if not watched:
        reasons = "; ".join([*failed, *sorted({one["reason"] for one in left_out})])
        raise UsageError(f"{masked(store.location)}: no match of {team!r} can be scouted: {reasons}")
    return _subject(team, watched)


def _watch(location: str, match: TeamMatch) -> _Watched | str:
    """Return what the sections keep of a match, or why it cannot be read."""
    try:
        own, other = see(open_store(location), match)
    except StoreError as error:
        return str(error)
    left, right = int(match.row["left_score"] or 0), int(match.row["right_score"] or 0)
    return _Watched(
        played=Played(
            match_id=match.match_id,
            started_at=match.started or None,
            opponent=str(match.opponent),
            side=match.side,
            score=(left, right) if match.side > 0 else (right, left),
            complete=bool(match.row["complete"]),
        ),
        own={section.KEY: section.look(own) for section in SECTIONS},
        other={section.KEY: section.look(other) for section in SECTIONS},
    )


def _subject(team: str, watched: Sequence[_Watched]) -> Subject:
    return Subject(
        team=team,
        played=[one.played for one in watched],
        own={section.KEY: Looks([one.own[section.KEY] for one in watched], section.MEASURES) for section in SECTIONS},
        other={
            section.KEY: Looks([one.other[section.KEY] for one in watched], section.MEASURES) for section in SECTIONS
        },
    )


def _document(
    store: Store,
    subject: Subject,
    chapters: Sequence[Chapter],
    left_out: Sequence[dict[str, str]],
    failed: Sequence[str],
) -> dict[str, Any]:
    return {
        "kind": "teamclone scout",
        "format": FORMAT,
        "teamclone": __version__,
        "team": subject.team,
        "store": masked(store.location),
        "opponents": dict(Counter(one.opponent for one in subject.played)),
        "matches": [
            {
                "match_id": one.match_id,
                "started_at": one.started_at,
                "opponent": one.opponent,
                "score": list(one.score),
                "complete": one.complete,
            }
            for one in subject.played
        ],
        "measures": [
            {
                "key": measure.key,
                "section": section.KEY,
                "name": measure.name,
                "unit": measure.unit,
                "about": measure.about,
                "team": subject.own[section.KEY].figure(measure.key).to_json(),
                "opponents": subject.other[section.KEY].figure(measure.key).to_json(),
            }
            for section in SECTIONS
            for measure in section.MEASURES
        ],
        "sections": [{"key": chapter.key, "title": chapter.title, **to_json(chapter.findings)} for chapter in chapters],
        "left_out": list(left_out),
        "failed": list(failed),
    }
