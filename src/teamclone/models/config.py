"""Model families and their settings. Free of PyTorch, so that a wrong setting is reported before it is loaded.

A family is a set of inputs, a trunk over them and a head. Each has one class of settings, whose defaults are those of
the preset that it is for: `paper` of `PaperConfig`, `best` of `EgocentricConfig`.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from itertools import pairwise
from typing import ClassVar

from teamclone.engine.inputs.layout import BLOCKS
from teamclone.engine.network.constants import ACTIVATIONS, ATTENTION_HEADS
from teamclone.rcss.commands import CLONED, REPERTOIRE, not_of_repertoire
from teamclone.rcss.player_types import GROUPS
from teamclone.system.settings import setting, without_effect

PARAMETER_LOSSES = ("paper", "masked")
"""Errors of the parameters that a point head learns by, see `loss.point_loss`."""
LOSS_SETTINGS = ("parameter_loss", "parameter_weight", "target_weight", "extra_kicks")
"""Settings of the families that only training uses; all others make the network what it is."""


MOST_WIDTH = 1 << 14
"""Units of a layer."""
MOST_LAYERS = 32
MOST_WEIGHTS = 1 << 28
"""Of the layers of a model: 1 GB, and three times as much in training. A slip of the pen asks for far more."""


def _attention(width: int) -> str | None:
    return f"a multiple of {ATTENTION_HEADS}, got {width}" if width % ATTENTION_HEADS else None


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelConfig:
    """Settings of all families.

    Attributes:
        hidden: widths of the hidden layers that decide on the command.
        activation: of the hidden layers.
        dropout: share of the hidden units left out at random in training.
        commands: what the model answers with, some of REPERTOIRE in their order: those of the datasets that it is for.
        ensemble_size: networks that learn side by side over the same inputs and answer together.
        parameter_weight: of the parameters' error beside that of the command, in training.
    """

    family: ClassVar[str]

    hidden: tuple[int, ...] = setting((512, 256, 128), at_least=1, at_most=MOST_WIDTH, some=True, most=MOST_LAYERS)
    activation: str = setting("relu", choices=ACTIVATIONS)
    dropout: float = setting(0.0, at_least=0, at_most=0.9)
    commands: tuple[str, ...] = setting(CLONED, choices=REPERTOIRE, rule=not_of_repertoire)
    ensemble_size: int = setting(1, at_least=1, at_most=1000)
    parameter_weight: float = setting(1.0, at_least=0)

    def problems(self, key: str) -> list[str]:
        """Return what is wrong between settings; see `system.settings.from_table`."""
        layers = [getattr(self, item.name) for item in fields(self) if item.name.endswith("hidden")]
        weights = self.ensemble_size * sum(before * width for widths in layers for before, width in pairwise(widths))
        if weights <= MOST_WEIGHTS:
            return []
        return [f"{key}: expected layers of at most {MOST_WEIGHTS:,} weights, got {weights:,}; make them narrower"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperConfig(ModelConfig):
    """The network of the paper: positions and velocities of the pitch, and a point head.

    Attributes:
        own_type: add the acting player's type (127 inputs instead of 119).
        all_types: groups of type parameters to add for all 22 players.
        parameter_loss: "paper": error of all six parameters, zero where not issued; "masked": of issued ones only.
    """

    family: ClassVar[str] = "paper"

    own_type: bool = setting(False)
    all_types: tuple[str, ...] = setting((), choices=tuple(GROUPS))
    parameter_loss: str = setting("paper", choices=PARAMETER_LOSSES)


@dataclass(frozen=True, slots=True, kw_only=True)
class EgocentricTrunkConfig(ModelConfig):
    """Settings of the families that see the pitch from the acting player.

    Attributes:
        blocks: inputs that decide on the command, see `inputs.egocentric.EgocentricFeatures`.
        target_points: places on the pitch that the network supposes a player to make for; see
            `layers.targets.TargetPoints`. 0 for none.
        target_hidden: widths of the layers that find them, if there are any.
    """

    blocks: tuple[str, ...] = setting(
        ("self", "role", "type", "last", "ball", "reach", "lines", "plan"), choices=BLOCKS
    )
    target_points: int = setting(6, at_least=0, at_most=1000)
    target_hidden: tuple[int, ...] = setting((512, 256), at_least=1, at_most=MOST_WIDTH, most=MOST_LAYERS)

    def problems(self, key: str) -> list[str]:
        """Return what is wrong between settings, and those that would have no effect."""
        found = ModelConfig.problems(self, key)
        if self.target_points:
            return found
        return found + without_effect(self, key, of_targets(type(self)), f"{key}.target_points = 0")


@dataclass(frozen=True, slots=True, kw_only=True)
class EgocentricPointConfig(EgocentricTrunkConfig):
    """Egocentric inputs with the point head of the paper.

    Attributes:
        parameter_loss: "paper": error of all six parameters, zero where not issued; "masked": of issued ones only.
    """

    family: ClassVar[str] = "egocentric-point"

    parameter_loss: str = setting("masked", choices=PARAMETER_LOSSES)


@dataclass(frozen=True, slots=True, kw_only=True)
class EgocentricConfig(EgocentricTrunkConfig):
    """Egocentric inputs, and a head that answers with a distribution of every parameter.

    Attributes:
        kick_blocks: inputs that decide where a kick goes.
        parameter_hidden: widths of the layers that find power and direction of dashes and turns.
        kick_hidden: widths of the layers that decide where a kick goes.
        kick_dropout: `dropout` of these, of which there are few examples.
        kick_attention: numbers by which these layers know each other player; see `layers.players.PlayerEncoder`.
            A multiple of ATTENTION_HEADS; 0 for no such layers.
        kick_candidates: width of the layers that score some hundred candidates of each kick, made by physics alone;
            see `engine.network.candidates`. 0 for none.
        target_weight: of the error by which turns teach the target points, if there are any, in training.
        extra_kicks: kicks and tackles shown beside each batch to the layers that find their parameters.
    """

    family: ClassVar[str] = "egocentric"

    kick_blocks: tuple[str, ...] = setting(("self", "type", "last", "ball", "reach", "lines", "plan"), choices=BLOCKS)
    parameter_hidden: tuple[int, ...] = setting((256, 128), at_least=1, at_most=MOST_WIDTH, some=True, most=MOST_LAYERS)
    kick_hidden: tuple[int, ...] = setting((512, 256), at_least=1, at_most=MOST_WIDTH, some=True, most=MOST_LAYERS)
    kick_dropout: float = setting(0.3, at_least=0, at_most=0.9)
    kick_attention: int = setting(64, at_least=0, at_most=4096, rule=_attention)
    kick_candidates: int = setting(0, at_least=0, at_most=1024)
    target_weight: float = setting(0.1, at_least=0)
    extra_kicks: int = setting(64, at_least=0, at_most=1 << 20)


def of_targets(family: type[ModelConfig]) -> tuple[str, ...]:
    """Return the settings of a family that have no effect without target points."""
    return tuple(item.name for item in fields(family) if item.name in ("target_hidden", "target_weight"))


FAMILIES: dict[str, type[ModelConfig]] = {
    one.family: one for one in (PaperConfig, EgocentricConfig, EgocentricPointConfig)
}
"""The families by their names, ``model.family`` of a run's settings."""
