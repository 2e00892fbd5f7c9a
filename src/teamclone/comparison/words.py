"""Numbers of a comparison in words, for the terminal and the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

NOTHING = "\N{EN DASH}"
ENDLESS = "\N{INFINITY}"
ALL = "all opponents"


def name_of(statistic: str) -> str:
    """Return ``pass_completion`` as ``pass completion``."""
    return statistic.replace("_", " ")


def label_of(group: Mapping[str, Any]) -> str:
    """Return the opponent of a group."""
    return ALL if group["opponent"] is None else str(group["opponent"])


def amount(value: float | None, unit: str) -> str:
    """Return a value: shares in percent, of others as many digits as tell something."""
    if value is None:
        return NOTHING
    if unit == "share":
        return f"{amount(100 * value, '')} %"
    digits = 0 if abs(value) >= 1000 or value == 0 else 1 if abs(value) >= 10 else 2 if abs(value) >= 1 else 3
    return f"{value:,.{digits}f}"


def with_interval(figure: Mapping[str, Any] | None, unit: str) -> str:
    """Return a mean with its interval in brackets."""
    if figure is None or figure["value"] is None:
        return NOTHING
    text = amount(figure["value"], unit)
    if figure["low"] is None:
        return text
    low, high = (amount(figure[end], unit).removesuffix(" %") for end in ("low", "high"))
    return f"{text} ({low} to {high})"


def units(row: Mapping[str, Any]) -> str:
    """Return the distance of a statistic in units with its interval; of one that never varies, a dash."""
    if not row.get("units"):
        return NOTHING
    value, low, high = (row["units"][key] for key in ("value", "low", "high"))
    if value is None:
        return ENDLESS if row["distance"] else NOTHING
    if low is None and high is None:
        return f"{value:.2f}"
    return f"{value:.2f} ({ENDLESS if low is None else f'{low:.2f}'} to {ENDLESS if high is None else f'{high:.2f}'})"
