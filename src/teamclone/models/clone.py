"""``Clone``: from the raw state to a command, features and normalisation inside."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any, cast

import torch
from torch import Tensor, nn

from teamclone.models.config import ModelConfig
from teamclone.models.heads.mixture import AtBall, EnsembleHead, MixtureHead, PointHead, Prediction, Situation
from teamclone.models.inputs.egocentric import EgocentricFeatures
from teamclone.models.inputs.paper import Features, PaperFeatures
from teamclone.models.layers.players import Crowd
from teamclone.models.layers.targets import COLUMNS, Aims, layers
from teamclone.world.state import State

_ACTIVATIONS: dict[str, type[nn.Module]] = {"relu": nn.ReLU, "gelu": nn.GELU, "silu": nn.SiLU, "tanh": nn.Tanh}


class AimedTrunk(nn.Module):
    """Hidden layers over relative inputs: where the player makes for, then what he does, how, and apart from it a kick.

    The layers of dashes and turns see what the command was decided on, but do not teach it, see `MixtureHead`.
    """

    command_columns: Tensor
    kick_columns: Tensor
    aim_columns: Tensor
    signs: Tensor

    def __init__(self, config: ModelConfig, features: EgocentricFeatures) -> None:
        super().__init__()
        activation = _ACTIVATIONS[config.activation]
        self.n_inputs = features.n_inputs
        for name, blocks in (
            ("command_columns", config.blocks),
            ("kick_columns", config.kick_blocks),
            ("aim_columns", ("role",) if "role" in config.blocks else ()),
        ):
            self.register_buffer(name, torch.tensor(features.columns(blocks)), persistent=False)
        self.register_buffer("signs", features.signs, persistent=False)
        self.aims = Aims(len(self.aim_columns), config.aims, config.aim_hidden, activation)
        seen = len(self.command_columns) + COLUMNS * config.aims
        self.command = layers((seen, *config.hidden), activation, config.dropout)
        self.answers = config.head == "mixture"
        if self.answers:
            self.parameters_of = layers(
                (seen + config.hidden[-1], *config.parameter_hidden), activation, config.dropout
            )
            self.kick = layers((len(self.kick_columns), *config.kick_hidden), activation, config.kick_dropout)
            width = config.kick_attention
            self.crowd = Crowd(width, config.kick_hidden[-1]) if width else None

    def forward(self, inputs: Tensor, *, kicks: Tensor | None = None) -> Situation:
        """``kicks``: which of the situations need the layers of a kick, (n,) places; None for all."""
        columns, geometry = inputs[:, : self.n_inputs], inputs[:, self.n_inputs :]
        aims, bearing, power = self.aims(columns.index_select(1, self.aim_columns), geometry)
        seen = torch.cat([columns.index_select(1, self.command_columns), aims], 1)
        hidden = self.command(seen)
        parameters, at_ball = hidden[:0], AtBall(hidden[:0], geometry[:0], None)
        if self.answers:
            parameters = self.parameters_of(torch.cat([seen, hidden], 1).detach())
            at_ball = self.at_ball(inputs if kicks is None else inputs.index_select(0, kicks))
        return Situation(hidden, parameters, at_ball, kicks, geometry, bearing, power)

    def at_ball(self, inputs: Tensor) -> AtBall:
        """What kicks and tackles hang on, which is nothing that the other layers find."""
        both = torch.cat([inputs, inputs * self.signs])
        kick, geometry, targets = self.kick(both.index_select(1, self.kick_columns)), both[:, self.n_inputs :], None
        if self.crowd is not None:
            together, targets = self.crowd(kick, geometry)
            kick = torch.cat([kick, together], 1)
        return AtBall(kick, geometry, targets)


class Trunks(nn.Module):
    """The trunks of an ensemble's members over the same inputs."""

    def __init__(self, members: Sequence[nn.Module]) -> None:
        super().__init__()
        self.members = nn.ModuleList(members)

    def forward(self, inputs: Tensor, **options: Any) -> list[Any]:
        return [member(inputs, **options) for member in self.members]

    def at_ball(self, inputs: Tensor) -> list[AtBall]:
        return [cast(AimedTrunk, member).at_ball(inputs) for member in self.members]


