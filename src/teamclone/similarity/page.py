"""``similar.html``: one page of a similarity, without a network, on paper, in light and dark mode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from markupsafe import Markup

from teamclone.evaluation import bootstrap
from teamclone.plots.page import page_template, svg
from teamclone.plots.style import page_css
from teamclone.similarity import figures


def render(document: Mapping[str, Any]) -> str:
    """Return the page of a similarity, from its document."""
    template = page_template(__package__, "similar.html.j2", shades=figures.shades)
    return template.render(
        document=document,
        clones=[one["team"] for one in document["clones"]],
        sentences=sentences(document),
        theme=Markup(page_css()),
        plots=_plots(document),
        few=bootstrap.FEW_MATCHES,
    )


def sentences(document: Mapping[str, Any]) -> list[str]:
    """Return what was found, in words."""
    made = []
    found = document["distances"]
    if found:
        pairs = [
            (distance, one, other)
            for at, one in enumerate(found["teams"])
            for distance, other in zip(found["nats"][at][:at], found["teams"], strict=False)
        ]
        nearest, farthest = min(pairs), max(pairs)
        made.append(f"{nearest[2]} and {nearest[1]} play most alike, {nearest[0]:.3f} nats a command apart.")
        if len(pairs) > 1:
            made.append(f"Farthest apart are {farthest[2]} and {farthest[1]}, {farthest[0]:.3f}.")
    whole = document["guesses"][-1]
    if whole["stretches"]:
        made.append(
            f"Of {whole['stretches']} matches as if of unknown teams, {whole['right']} are predicted best by the clone "
            "of the right one."
        )
    made += [
        f"{one['log']}, {one['side']}{' (' + one['name'] + ')' if one['name'] else ''}: plays most like "
        f"{one['most_like']}, {min(one['loss'].values()):.3f} nats a command."
        for one in document["logs"]
    ]
    return made


def _plots(document: Mapping[str, Any]) -> dict[str, Markup]:
    """Return the pictures as SVG; none of fewer teams than they need."""
    found = document["distances"]
    if not found or "tree" not in found:
        return {}
    return {
        "tree": Markup(svg(figures.tree(found), name="tree", alt="Tree of the teams by distance")),
        "plane": Markup(svg(figures.plane(found), name="plane", alt="Map of the teams by distance")),
    }
