"""``scout.html``: the report as one page, without a network, on paper, in light and dark mode."""

from __future__ import annotations

from collections.abc import Callable

from markupsafe import Markup, escape

from teamclone.comparison.words import NOTHING
from teamclone.evaluation import bootstrap
from teamclone.plots.page import page_template, svg
from teamclone.plots.style import page_css
from teamclone.scout.findings import PLACE, Claim, Picture, number, rounded
from teamclone.scout.measures import Moment
from teamclone.scout.scout import Report


def render(report: Report, *, link: Callable[[Moment], str | None], report_page: str | None = None) -> str:
    """Return the page of a report.

    Args:
        link: gives the address of a moment in a replay; None where there is none.
        report_page: address of the page about the clone; None where there is none.
    """
    template = page_template(__package__, "scout.html.j2", claim=_claim, picture=_picture, cell=_cell, link=link)
    return template.render(
        document=report.document,
        subject=report.subject,
        chapters=report.chapters,
        report_page=report_page,
        theme=Markup(page_css()),
        few=bootstrap.FEW_MATCHES,
    )


def _claim(claim: Claim) -> Markup:
    """Return a sentence whose numbers stand out, each with its interval."""

    def words(key: str) -> Markup:
        value, interval = number(claim.figures[key], claim.units[key])
        small = Markup(' <small class="interval">{}</small>').format(interval) if interval else Markup("")
        return Markup("<b>{}</b>{}").format(value, small)

    parts = PLACE.split(claim.template)
    return Markup("").join(escape(part) if at % 2 == 0 else words(part) for at, part in enumerate(parts))


def _picture(picture: Picture) -> Markup:
    return Markup(svg(picture.draw(), name=picture.name, alt=picture.alt))


def _cell(value: str | float | None, column: str) -> str:
    """Return a cell of a table, numbers by the unit in brackets behind the name of the column."""
    if value is None:
        return NOTHING
    if isinstance(value, str):
        return value
    if isinstance(value, int):
        return f"{value:,}"
    return rounded(value, "share" if column.endswith("(share)") else "")