class Clone(nn.Module):
    """A network that plays like a team: which command a player gives in a situation, and with which parameters."""

    features: PaperFeatures | EgocentricFeatures
    trunk: nn.Sequential | AimedTrunk | Trunks
    head: PointHead | MixtureHead | EnsembleHead

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        if config.features == "paper":
            self.features = PaperFeatures(own_type=config.own_type, all_types=config.all_types)
        else:
            blocks = tuple({*config.blocks, *config.kick_blocks})
            self.features = EgocentricFeatures(blocks, others=bool(config.kick_attention))
        trunks = [_trunk(config, self.features) for _ in range(config.members)]
        heads = [_head(config) for _ in range(config.members)]
        self.trunk = trunks[0] if config.members == 1 else Trunks(trunks)
        self.head = heads[0] if config.members == 1 else EnsembleHead(heads)
        for module in self.modules():
            if isinstance(module, nn.Linear):
                # Keras' default, with which the paper trained.
                nn.init.xavier_uniform_(module.weight)
                nn.init.zeros_(module.bias)

    @property
    def inputs(self) -> Features:
        return cast(Features, self.features)

    def output(self, state: State, *, kicks: Tensor | None = None) -> Any:
        """What the head answers, for ``head.loss`` and ``head.point``; ``kicks`` as of `answer`."""
        return self.answer(self.features(state), kicks=kicks)

    def answer(self, inputs: Tensor, *, kicks: Tensor | None = None) -> Any:
        """The same from what the features make of a state, (batch, columns).

        Args:
            kicks: (n,) places of the situations of which to answer on kicks and tackles, too; None for all. Who knows
                where one was given saves most of the time by it. The paper's network answers all at once.
        """
        if kicks is None or self.config.head == "point":
            return self.head(self.trunk(inputs))
        return self.head(self.trunk(inputs, kicks=kicks))

    def kicks(self, inputs: Tensor) -> Any:
        """What a `MixtureHead` answers on kicks and tackles alone, for its ``kick_loss``."""
        head, trunk = cast(MixtureHead, self.head), cast(AimedTrunk, self.trunk)
        return head.kicks(trunk.at_ball(inputs))

    def forward(self, state: State) -> Prediction:
        return self.head.point(self.output(state))

    @torch.no_grad()
    def predict(self, state: State) -> tuple[Tensor, Tensor]:
        """Probabilities (batch, commands) and parameters (batch, parameters) in power, degrees and metres.

        Their order is that of ``config.commands`` and of its `parameters_of`; by default four and six.
        """
        prediction: Prediction = self(state)
        return prediction.logits.softmax(1), prediction.parameters


def _trunk(config: ModelConfig, features: PaperFeatures | EgocentricFeatures) -> nn.Sequential | AimedTrunk:
    if isinstance(features, EgocentricFeatures):
        return AimedTrunk(config, features)
    return layers((len(features.names), *config.hidden), _ACTIVATIONS[config.activation], config.dropout)


def _head(config: ModelConfig) -> PointHead | MixtureHead:
    if config.head == "mixture":
        return MixtureHead(
            width=config.hidden[-1],
            parameter_width=config.parameter_hidden[-1],
            kick_width=config.kick_hidden[-1] + config.kick_attention,
            target_width=config.kick_attention,
            planned="plan" in config.kick_blocks,
            aims=config.aims,
            commands=config.commands,
        )
    return PointHead(config.hidden[-1], config.commands)


def parameter_count(model: nn.Module) -> int:
    """Number of trained weights."""
    return sum(weights.numel() for weights in model.parameters())


def model_id(model: nn.Module) -> str:
    """A hash of the weights: whether numbers belong to this very model."""
    digest = hashlib.blake2b(digest_size=8)
    for name, tensor in sorted(model.state_dict().items()):
        digest.update(name.encode())
        digest.update(tensor.detach().cpu().contiguous().reshape(-1).view(torch.uint8).numpy().tobytes())
    return digest.hexdigest()
