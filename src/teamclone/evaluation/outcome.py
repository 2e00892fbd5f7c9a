"""``Outcome``: predictions beside what happened, as arrays. Everything in evaluation is computed from it."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Outcome:
    """One split of a dataset with a model's answers; n rows.

    Attributes:
        probabilities: (n, 4) over CLONED_KINDS.
        parameters: (n, 6) predicted PARAMETERS, in power and degrees.
        parameter_log_loss: (n,) -ln of the likelihood of the given command's parameters, nats, per unit of power and
            degree; NaN from what answers with points.
        kind: (n,) the command given, index into CLONED_KINDS.
        issued: (n, 6) PARAMETERS of the command given, in power and degrees; NaN for those of other commands.
        last: (n,) the player's last executed command as an index into CLONED_KINDS; -1 for none of them.
        match: (n,) index of the match.
        position: (n, 2) where the player stood, metres, his team attacking +x.
    """

    probabilities: NDArray[np.float32]
    parameters: NDArray[np.float32]
    parameter_log_loss: NDArray[np.float32]
    kind: NDArray[np.int64]
    issued: NDArray[np.float32]
    last: NDArray[np.int64]
    match: NDArray[np.int64]
    position: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.kind)

    def rows(self, index: NDArray[np.integer] | NDArray[np.bool_]) -> Outcome:
        """The outcome of some rows only, by boolean mask or by number."""
        return replace(self, **{field.name: getattr(self, field.name)[index] for field in fields(self)})
