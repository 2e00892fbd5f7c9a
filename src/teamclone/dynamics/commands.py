"""The server's treatment of a command before it acts on it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dynamics import formulas
from teamclone.rcss import pitch
from teamclone.rcss import server_params as server
from teamclone.rcss.commands import CommandKind

_LIMITS = (
    "min_dash_power",
    "max_dash_power",
    "min_dash_angle",
    "max_dash_angle",
    "dash_angle_step",
    "minmoment",
    "maxmoment",
    "minpower",
    "maxpower",
    "min_catch_angle",
    "max_catch_angle",
)
"""Parameters of the server by which it clips arguments."""


def used_arguments(commands: Mapping[str, NDArray[Any]], params: Mapping[str, float | str]) -> NDArray[np.float32]:
    """Return the arguments of commands as the server uses them: clipped and rounded (``player.cpp``).

    A two-leg dash is given as its sum: the mean of both legs' power vectors, as a power and a direction.

    Args:
        commands: ``kind``, ``legs``, ``arg0`` .. ``arg3`` of ``columns.COMMANDS``, (n,).
        params: the server's parameters as the log lists them.

    Returns:
        (n, 2) power, degrees, metres of a move; unused ones 0.
    """
    limit = {name: server.number(params, name, version=server.OLDEST) for name in _LIMITS}
    kind, legs = commands["kind"], commands["legs"]
    arg = [commands[f"arg{index}"].astype(np.float64) for index in range(4)]

    def dash(power: NDArray[np.float64], direction: NDArray[np.float64]) -> tuple[NDArray[Any], NDArray[Any]]:
        used = np.clip(power, limit["min_dash_power"], limit["max_dash_power"])
        return used, formulas.dash_angle(direction, server=limit)

    values = np.zeros((len(kind), 2))
    is_dash, is_legs = kind == CommandKind.DASH, legs > 0
    plain = is_dash & ~is_legs
    values[plain, 0], values[plain, 1] = dash(arg[0][plain], arg[1][plain])
    if is_legs.any():
        total = np.zeros(int(is_legs.sum()), np.complex128)
        for power, direction in ((arg[0], arg[1]), (arg[2], arg[3])):
            used, angle = dash(np.nan_to_num(power[is_legs]), np.nan_to_num(direction[is_legs]))
            total += used * np.exp(1j * np.radians(angle)) / 2
        values[is_legs, 0], values[is_legs, 1] = np.abs(total), np.degrees(np.angle(total))
    turn = kind == CommandKind.TURN
    values[turn, 0] = np.clip(arg[0][turn], limit["minmoment"], limit["maxmoment"])
    kick = kind == CommandKind.KICK
    values[kick, 0] = np.clip(arg[0][kick], limit["minpower"], limit["maxpower"])
    values[kick, 1] = np.clip(arg[1][kick], -180.0, 180.0)
    tackle = kind == CommandKind.TACKLE
    values[tackle, 0] = np.clip(arg[0][tackle], -180.0, 180.0)
    catch = kind == CommandKind.CATCH
    values[catch, 0] = np.clip(arg[0][catch], limit["min_catch_angle"], limit["max_catch_angle"])
    move = kind == CommandKind.MOVE
    values[move, 0] = np.clip(arg[0][move], -pitch.MAX_X, pitch.MAX_X)
    values[move, 1] = np.clip(arg[1][move], -pitch.MAX_Y, pitch.MAX_Y)
    return values.astype(np.float32)
