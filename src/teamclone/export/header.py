"""The header that C++ programs include: the kernels, what a state is made of, and the class `Clone` over them."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from importlib.resources import files
from types import MappingProxyType

from teamclone.engine.inputs.frame import MORE
from teamclone.engine.inputs.layout import PAST_FRAMES
from teamclone.engine.inputs.reach import REACH_CYCLES
from teamclone.engine.network import spec
from teamclone.engine.network.draw import UNIFORMS
from teamclone.engine.network.weights import FORMAT
from teamclone.export.entries import ENTRIES, MEMORY_BYTES
from teamclone.export.translate import translate
from teamclone.planner.kick_sequences import DIRECTIONS, PAIRS, PLACES
from teamclone.planner.scene import COLUMNS, PRESENT, ROWS
from teamclone.rcss import player_types, server_params
from teamclone.rcss.commands import CLONED, CommandKind
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.rcss.playmodes import PlayMode
from teamclone.world import channels

VERSION = "v1"
"""The namespace within `teamclone`."""

_FLAGS = {name: getattr(channels, name) for name in dir(channels) if name.startswith("FLAG_")}
_CONSTANTS = {
    "N_TEAM": N_TEAM,
    "N_PLAYERS": N_PLAYERS,
    "PAST_FRAMES": PAST_FRAMES,
    "UNIFORMS": UNIFORMS,
    "N_CHANNELS": len(channels.PLAYER_CHANNELS),
    "N_TYPE": len(player_types.FIELDS),
    "N_SERVER": len(server_params.FIELDS),
    **{"ROWS": ROWS, "COLUMNS": COLUMNS, "MORE": MORE, "REACH_CYCLES": REACH_CYCLES, "PRESENT": PRESENT},
    **{"DIRECTIONS": DIRECTIONS, "PAIRS": PAIRS, "PLACES": PLACES},
    **{"N_FIELDS": spec.N_FIELDS, "COMMANDS": spec.COMMANDS, "CATCH": spec.CATCH, "MOVE": spec.MOVE},
    **{"N_OUT": spec.N_OUT, "PROBABILITIES_AT": spec.OUT_PROBABILITIES, "N_NETWORK_INPUTS": spec.INPUTS},
    **{"PAPER": spec.PAPER, "WEIGHTS_FORMAT": FORMAT, "MEMORY_BYTES": MEMORY_BYTES},
    "FRAME_NUMBERS": ROWS * COLUMNS + N_PLAYERS * MORE + 2 + 4 * (REACH_CYCLES + 1) + 2 * N_PLAYERS,
}


_ABSENT = "A player in one frame; all 0 for one that is not on the field."


def header() -> str:
    """Return the header, the same for every run: what a network is made of stands in the file of its weights."""
    return translate(ENTRIES, version=VERSION, more="\n".join([*_facts(), *_clone()]))


def _facts() -> list[str]:
    """Return constants, enumerations and structs of a state."""
    player = (*channels.POSITION, *channels.MEASURED, *channels.CATEGORICAL)
    about = {one.name: f"{one.unit}: {one.about}" if one.unit else one.about for one in player}
    names = ", ".join(f'"{name}"' for name in CLONED)
    return [
        *(f"inline constexpr int {name} = {value};" for name, value in _CONSTANTS.items()),
        f"inline constexpr const char* CLONED[] = {{{names}}};",
        "",
        *_enum("Flag", "Bits of Player::flags.", _FLAGS),
        *_enum("Kind", "Values of Player::last_command; 0 for none.", _members("KIND", CommandKind)),
        *_enum("Mode", "Play modes of State::mode.", _members("MODE", PlayMode)),
        *_struct("Player", _ABSENT, dict.fromkeys(about, 0.0), about),
        *_struct("PlayerType", "Parameters of a player's type.", player_types.DEFAULTS),
        *_struct("Server", "Parameters of the server.", server_params.DEFAULTS),
    ]


def _members(prefix: str, enum: type[IntEnum]) -> dict[str, int]:
    return {f"{prefix}_{member.name}": int(member) for member in enum}


def _enum(name: str, note: str, members: Mapping[str, int]) -> list[str]:
    lines = [f"    {key} = {value}," for key, value in members.items()]
    return [f"/// {note}", f"enum {name} : int {{", *lines, "};", ""]


def _struct(
    name: str, note: str, fields: Mapping[str, float], about: Mapping[str, str] = MappingProxyType({})
) -> list[str]:
    """Return a struct of floats; ``about`` says what some of them are."""
    lines = []
    for key, value in fields.items():
        comment = f"  ///< {about[key]}" if key in about else ""
        lines.append(f"    float {key} = {value!r}f;{comment}")
    size = f'static_assert(sizeof({name}) == {len(fields)} * sizeof(float), "floats alone");'
    return [f"/// {note}", f"struct {name} {{", *lines, "};", size, ""]


def _clone() -> list[str]:
    return files("teamclone.export").joinpath("clone.hpp").read_text(encoding="utf-8").splitlines()
