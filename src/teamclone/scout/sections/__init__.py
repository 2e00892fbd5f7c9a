"""The sections of a report, in the order in which it is read.

A section is a module with KEY, TITLE, MEASURES, ``look``, which keeps what it needs of one match, and ``tell``, which
says what all matches show. ``look`` is asked of both teams of a match, so that a team can be held against its
opponents.
"""

from __future__ import annotations

from types import ModuleType

from teamclone.scout.sections import attack, defence, habits, identity, stamina, transitions

SECTIONS: tuple[ModuleType, ...] = (identity, attack, defence, transitions, stamina, habits)
"""In reading order."""
