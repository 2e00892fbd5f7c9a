"""One theme for every figure and page. Colours of a figure are the caller's, because pages and files differ."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Colours:
    """Colours of a figure, as matplotlib names them.

    Attributes:
        paper: of the page. ink: of titles and text. muted: of axes and their labels. rule: of the grid.
        accent, second: of the first and the second curve.
    """

    paper: str
    ink: str
    muted: str
    rule: str
    accent: str
    second: str


LIGHT = Colours(paper="#ffffff", ink="#1c2126", muted="#5d6872", rule="#e2e7ec", accent="#1b6fb3", second="#c46a12")
"""Of a figure that is a file of its own, on white."""


def style(colours: Colours) -> Any:
    """Return matplotlib settings for ``matplotlib.rc_context``."""
    return {
        "svg.fonttype": "none",
        "svg.hashsalt": "teamclone",
        "font.size": 9.0,
        "axes.titlesize": 9.5,
        "axes.titleweight": "bold",
        "axes.titlelocation": "left",
        "axes.labelsize": 9.0,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.edgecolor": colours.muted,
        "axes.labelcolor": colours.muted,
        "axes.titlecolor": colours.ink,
        "axes.grid": True,
        "axes.axisbelow": True,
        "grid.color": colours.rule,
        "grid.linewidth": 0.7,
        "text.color": colours.ink,
        "xtick.color": colours.muted,
        "ytick.color": colours.muted,
        "xtick.labelsize": 8.5,
        "ytick.labelsize": 8.5,
        "legend.frameon": False,
        "legend.fontsize": 8.5,
        "lines.linewidth": 1.6,
        "lines.solid_capstyle": "round",
    }


def theme_css() -> str:
    """Return the colours of every page as CSS variables of its root."""
    return resources.files(__package__).joinpath("theme.css").read_text("utf-8")


def page_css() -> str:
    """Return the rules of a page of text, tables and figures, its colours included."""
    return theme_css() + resources.files(__package__).joinpath("page.css").read_text("utf-8")
