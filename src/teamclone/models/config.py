"""What a network is built from. Free of PyTorch, so that a wrong setting is told at once."""

from __future__ import annotations

from dataclasses import dataclass

from teamclone.rcss.commands import CLONED

FEATURE_SETS = ("paper", "relative")
"""Sets of inputs; the modules are `inputs.paper.PaperFeatures` and `inputs.egocentric.EgocentricFeatures`."""
BLOCKS = (
    "self", "role", "type", "last", "view", "ball", "reach", "lines", "plan", "mates", "opponents", "rivals", "past",
    "mode",
)  # fmt: skip
"""Blocks of the relative inputs, in the order of their columns; see `inputs.egocentric.EgocentricFeatures`."""
HEADS = ("point", "mixture")
"""Forms of the answer: the paper's point, or a distribution of every parameter."""
ATTENTION_HEADS = 4
"""Heads of attention in `layers.players.PlayerEncoder`."""
ACTIVATIONS = ("relu", "gelu", "silu", "tanh")
"""Hidden activations."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelConfig:
    """What a network is built from; the paper's by default.

    Attributes:
        features: name of the set of inputs, see `FEATURE_SETS`.
        own_type: add the acting player's type (127 inputs instead of 119). Only of the paper's inputs.
        all_types: groups of type parameters to add for all 22 players: movement, kick, stamina. Only of the paper's.
        blocks: blocks that decide on the command, see `BLOCKS`. Only of the relative inputs, as all that follows.
        kick_blocks: blocks that decide where a kick goes.
        aims: places on the pitch that the network supposes a player to make for; see `layers.targets.TargetPoints`.
        aim_hidden: widths of the layers that find them.
        parameter_hidden: widths of the layers that find power and direction of dashes and turns.
        kick_hidden: widths of the layers that decide where a kick goes.
        kick_dropout: `dropout` of these, of which there are few examples.
        kick_attention: numbers by which each other player is known to these; see `layers.players.PlayerEncoder`.
            A multiple of ATTENTION_HEADS; 0 for no such layers.
        hidden: widths of the hidden layers.
        activation: see `ACTIVATIONS`.
        dropout: share of the hidden units left out at random in training.
        head: see `HEADS`; mixture needs the relative inputs.
        commands: what it answers with, some of REPERTOIRE in their order: those of the datasets that it is for.
        members: networks that learn side by side over the same inputs and answer together.
    """

    features: str = "paper"
    own_type: bool = False
    all_types: tuple[str, ...] = ()
    blocks: tuple[str, ...] = ()
    kick_blocks: tuple[str, ...] = ()
    aims: int = 0
    aim_hidden: tuple[int, ...] = ()
    parameter_hidden: tuple[int, ...] = ()
    kick_hidden: tuple[int, ...] = ()
    kick_dropout: float = 0.0
    kick_attention: int = 0
    hidden: tuple[int, ...] = (512, 256, 128)
    activation: str = "relu"
    dropout: float = 0.0
    head: str = "point"
    commands: tuple[str, ...] = CLONED
    members: int = 1
