"""An answer: views into one array that `answer.answer` fills."""

from __future__ import annotations

from typing import NamedTuple

from teamclone.engine.network.constants import DASH_DIRECTIONS
from teamclone.engine.network.spec import (
    COMMANDS,
    MIXTURE,
    N_CATCH,
    N_DASH,
    N_KICK,
    N_MOVE,
    N_TURN,
    OUT_ASKED,
    OUT_CATCH,
    OUT_DASH,
    OUT_DASH_DIRECTION,
    OUT_KICK,
    OUT_LOGITS,
    OUT_MOVE,
    OUT_PARAMETERS,
    OUT_PROBABILITIES,
    OUT_TACKLE,
    OUT_TURN,
    OUT_TURN_FACTOR,
    PARAMETERS,
    Floats,
    Ints,
)
from teamclone.planner.tackle import DIRECTIONS as TACKLE_DIRECTIONS
from teamclone.system.compiling import kernel


class Mixture(NamedTuple):
    """A mixture of logistic components of one parameter, (components,) each.

    Attributes:
        share: their probabilities, which add up to 1. centre, scale: as in `models.distributions`.
    """

    share: Floats
    centre: Floats
    scale: Floats


class Answer(NamedTuple):
    """A network's answer to one situation. What a network or an answer lacks is empty, or 0 where it was not asked for.

    Attributes:
        logits, probabilities: (commands,) calibrated.
        parameters: (parameters,) the single best value of each, in power, degrees and metres, each for the case that
            its command is given.
        asked: (1,) 1 where kicks and tackles are answered, else 0.
        turn_factor: (1,) turn moment for one degree.
        dash_power: power. dash_direction: (24,) probabilities of directions, the first straight ahead.
        turn: radians before the loss by motion: the moment is an angle, in degrees, times ``turn_factor``.
        kick_power: power. kick_direction: radians from the body, of the same components as ``kick_power``.
        tackle: (40,) and catch: (40,) probabilities of directions. move_x, move_y: metres, of the same components.
    """

    logits: Floats
    probabilities: Floats
    parameters: Floats
    asked: Floats
    turn_factor: Floats
    dash_power: Mixture
    dash_direction: Floats
    turn: Mixture
    kick_power: Mixture
    kick_direction: Mixture
    tackle: Floats
    catch: Floats
    move_x: Mixture
    move_y: Mixture


@kernel
def _mixture(out: Floats, at: int, begin: int, n: int) -> Mixture:
    """Return a mixture whose shares are at ``at``, its centres and then its scales at ``begin``."""
    return Mixture(out[at : at + n], out[begin : begin + n], out[begin + n : begin + 2 * n])


@kernel
def view(spec: Ints, out: Floats) -> Answer:
    """Return the parts of an answer.

    Args:
        out: (N_OUT,) as `answer.answer` fills it.
    """
    commands, mixture = spec[COMMANDS], spec[MIXTURE]
    logits, probabilities, parameters = spec[OUT_LOGITS], spec[OUT_PROBABILITIES], spec[OUT_PARAMETERS]
    dashed, hit, caught = spec[OUT_DASH_DIRECTION], spec[OUT_TACKLE], spec[OUT_CATCH]
    asked, factor = spec[OUT_ASKED], spec[OUT_TURN_FACTOR]
    dash, turn, kick, move = spec[OUT_DASH], spec[OUT_TURN], spec[OUT_KICK], spec[OUT_MOVE]
    dashes, turns, kicks, moves = spec[N_DASH], spec[N_TURN], spec[N_KICK], spec[N_MOVE]
    return Answer(
        out[logits : logits + commands],
        out[probabilities : probabilities + commands],
        out[parameters : parameters + spec[PARAMETERS]],
        out[asked : asked + 1],
        out[factor : factor + 1],
        _mixture(out, dash, dash + dashes, dashes),
        out[dashed : dashed + mixture * DASH_DIRECTIONS],
        _mixture(out, turn, turn + turns, turns),
        _mixture(out, kick, kick + kicks, kicks),
        _mixture(out, kick, kick + 3 * kicks, kicks),
        out[hit : hit + mixture * TACKLE_DIRECTIONS],
        out[caught : caught + spec[N_CATCH]],
        _mixture(out, move, move + moves, moves),
        _mixture(out, move, move + 3 * moves, moves),
    )
