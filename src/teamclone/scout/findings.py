"""What a section says: claims with their numbers, pictures and tables."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from teamclone.comparison.words import NOTHING
from teamclone.scout.measures import Figure, Looks, Moment

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

PLACE = re.compile(r"\{(\w+)\}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Claim:
    """A sentence with numbers.

    Attributes:
        template: the sentence, with ``{key}`` in place of each number.
        figures: the numbers by key. units: of each.
        moments: where to see it.
    """

    template: str
    figures: Mapping[str, Figure] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    moments: tuple[Moment, ...] = ()

    @property
    def text(self) -> str:
        """The sentence with its numbers, each with its interval in brackets."""
        return PLACE.sub(lambda place: self.words(place[1]), self.template)

    def words(self, key: str) -> str:
        """Return a number and its interval."""
        value, interval = number(self.figures[key], self.units[key])
        return f"{value} ({interval})" if interval else value


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """A table of a section.

    Attributes:
        name: for programs, and of its file. caption: what it shows.
        columns: names, units in brackets. rows: of texts, numbers, or None where there is none.
        folded: shown on request.
    """

    name: str
    caption: str
    columns: tuple[str, ...]
    rows: Sequence[Sequence[str | float | int | None]]
    folded: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A picture of a section.

    Attributes:
        name: unique in the page. draw: makes it. alt: what it shows, for those who cannot see it.
        caption: what to look at.
    """

    name: str
    draw: Callable[[], Drawing]
    alt: str
    caption: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Findings:
    """What a section found, in the order in which it is read: claims, pictures, tables, and what is missing."""

    claims: Sequence[Claim] = ()
    pictures: Sequence[Picture] = ()
    tables: Sequence[Table] = ()
    notes: Sequence[str] = ()


def claim(
    looks: Looks,
    template: str,
    *,
    moments: Sequence[str] = (),
    most: int = 3,
    shares: Mapping[str, Figure] | None = None,
) -> Claim | None:
    """Return a sentence about measures of a section; None if one of its numbers is not known.

    Args:
        template: the sentence, with the keys of measures in braces.
        moments: keys of the moments that show it.
        shares: numbers that are no measures, because what they are about depends on the matches; shares of 1.
    """
    keys = PLACE.findall(template)
    shares = shares or {}
    figures = {key: shares[key] if key in shares else looks.figure(key) for key in keys}
    if any(figure.value is None for figure in figures.values()):
        return None
    return Claim(
        template=template,
        figures=figures,
        units={key: "share" if key in shares else looks.measures[key].unit for key in keys},
        moments=looks.moments(*moments, most=most),
    )


def claims(*found: Claim | None) -> list[Claim]:
    """Return the claims that could be made."""
    return [one for one in found if one is not None]


def together(*found: Findings) -> Findings:
    """Return several findings as one, in their order."""
    return Findings(
        claims=[claim for one in found for claim in one.claims],
        pictures=[picture for one in found for picture in one.pictures],
        tables=[table for one in found for table in one.tables],
        notes=[note for one in found for note in one.notes],
    )


def number(figure: Figure, unit: str) -> tuple[str, str]:
    """Return a number in words, with no more digits than one reads, and its interval, empty without one."""
    value = rounded(figure.value, unit)
    if unit and unit != "share":
        value = f"{value} {unit}"
    if figure.low is None or figure.value is None:
        return value, ""
    low, high = (rounded(end, unit).removesuffix(" %") for end in (figure.low, figure.high))
    return value, f"{low} to {high}"


def rounded(value: float | None, unit: str) -> str:
    """Return a value with two digits, more where it is large; a share in percent."""
    if value is None:
        return NOTHING
    if unit == "share":
        return f"{rounded(100 * value, '')} %"
    digits = 0 if abs(value) >= 9.95 or value == 0 else 1 if abs(value) >= 0.995 else 2
    return f"{value:,.{digits}f}"


def capital(text: str) -> str:
    """Return a text that begins with a capital letter."""
    return text[:1].upper() + text[1:]


def to_json(findings: Findings) -> dict[str, Any]:
    """Return claims, tables and notes as they stand in ``scout.json``."""
    return {
        "claims": [
            {
                "text": one.text,
                "figures": {key: figure.to_json() | {"unit": one.units[key]} for key, figure in one.figures.items()},
                "moments": [
                    {"match_id": at.match_id, "cycle": at.cycle, "stoppage": at.stoppage, "text": at.text}
                    for at in one.moments
                ],
            }
            for one in findings.claims
        ],
        "tables": [
            {"name": one.name, "caption": one.caption, "columns": one.columns, "rows": [list(row) for row in one.rows]}
            for one in findings.tables
        ],
        "notes": list(findings.notes),
    }
