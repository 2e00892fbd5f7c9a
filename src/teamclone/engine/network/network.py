"""A network for Python: its weights, and room for an answer."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone import planner
from teamclone.engine import network
from teamclone.engine.inputs import layout
from teamclone.engine.network.answer import answer
from teamclone.engine.network.draw import UNIFORMS, likeliest, sample
from teamclone.engine.network.result import Answer, view
from teamclone.engine.network.spec import INPUTS, N_OUT, Floats, Ints
from teamclone.engine.network.weights import Weights
from teamclone.planner.scene import Array
from teamclone.rcss import commands, pitch
from teamclone.system import compiling
from teamclone.system.compiling import cached_kernel, tell_when_compiled, version_of


def _compiled() -> tuple[Any, Any]:
    """Return kernels that answer many inputs, and that draw commands from many answers."""
    version = version_of(network, layout, planner, commands, pitch, compiling)

    @cached_kernel(nogil=True, error_model="numpy")
    def answer_all(values: Floats, spec: Ints, packed: Floats, with_ball: NDArray[np.bool_], out: Floats) -> int:
        for index in range(len(packed)):
            answer(values, spec, packed[index], with_ball[index], out[index])
        return version

    @cached_kernel(nogil=True, error_model="numpy")
    def sample_all(spec: Ints, out: Floats, uniforms: Array, drawn: Ints, numbers: Array) -> int:
        for index in range(len(out)):
            drawn[index] = sample(spec, out[index], uniforms[index], numbers[index])
        return version

    return answer_all, sample_all


_answer_all, _sample_all = _compiled()
tell_when_compiled({_answer_all: "compiling the layers of networks, once (about a minute)"})


class Network:
    """A network that answers one situation at a time, or many. It has room for one answer: use it from one thread.

    Attributes:
        weights: what it is made of. commands: the command set, in the order of the answers.
        last: the answer to one situation. Each call of `answer` fills its arrays anew: copy what is to stay.
    """

    def __init__(self, weights: Weights) -> None:
        self.weights, self.commands = weights, weights.commands
        self._packed, self._asked = np.zeros((1, weights.spec[INPUTS]), np.float32), np.zeros(1, np.bool_)
        self._out = np.zeros((1, weights.spec[N_OUT]), np.float32)
        self._uniforms, self._drawn, self._numbers = np.zeros((1, UNIFORMS)), np.zeros(1, np.int64), np.zeros((1, 2))
        self.last = self.view(self._out[0])

    def view(self, out: Floats) -> Answer:
        """Return the parts of one of `answers` by their names, without copying them."""
        parts: Answer = view.py_func(self.weights.spec, out)
        return parts

    def answer(self, packed: NDArray[np.floating], *, with_ball: bool = True) -> Answer:
        """Answer one situation.

        Args:
            packed: (inputs,) before normalisation.
            with_ball: answer kicks and tackles, too, for an actor that may reach the ball; it takes most of the time.

        Returns:
            `last`.

        Raises:
            ValueError: the network has another number of inputs.
        """
        if packed.shape != self._packed.shape[1:]:
            raise ValueError(f"expected {self._packed.shape[1:]} inputs, got {packed.shape}")
        self._packed[0], self._asked[0] = packed, with_ball
        _answer_all(self.weights.values, self.weights.spec, self._packed, self._asked, self._out)
        return self.last

    def answers(self, packed: NDArray[np.floating], *, with_ball: NDArray[np.bool_] | None = None) -> Floats:
        """Return (n, N_OUT) the answers to many situations; `view` names the parts of each.

        Args:
            packed: (n, inputs) before normalisation. with_ball: (n,) see `answer`; None for all.

        Raises:
            ValueError: the network has another number of inputs, or there are not as many flags as situations.
        """
        given = np.ascontiguousarray(packed, np.float32)
        asked = np.ones(len(given), np.bool_) if with_ball is None else np.ascontiguousarray(with_ball)
        if given.shape[1:] != self._packed.shape[1:] or asked.shape != given.shape[:1]:
            raise ValueError(
                f"expected (n, {self._packed.shape[1]}) inputs and (n,) flags, got {given.shape} and {asked.shape}"
            )
        out = np.zeros((len(given), self._out.shape[1]), np.float32)
        _answer_all(self.weights.values, self.weights.spec, given, asked, out)
        return out

    def likeliest(self) -> str:
        """Return the most probable command of the last answer, of those that were asked for."""
        command: int = likeliest.py_func(self.last)
        return self.commands[command]

    def sample(self, uniforms: NDArray[np.floating]) -> tuple[str, tuple[float, float]]:
        """Return a command drawn from the last answer, and its two numbers, 0 for those that it lacks.

        Args:
            uniforms: (UNIFORMS,) random numbers, see there.
        """
        self._uniforms[0] = uniforms
        _sample_all(self.weights.spec, self._out, self._uniforms, self._drawn, self._numbers)
        first, second = self._numbers[0].tolist()
        return self.commands[self._drawn[0]], (first, second)

    def samples(self, answers: Floats, uniforms: Array) -> tuple[Ints, Array]:
        """Return (n,) commands drawn from answers, their places in ``commands``, and (n, 2) their numbers.

        Args:
            answers: (n, N_OUT) as from `answers`. uniforms: (n, UNIFORMS) random numbers, see there.
        """
        drawn, numbers = np.zeros(len(answers), np.int64), np.zeros((len(answers), 2))
        _sample_all(self.weights.spec, answers, np.ascontiguousarray(uniforms, np.float64), drawn, numbers)
        return drawn, numbers
