"""What a network is built from. Free of PyTorch, so that a wrong setting is told at once."""

from __future__ import annotations

from dataclasses import dataclass

FEATURE_SETS = ("paper",)
"""Sets of inputs; the modules are `features.FEATURES`."""
ACTIVATIONS = ("relu", "gelu", "silu", "tanh")
"""Hidden activations."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelConfig:
    """What a network is built from; the paper's by default.

    Attributes:
        features: name of the set of inputs, see `FEATURE_SETS`.
        own_type: add the acting player's type (127 inputs instead of 119).
        all_types: groups of type parameters to add for all 22 players: movement, kick, stamina.
        hidden: widths of the hidden layers.
        activation: see `ACTIVATIONS`.
    """

    features: str = "paper"
    own_type: bool = False
    all_types: tuple[str, ...] = ()
    hidden: tuple[int, ...] = (512, 256, 128)
    activation: str = "relu"
