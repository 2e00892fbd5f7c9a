"""The files of a report: the page, its numbers, and replays of the matches that it points into."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from urllib.parse import quote

from teamclone.errors import TeamcloneError
from teamclone.scout.measures import Moment
from teamclone.scout.page import render
from teamclone.scout.scout import Report
from teamclone.store.store import Store
from teamclone.system.documents import write_document
from teamclone.system.files import write_atomic

LEAD = 10
"""Cycles before a moment at which its link begins, so that one sees how it comes about."""


def write_scout(
    report: Report,
    out: Path | str,
    *,
    store: Store,
    csv_folder: Path | str | None = None,
    on_progress: Callable[[str, int, int], None] | None = None,
) -> list[str]:
    """Write the page, a ``.json`` of the same name, and the replays of the matches whose moments it shows.

    Replays show what the clone of the report expected. The page links to the report of its run, if it lies beside.

    Args:
        out: of the page. Replays go into a folder of its name and ``-replays``.
        store: where the matches are.
        csv_folder: where each table is written as CSV; None for nowhere.

    Returns:
        Why replays could not be made, a line each.
    """
    telling = on_progress or (lambda work, done, total: None)
    out = Path(out)
    out.parent.mkdir(parents=True, exist_ok=True)
    folder = out.with_name(f"{out.stem}-replays")
    made, failed = {}, []
    needed = [name for name in report.shown if name in _quoted(report)]
    for done, match_id in enumerate(needed):
        telling("make replays", done, len(needed))
        path = folder / f"{match_id}.html"
        try:
            _replay(report, match_id, path, store=store, home=out)
            made[match_id] = f"{folder.name}/{path.name}"
        except (TeamcloneError, OSError) as error:
            failed.append(f"no replay of match {match_id}: {error}")

    def link(moment: Moment) -> str | None:
        if moment.match_id not in made:
            return None
        side = _side(report, moment)
        player = f"&p={side}{moment.unum}" if moment.unum else ""
        cycle = moment.cycle if moment.stoppage else max(moment.cycle - LEAD, 0)
        stoppage = f".{moment.stoppage}" if moment.stoppage else ""
        return f"{quote(made[moment.match_id])}#c={cycle}{stoppage}{player}"

    beside = report.foresight is not None and out.parent.resolve() == report.foresight.run.path.resolve()
    write_document(out.with_suffix(".json"), report.document)
    if csv_folder is not None:
        _tables(report, Path(csv_folder))
    write_atomic(out, render(report, link=link, report_page="report.html" if beside else None).encode())
    return failed


def _quoted(report: Report) -> set[str]:
    """Return the matches that the page points into."""
    return {at.match_id for chapter in report.chapters for claim in chapter.findings.claims for at in claim.moments}


def _side(report: Report, moment: Moment) -> str:
    return "l" if (_side_of(report, moment.match_id) > 0) == moment.own else "r"


def _side_of(report: Report, match_id: str) -> int:
    """Return the side of the team in a match, 1 left or -1 right."""
    return next(one.side for one in report.subject.played if one.match_id == match_id)


def _replay(report: Report, match_id: str, path: Path, *, store: Store, home: Path) -> None:
    from teamclone.replay.page import make_replay

    back = quote(Path(os.path.relpath(home.resolve(), path.parent.resolve())).as_posix())
    clone = report.foresight
    if clone is None:
        make_replay(match_id, path, store=store, home=back)
        return
    there = clone.tables.get(match_id)
    make_replay(
        match_id,
        path,
        store=store,
        run=clone.run.path,
        checkpoint=clone.checkpoint,
        teams=(report.subject.team,),
        made=None if there is None else {_side_of(report, match_id): there},
        home=back,
    )


def _tables(report: Report, folder: Path) -> None:
    """Write each table, and the measures, as CSV."""
    folder.mkdir(parents=True, exist_ok=True)
    for chapter in report.chapters:
        for table in chapter.findings.tables:
            _rows(folder / f"{chapter.key}-{table.name}.csv", [table.columns, *table.rows])
    ends = ("value", "low", "high", "matches")
    names = ("key", "section", "name", "unit", "about")
    head = [*names, *ends, *(f"opponents_{end}" for end in ends)]
    measures = [
        [*(one[name] for name in names), *(one[of][end] for of in ("team", "opponents") for end in ends)]
        for one in report.document["measures"]
    ]
    _rows(folder / "measures.csv", [head, *measures])


def _rows(path: Path, rows: Iterable[Iterable[object]]) -> None:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    write_atomic(path, text.getvalue().encode())
