"""A match as a ``.replay`` file of JaSMIn, the 3-D player for browsers: its text format for 2-D matches, version 1."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from teamclone.evaluation.match_columns import MatchColumns
from teamclone.rcss import state_bits
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.players import N_TEAM, SLOT_SIDES, SLOT_UNUMS
from teamclone.rcss.playmodes import PlayMode
from teamclone.system.files import write_atomic

CYCLE_S = 0.1
"""Duration of a cycle; the clock of the match stands in stoppages."""
COLOURS = ("#1b6fb3", "#c46a12")
"""Of the left and the right team, as CSS has them."""


def write_jasmin(path: Path, match: MatchColumns) -> None:
    """Write the match; the file appears when it is whole."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomic(path, ("\n".join(_lines(match)) + "\n").encode())


def _lines(match: MatchColumns) -> Iterator[str]:
    """Yield one record a line; its first letters say what it is."""
    yield "RPL 2D 1"
    yield f"EP {_object({'simulator_step': 1000 * CYCLE_S} | dict(match.params))}"
    for index in range(len(match.types[FIELDS[0]])):
        yield f"PT {index} {_object({name: float(match.types[name][index]) for name in FIELDS})}"
    yield f"T {_word(match.left)} {_word(match.right)} {COLOURS[0]} {COLOURS[1]}"
    frames, players = match.frames, match.players
    there = (players["state"] & state_bits.STAND) != 0
    shown = {name: np.where(np.isnan(players[name]), 0, players[name]) for name in ("x", "y", "body")}
    types = np.full(2 * N_TEAM, -1)
    for at in range(len(frames["cycle"])):
        mode = int(frames["playmode"][at])
        word = PlayMode(mode).name.lower() if mode < len(PlayMode) else PlayMode.NULL.name.lower()
        score = f"{frames['left_score'][at]} {frames['right_score'][at]}"
        penalties = [
            int(frames[f"{side}_penalties_{what}"][at]) for side in ("left", "right") for what in ("scored", "missed")
        ]
        shoot_out = "".join(f" {count}" for count in penalties) if any(penalties) else ""
        yield f"S {CYCLE_S * float(frames['cycle'][at]):.1f} {word} {score}{shoot_out}"
        yield f"b {frames['ball_x'][at]:.2f} {frames['ball_y'][at]:.2f}"
        for slot in np.flatnonzero(there[at]):
            letter, kind = ("l" if SLOT_SIDES[slot] > 0 else "r"), ""
            if types[slot] != players["type"][at, slot]:
                types[slot] = players["type"][at, slot]
                letter, kind = letter.upper(), f" {types[slot]}"
            place = " ".join(f"{shown[name][at, slot]:.2f}" for name in ("x", "y", "body"))
            state, neck, stamina = (players[name][at, slot] for name in ("state", "neck", "stamina"))
            line = f"{letter} {SLOT_UNUMS[slot]}{kind} {int(state):#x} {place}"
            line += "" if np.isnan(neck) else f" (j {neck:.2f})"
            yield line + ("" if np.isnan(stamina) else f" (s {stamina:.0f})")


def _object(values: Mapping[str, float | str]) -> str:
    """Return values as one line of JSON, without those that it cannot write."""
    finite = {name: value for name, value in values.items() if isinstance(value, str) or np.isfinite(value)}
    return json.dumps(finite)


def _word(name: str | None) -> str:
    """Return a team's name as one word: the records are split at spaces."""
    return "_".join("".join(one if one.isprintable() else " " for one in name or "").split()) or "nobody"
