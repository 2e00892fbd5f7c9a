"""``Predictions``: a model's answers beside the true commands, as arrays; the input of all figures."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.rcss.commands import CLONED, parameters_of


@dataclass(frozen=True, slots=True, kw_only=True)
class Predictions:
    """One split of a dataset with a model's answers; n rows.

    Attributes:
        probabilities: (n, commands).
        parameters: (n, parameters) predicted `parameters_of` the commands, in power, degrees and metres.
        parameter_log_loss: (n,) -ln of the likelihood of the given command's parameters, nats, per unit of power and
            degree, square metre of a move; NaN from heads without a density, and of commands without parameters.
        kind: (n,) the command given, index into ``commands``.
        issued: (n, parameters) those of the command given; NaN for those of other commands, and where a
            recovered command's is not known.
        last: (n,) the player's last executed command as an index into ``commands``; -1 for none of them.
        match: (n,) index of the match.
        position: (n, 2) the actor's position, metres, its team attacking +x.
        mode: (n,) the PlayMode as if the actor's team were the left one; None where all is play_on.
        commands: some of REPERTOIRE.
    """

    probabilities: NDArray[np.float32]
    parameters: NDArray[np.float32]
    parameter_log_loss: NDArray[np.float32]
    kind: NDArray[np.int64]
    issued: NDArray[np.float32]
    last: NDArray[np.int64]
    match: NDArray[np.int64]
    position: NDArray[np.float32]
    mode: NDArray[np.int64] | None = None
    commands: tuple[str, ...] = CLONED

    def __len__(self) -> int:
        return len(self.kind)

    def rows(self, index: NDArray[np.integer] | NDArray[np.bool_]) -> Predictions:
        """Return the outcome of some rows only, by boolean mask or by number."""
        columns = {field.name: getattr(self, field.name) for field in fields(self)}
        some: dict[str, Any] = {name: of[index] for name, of in columns.items() if isinstance(of, np.ndarray)}
        return replace(self, **some)


def issued_parameters(
    kind: NDArray[np.integer], arguments: NDArray[np.float32], known: NDArray[np.bool_], commands: tuple[str, ...]
) -> NDArray[np.float32]:
    """Return (n, parameters) `Predictions.issued`.

    Args:
        kind: (n,) indices into ``commands``, -1 for none of them. arguments, known: (n, 2) of each command, and
            whether anything is known of them.
    """
    items = parameters_of(commands)
    issued = np.full((len(kind), len(items)), np.nan, np.float32)
    for column, parameter in enumerate(items):
        carries = (kind == commands.index(parameter.kind.name.lower())) & known[:, parameter.argument]
        issued[carries, column] = arguments[carries, parameter.argument]
    return issued
