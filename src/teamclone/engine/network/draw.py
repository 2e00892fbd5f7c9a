"""Commands out of an answer: the likeliest, or one drawn by random numbers that the caller gives."""

from __future__ import annotations

import math

from teamclone.engine.network.constants import DEGREE
from teamclone.engine.network.layers import PI, clamp, wrap
from teamclone.engine.network.result import Answer, view
from teamclone.engine.network.spec import ARGUMENTS_AT, CATCH, MIXTURE, MOVE, PARAMETERS, Floats, Ints
from teamclone.planner.scene import Array
from teamclone.rcss import pitch
from teamclone.rcss.commands import CLONED
from teamclone.system.compiling import kernel

UNIFORMS = 5
"""Random numbers in [0, 1) that a drawn command takes: its kind; the component of its parameters; its first number; the
direction of a dash; its second number, or how far within its class the direction of a dash, tackle or catch is.

Where one chooses among kinds, components or directions a negative number stands for the most probable; half stands for
the centre of a component or class."""
KIND, COMPONENT, FIRST, DASH_DIRECTION, SECOND = range(UNIFORMS)
"""Places of the random numbers."""
EDGE = 1e-6
"""A number is drawn no nearer than so to the ends of its distribution."""
_DASH, _TURN, _KICK, _TACKLE = (CLONED.index(name) for name in ("dash", "turn", "kick", "tackle"))


@kernel
def _most(shares: Floats) -> int:
    best = 0
    for index in range(len(shares)):
        if shares[index] > shares[best]:
            best = index
    return best


@kernel
def _drawn(shares: Floats, uniform: float) -> int:
    """Return the index that a random number stands for; of shares that do not add up to 1, the last that is not 0."""
    if uniform < 0:
        return _most(shares)
    total, last = 0.0, 0
    for index in range(len(shares)):
        if shares[index] > 0:
            total += shares[index]
            last = index
            if uniform < total:
                return index
    return last


@kernel
def _answered(made: Answer, command: int) -> bool:
    """Return whether a command may be chosen: kicks and tackles where they were asked for."""
    at_ball = command == _KICK or command == _TACKLE  # noqa: PLR1714  # no sets in kernels
    return made.asked[0] > 0 or not at_ball


@kernel
def likeliest(made: Answer) -> int:
    """Return the place of the most probable command in the command set, among those that were asked for."""
    best = 0
    for command in range(len(made.probabilities)):
        if _answered(made, command) and made.probabilities[command] > made.probabilities[best]:
            best = command
    return best


@kernel
def point_of(spec: Ints, made: Answer, command: int, numbers: Array) -> None:
    """Fill (2,) the numbers of a command by the single best answer, 0 for those that it lacks."""
    numbers[0], numbers[1] = 0.0, 0.0
    for parameter in range(spec[PARAMETERS]):
        at = spec[ARGUMENTS_AT] + 3 * parameter
        if spec[at] == command:
            numbers[spec[at + 1]] = made.parameters[parameter]


@kernel
def _value(centre: float, scale: float, uniform: float, low: float, high: float) -> float:
    """Return the value of a component that a random number stands for, clipped as the server clips it."""
    u = clamp(uniform, EDGE, 1 - EDGE)
    return clamp(centre + scale * math.log(u / (1 - u)), low, high)


@kernel
def _angle(centre: float, scale: float, uniform: float) -> float:
    """Return the degrees, in [-180, 180), of a component that a random number stands for."""
    # A component ends half a turn to each side of its centre.
    ratio = math.tanh(PI / (2 * scale)) * (2 * clamp(uniform, EDGE, 1 - EDGE) - 1)
    return wrap(centre + 2 * scale * math.atanh(ratio)) / DEGREE


@kernel
def _direction(shares: Floats, which: float, within: float) -> float:
    """Return the degrees of a class, even within it."""
    degrees = (_drawn(shares, which) + clamp(within, EDGE, 1 - EDGE) - 0.5) * (360.0 / len(shares))
    return degrees - 360.0 if degrees > 180.0 else degrees


@kernel
def _kind_of(made: Answer, uniform: float) -> int:
    """Return the place in the command set of the command that a random number stands for, of those asked for."""
    if uniform < 0:
        return likeliest(made)
    whole, command, total = 0.0, 0, 0.0
    for index in range(len(made.probabilities)):
        if _answered(made, index):
            whole += made.probabilities[index]
    for index in range(len(made.probabilities)):
        if _answered(made, index) and made.probabilities[index] > 0:
            total += made.probabilities[index]
            command = index
            if uniform * whole < total:
                break
    return command


@kernel
def sample(spec: Ints, out: Floats, uniforms: Array, numbers: Array) -> int:
    """Draw a command and its numbers from an answer; return its place in the command set.

    Kicks and tackles are drawn where they were asked for. A head that answers with values has no others to draw.

    Args:
        out: (N_OUT,) an answer. uniforms: (UNIFORMS,). numbers: (2,) to be filled, clipped as the server clips them; 0
            for those that the command lacks.
    """
    made = view(spec, out)
    command = _kind_of(made, uniforms[KIND])
    if spec[MIXTURE] == 0:
        point_of(spec, made, command, numbers)
        return command
    numbers[0], numbers[1] = 0.0, 0.0
    if command == _DASH:
        at = _drawn(made.dash_power.share, uniforms[COMPONENT])
        centre, scale = float(made.dash_power.centre[at]), float(made.dash_power.scale[at])
        numbers[0] = _value(centre, scale, uniforms[FIRST], 0.0, 100.0)
        numbers[1] = _direction(made.dash_direction, uniforms[DASH_DIRECTION], uniforms[SECOND])
    elif command == _TURN:
        at = _drawn(made.turn.share, uniforms[COMPONENT])
        angle = _angle(float(made.turn.centre[at]), float(made.turn.scale[at]), uniforms[FIRST])
        numbers[0] = clamp(angle * float(made.turn_factor[0]), -180.0, 180.0)
    elif command == _KICK:
        at = _drawn(made.kick_power.share, uniforms[COMPONENT])
        centre, scale = float(made.kick_power.centre[at]), float(made.kick_power.scale[at])
        numbers[0] = _value(centre, scale, uniforms[FIRST], 0.0, 100.0)
        numbers[1] = _angle(
            float(made.kick_direction.centre[at]), float(made.kick_direction.scale[at]), uniforms[SECOND]
        )
    elif command == _TACKLE:
        numbers[0] = _direction(made.tackle, uniforms[COMPONENT], uniforms[SECOND])
    elif command == spec[CATCH]:
        numbers[0] = _direction(made.catch, uniforms[COMPONENT], uniforms[SECOND])
    elif command == spec[MOVE]:
        at = _drawn(made.move_x.share, uniforms[COMPONENT])
        x, y, x_scale, y_scale = (
            made.move_x.centre[at],
            made.move_y.centre[at],
            made.move_x.scale[at],
            made.move_y.scale[at],
        )
        numbers[0] = _value(float(x), float(x_scale), uniforms[FIRST], -pitch.MAX_X, pitch.MAX_X)
        numbers[1] = _value(float(y), float(y_scale), uniforms[SECOND], -pitch.MAX_Y, pitch.MAX_Y)
    return command
