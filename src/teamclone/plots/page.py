"""The template of a page, and figures inside it: SVG text that takes its colours from the page, light or dark.

matplotlib knows no CSS, so figures are drawn in stand-in colours that `svg` replaces by CSS variables.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from importlib import resources
from typing import Any

import jinja2
import matplotlib as mpl
from matplotlib.figure import Figure

from teamclone.plots.style import Colours, style

PAPER, INK, MUTED, RULE, ACCENT, SECOND = (f"#01020{n}" for n in range(2, 8))
_STAND_INS = {PAPER: "paper", INK: "ink", MUTED: "muted", RULE: "rule", ACCENT: "accent", SECOND: "second"}
KIND_COLOURS = {
    **{"dash": "#3d85c6", "turn": "#dd8a1b", "kick": "#1f9e78", "tackle": "#c75b9b"},
    **{"catch": "#8a6fd1", "move": "#a3862a", "none": "#7d8791"},
}
"""Also legible where they cannot follow the page: in rasterised dots."""

WIDTH = 7.4
"""Inches; the page scales it to its column."""

COLOURS = Colours(paper=PAPER, ink=INK, muted=MUTED, rule=RULE, accent=ACCENT, second=SECOND)
STYLE = style(COLOURS)


LONGEST = 20
"""Characters of a name that a picture has room for; the server allows fewer."""


def short(name: str) -> str:
    """Return a name of any length cut to what a picture has room for."""
    return name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…"


def page_template(package: str, name: str, /, **filters: Callable[..., Any]) -> jinja2.Template:
    """Return the template of a page out of a package, with filters of its own; what it shows is escaped."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    environment.filters |= filters
    return environment.from_string(resources.files(package).joinpath(name).read_text("utf-8"))


def svg(figure: Figure, *, name: str, alt: str) -> str:
    """Return a figure as an inline <svg> element: ids unique by ``name``, a text alternative, colours of the page."""
    stream = io.StringIO()
    with mpl.rc_context(STYLE):
        figure.savefig(stream, format="svg", transparent=True, dpi=160, metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    # The page is one document: ids must not meet, and RDF metadata names schemas that are of no use in it.
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r'\bid="([^"]+)"', rf'id="{name}-\1"', text)
    text = re.sub(r'(xlink:href|href)="#([^"]+)"', rf'\1="#{name}-\2"', text)
    text = re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", text)
    # matplotlib's fonts are not the page's.
    text = re.sub(r"font: (\S+) '[^;\"]*", r"font: \1 inherit; font-family: inherit", text)
    for stand_in, variable in _STAND_INS.items():
        text = text.replace(stand_in, f"var(--{variable})")
    for kind, colour in KIND_COLOURS.items():
        text = text.replace(colour, f"var(--{kind})")
    head = re.compile(r'<svg ([^>]*?)width="[^"]*"([^>]*?)>', re.DOTALL)
    text = re.sub(r' height="[^"]*pt"', "", text, count=1)
    label = alt.replace("&", "&amp;").replace('"', "&quot;").replace("<", "&lt;")
    return head.sub(lambda match: f'<svg {match[1]}{match[2]} role="img" aria-label="{label}">', text, count=1)
