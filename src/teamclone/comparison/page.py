"""``compare.html``: one page of a comparison, without a network, on paper, in light and dark mode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from markupsafe import Markup

from teamclone.comparison import figures, words
from teamclone.comparison.profile import POSITIONS, SPEEDS
from teamclone.evaluation import bootstrap
from teamclone.plots.page import page_template, svg
from teamclone.plots.style import page_css


def render(document: Mapping[str, Any]) -> str:
    """Return the page of a comparison, from its document."""
    template = page_template(
        __package__,
        "comparison.html.j2",
        name=words.name_of,
        label=words.label_of,
        amount=words.amount,
        interval=lambda figure, unit: _stacked(words.with_interval(figure, unit)),
        units=lambda row: _stacked(words.units(row)),
    )
    return template.render(
        document=document,
        groups=document["groups"],
        units_of={one["name"]: one["unit"] for one in document["statistics"]},
        main=main_group(document),
        sentence=sentence(document),
        theme=Markup(page_css()),
        plots=_plots(document),
        few=bootstrap.FEW_MATCHES,
        extra=_EXTRA,
    )


def _stacked(text: str) -> Markup:
    """Return a number with its interval on a line of its own."""
    value, _, interval = text.removesuffix(")").partition(" (")
    small = Markup('<small class="interval">{}</small>').format(interval) if interval else ""
    return Markup("{}{}").format(value, small)


def main_group(document: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the group of the summary: all opponents, or else the first one with distances."""
    found: Mapping[str, Any] = next(group for group in document["groups"] if group["half"] is not None)
    return found


def sentence(document: Mapping[str, Any]) -> str:
    """Return what the group of the summary says, in words."""
    group = main_group(document)
    rows = [row for row in group["statistics"] if row["own"]]
    above = [row for row in rows if row["units"]["low"] is None or row["units"]["low"] > 1.0]
    middle = sorted(row["units"]["value"] for row in rows)[len(rows) // 2] if rows else None
    return (
        f"In {group['matches']['original']} matches of the original and {group['matches']['clone']} of the clone, half "
        f"of {len(rows)} statistics are at most {words.amount(middle, '')} units away; of {len(above)} the 95 % "
        "interval lies above 1."
    )


def _plots(document: Mapping[str, Any]) -> dict[str, Markup]:
    """Return the pictures as SVG, by name of the statistic."""
    group, made = main_group(document), {}

    def put(name: str, drawing: Any, alt: str) -> None:
        made[name] = Markup(svg(drawing, name=name, alt=alt))

    put("overview", figures.overview(group), "The distance of every statistic in units of the original's own")
    put("where", figures.places(group["positions"]), "Distance of positions by zone of the ball and by player")
    put("ways", figures.speeds(group["speeds"]), "Histograms of the ways of field players in a cycle")
    for at, one in enumerate(document["statistics"]):
        drawing = figures.statistic(
            document["groups"], at, name=one["name"], unit=one["unit"], matches=document["matches"]
        )
        put(one["name"], drawing, f"{words.name_of(one['name'])} of original and clone, by opponent")
    return made


_EXTRA = {POSITIONS.name: "where", SPEEDS.name: "ways"}
"""The second picture of statistics that have one."""
