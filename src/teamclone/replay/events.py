"""The events of a match in words, as the page lists them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from teamclone.events.definitions import EventKind, Outcome
from teamclone.logs.match import Columns
from teamclone.rcss import pitch

NOT_LISTED = (EventKind.POSSESSION,)
"""Spells of possession begin and end with events that are listed."""
AT_THEIR_END = (EventKind.INTERCEPTION, EventKind.OUT_OF_BOUNDS)
"""Kinds whose moment is their end: the touch before is another event's."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """A moment of a match.

    Attributes:
        frame: index of the frame. kind: what it is.
        side: of the team, 1 left, -1 right, 0 of none. unum: of the player, 0 where none or not known.
        text: what there is to say beside the kind, without the names of the teams; may be empty.
    """

    frame: int
    kind: EventKind
    side: int = 0
    unum: int = 0
    text: str


def listed(events: Columns, frames: Columns) -> list[Event]:
    """Return the events that the page lists, in the order of their frames.

    Touches that a restart makes of the last one before the stop of play are left out.

    Args:
        events: ``definitions.COLUMNS``. frames: ``columns.FRAMES`` of the same match.
    """
    made = []
    names = list(events)
    for values in zip(*(events[name].tolist() for name in names), strict=True):
        row = dict(zip(names, values, strict=True))
        kind = EventKind(row["kind"])
        if kind in NOT_LISTED or row["outcome"] == Outcome.RESTART:
            continue
        frame = row["end_frame"] if kind in AT_THEIR_END else row["frame"]
        made.append(Event(frame=frame, kind=kind, side=row["side"], unum=row["unum"], text=_text(kind, row, frames)))
    order = list(EventKind)
    return sorted(made, key=lambda event: (event.frame, order.index(event.kind)))


def _text(kind: EventKind, row: dict[str, Any], frames: Columns) -> str:
    """Return what there is to say of an event beside its kind and player."""
    outcome, other = row["outcome"], row["other_unum"]
    if kind is EventKind.GOAL:
        score = f"{int(frames['left_score'][row['frame']])}:{int(frames['right_score'][row['frame']])}"
        own = outcome == Outcome.OWN_GOAL
        return f"{score}, last touched by {other or 'several'} of the other team" if own else score
    if kind is EventKind.SHOT:
        return f"from {_to_goal(row):.0f} m, {outcome}"
    if kind in (EventKind.PASS, EventKind.THROUGH_PASS):
        return _pass(row)
    if kind is EventKind.INTERCEPTION:
        return f"wins the ball from {other}"
    if kind in (EventKind.DRIBBLE, EventKind.SELF_PASS):
        lost = f", lost to {other or 'several'}" if outcome == Outcome.LOST else ""
        return f"{row['length']:.0f} m{lost}"
    if kind is EventKind.PRESS:
        return f"{row['end_frame'] - row['frame']} cycles, {outcome}"
    if kind is EventKind.CLEARANCE:
        return f"{row['length']:.0f} m, {outcome}"
    if kind is EventKind.FOUL and other:
        return f"{outcome} of {other}"
    return str(outcome)


def _pass(row: dict[str, Any]) -> str:
    """Return to whom a pass went and what became of it: ``to 9, 12 m``, ``12 m, intercepted by 4``."""
    way, outcome, other = f"{row['length']:.0f} m", row["outcome"], row["other_unum"]
    if outcome in (Outcome.COMPLETED, Outcome.FAILED):
        to = f"to {other}" if other else "to several"
        return f"{to}, {way}" + ("" if outcome == Outcome.COMPLETED else ", not under control")
    return f"{way}, {outcome}" + (f" by {other}" if other else "")


def _to_goal(row: dict[str, Any]) -> float:
    """Return how far from the middle of the other team's goal an event begins, m."""
    distance: float = ((row["side"] * pitch.HALF_LENGTH - row["x"]) ** 2 + row["y"] ** 2) ** 0.5
    return distance
