"""``Clone``: from the raw state to a command, features and normalisation inside."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Sequence
from itertools import chain
from typing import Any, cast

import torch
from torch import Tensor, nn

from teamclone.engine.network.constants import TARGET_COLUMNS
from teamclone.errors import UsageError
from teamclone.models.answer import Answer, Prediction
from teamclone.models.config import (
    EgocentricConfig,
    EgocentricPointConfig,
    EgocentricTrunkConfig,
    ModelConfig,
    PaperConfig,
)
from teamclone.models.heads.ensemble import EnsembleHead
from teamclone.models.heads.mixture import MixtureHead
from teamclone.models.heads.point import PointHead
from teamclone.models.heads.trunk_output import KickFeatures, TrunkOutput
from teamclone.models.inputs.egocentric import EgocentricFeatures
from teamclone.models.inputs.paper import Features, Normalisation, PaperFeatures
from teamclone.models.layers.players import PlayerEncoder
from teamclone.models.layers.targets import TargetPoints, layers
from teamclone.models.loss import Balance, Loss, ParameterLoss
from teamclone.world.state import State, Target

LEAST_KICK_DEVIATION = 0.03
"""Of an input of kicks, in its deviations among all samples: so that no value is too great in single precision."""

_ACTIVATIONS: dict[str, type[nn.Module]] = {"relu": nn.ReLU, "gelu": nn.GELU, "silu": nn.SiLU, "tanh": nn.Tanh}


class EgocentricTrunk(nn.Module):
    """Hidden layers over egocentric inputs: target points, then the command, its parameters, and apart from it a kick.

    The layers of dashes and turns see the features of the command, but send no gradient back to them, see
    `MixtureHead`. In the family with a point head there are only target points and the layers of the command.

    Attributes:
        of_kicks: second normalisation of the inputs of kicks: among all samples the ball is far away, so that those
            near it hardly differ.
    """

    command_columns: Tensor
    kick_columns: Tensor
    target_columns: Tensor
    signs: Tensor

    def __init__(self, config: EgocentricTrunkConfig, features: EgocentricFeatures) -> None:
        super().__init__()
        activation = _ACTIVATIONS[config.activation]
        self.layout = features.layout
        for name, blocks in (
            ("command_columns", config.blocks),
            ("kick_columns", _kick_blocks(config)),
            ("target_columns", ("role",) if "role" in config.blocks else ()),
        ):
            self.register_buffer(name, torch.tensor(features.columns(blocks)), persistent=False)
        self.register_buffer("signs", features.signs, persistent=False)
        self.targets = TargetPoints(len(self.target_columns), config.target_points, config.target_hidden, activation)
        seen = len(self.command_columns) + TARGET_COLUMNS * config.target_points
        self.command = layers((seen, *config.hidden), activation, config.dropout)
        self.answers = isinstance(config, EgocentricConfig)
        if isinstance(config, EgocentricConfig):
            self.parameters_of = layers(
                (seen + config.hidden[-1], *config.parameter_hidden), activation, config.dropout
            )
            self.of_kicks = Normalisation(len(self.kick_columns))
            self.kick = layers((len(self.kick_columns), *config.kick_hidden), activation, config.kick_dropout)
            width = config.kick_attention
            self.players = PlayerEncoder(width, config.kick_hidden[-1]) if width else None

    def forward(self, packed: Tensor, *, kick_rows: Tensor | None = None) -> TrunkOutput:
        """Return features of the command and its parameters; ``kick_rows`` as in `Clone.answer_inputs`."""
        inputs = self.layout.unpack(packed)
        targets, bearing, power = self.targets(inputs.columns.index_select(1, self.target_columns), inputs.geometry)
        seen = torch.cat([inputs.columns.index_select(1, self.command_columns), targets], 1)
        hidden = self.command(seen)
        parameters, at_ball = hidden[:0], KickFeatures(hidden[:0], self.layout.unpack(packed[:0]), None)
        if self.answers:
            parameters = self.parameters_of(torch.cat([seen, hidden], 1).detach())
            at_ball = self.at_ball(packed if kick_rows is None else packed.index_select(0, kick_rows))
        return TrunkOutput(hidden, parameters, at_ball, kick_rows, inputs.geometry, bearing, power)

    def at_ball(self, packed: Tensor) -> KickFeatures:
        """Return the features of kicks and tackles; they share no weights with the layers of the command."""
        inputs, targets = self.layout.unpack(torch.cat([packed, packed * self.signs])), None
        kick = self.kick(self.of_kicks(inputs.columns.index_select(1, self.kick_columns)))
        if self.players is not None:
            together, targets = self.players(kick, inputs)
            kick = torch.cat([kick, together], 1)
        return KickFeatures(kick, inputs, targets)

    def fit_kicks(self, chunks: Iterable[Tensor]) -> None:
        """Fit ``of_kicks`` to normalised inputs of kicks and tackles, chunk by chunk."""
        self.of_kicks.fit(chunk.index_select(1, self.kick_columns) for chunk in chunks)
        # Columns that change their sign in the mirror must do so after normalisation, too.
        self.of_kicks.mean[self.signs[self.kick_columns] < 0] = 0.0
        self.of_kicks.std.clamp_(min=LEAST_KICK_DEVIATION)


class Trunks(nn.Module):
    """The trunks of an ensemble's members over the same inputs."""

    def __init__(self, members: Sequence[nn.Module]) -> None:
        super().__init__()
        self.members = nn.ModuleList(members)

    def forward(self, packed: Tensor, **options: Any) -> list[Any]:
        """Return the output of each member; ``options`` as in its ``forward``."""
        return [member(packed, **options) for member in self.members]

    def at_ball(self, packed: Tensor) -> list[KickFeatures]:
        """Return the features of kicks and tackles of each member."""
        return [cast(EgocentricTrunk, member).at_ball(packed) for member in self.members]


class Clone(nn.Module):
    """The clone of a team: from a state to the command that a player gives, and its parameters."""

    features: PaperFeatures | EgocentricFeatures
    trunk: nn.Sequential | EgocentricTrunk | Trunks
    head: PointHead | MixtureHead | EnsembleHead

    def __init__(self, config: ModelConfig) -> None:
        super().__init__()
        self.config = config
        self.features = _features(config)
        trunks = [_trunk(config, self.features) for _ in range(config.ensemble_size)]
        heads = [_head(config) for _ in range(config.ensemble_size)]
        self.trunk = trunks[0] if config.ensemble_size == 1 else Trunks(trunks)
        self.head = heads[0] if config.ensemble_size == 1 else EnsembleHead(heads)
        for module in self.modules():
            if isinstance(module, nn.Linear):
                # Keras' default, with which the paper trained.
                nn.init.xavier_uniform_(module.weight)
                nn.init.zeros_(module.bias)

    @property
    def perceives(self) -> bool:
        """Whether it knows situations as players believe them from what they saw, not as logs have them."""
        return "age" in self.inputs.channels

    def need_log_view(self, purpose: str) -> None:
        """Raise if the clone cannot do with situations as logs and full states have them.

        Raises:
            UsageError: it `perceives`. ``purpose`` is what it was wanted for.
        """
        if self.perceives:
            raise UsageError(
                f"this clone knows situations as players believe them, which {purpose} cannot give it yet; "
                "train one on a dataset made without --percepts"
            )

    @property
    def inputs(self) -> Features:
        """The inputs of the model, with their normalisation."""
        return cast(Features, self.features)

    def fit(self, chunks: Iterable[Tensor], of_kicks: Iterable[Tensor] = ()) -> None:
        """Fit the normalisation to projected training samples, chunk by chunk, (n, columns) each.

        Args:
            of_kicks: those of kicks and tackles alone, which families with an answer to them need; nothing is fitted to
                nothing.
        """
        self.inputs.fit(chunks)
        if not isinstance(self.config, EgocentricConfig):
            return
        given = iter(of_kicks)
        some = next(given, None)
        if some is None:
            return
        members = self.trunk.members if isinstance(self.trunk, Trunks) else [self.trunk]
        first, *others = (cast(EgocentricTrunk, member) for member in members)
        first.fit_kicks(self.inputs.normalise(chunk) for chunk in chain([some], given))
        for other in others:
            other.of_kicks.load_state_dict(first.of_kicks.state_dict())

    def answer(self, state: State, *, kick_rows: Tensor | None = None) -> Answer:
        """Return the answer to a state; ``kick_rows`` as in `answer_inputs`."""
        return self.answer_inputs(self.features(state), kick_rows=kick_rows)

    def answer_inputs(self, inputs: Tensor, *, kick_rows: Tensor | None = None) -> Answer:
        """Return the answer to inputs that the features have made of a state.

        Args:
            inputs: (batch, columns) normalised.
            kick_rows: (n,) indices of the situations whose kicks and tackles are wanted; None for all. Leaving out the
                others saves most of the time. A point head always answers all.
        """
        if kick_rows is None or not isinstance(self.config, EgocentricConfig):
            answer: Answer = self.head(self.trunk(inputs))
        else:
            answer = self.head(self.trunk(inputs, kick_rows=kick_rows))
        return answer

    def loss(self, answer: Any, target: Target, *, balance: Balance | None = None, whole: Tensor | None = None) -> Loss:
        """Return the training error of an answer of this clone, by the weights of its family's settings.

        Args:
            target: what the players did. balance, whole: see `loss.point_loss`.
        """
        return self.head.loss(answer, target, balance=balance, whole=whole)

    def kick_loss(self, inputs: Tensor, target: Target, *, of: int) -> Tensor:
        """Return the weighted error of kicks and tackles alone, summed over the samples and divided by ``of``.

        Args:
            inputs: (batch, columns) normalised. target: kicks and tackles only.
        """
        head, trunk = cast(MixtureHead, self.head), cast(EgocentricTrunk, self.trunk)
        return self.config.parameter_weight * head.kick_loss(head.kick_answers(trunk.at_ball(inputs)), target, of=of)

    def forward(self, state: State) -> Prediction:
        """Return the likeliest answer to a state."""
        return self.answer(state).point()

    @torch.no_grad()
    def predict(self, state: State) -> tuple[Tensor, Tensor]:
        """Return probabilities (batch, commands) and parameters (batch, parameters) in power, degrees and metres.

        Their order is that of ``config.commands`` and of its `parameters_of`; by default four and six.
        """
        prediction: Prediction = self(state)
        return prediction.logits.softmax(1), prediction.parameters


def _features(config: ModelConfig) -> PaperFeatures | EgocentricFeatures:
    if isinstance(config, PaperConfig):
        return PaperFeatures(own_type=config.own_type, all_types=config.all_types)
    config = cast(EgocentricTrunkConfig, config)
    others = isinstance(config, EgocentricConfig) and max(config.kick_attention, config.kick_candidates) > 0
    return EgocentricFeatures(tuple({*config.blocks, *_kick_blocks(config)}), others=others)


def _kick_blocks(config: EgocentricTrunkConfig) -> tuple[str, ...]:
    return config.kick_blocks if isinstance(config, EgocentricConfig) else ()


def _trunk(config: ModelConfig, features: PaperFeatures | EgocentricFeatures) -> nn.Sequential | EgocentricTrunk:
    if isinstance(features, EgocentricFeatures):
        return EgocentricTrunk(cast(EgocentricTrunkConfig, config), features)
    return layers((len(features.names), *config.hidden), _ACTIVATIONS[config.activation], config.dropout)


def _head(config: ModelConfig) -> PointHead | MixtureHead:
    if isinstance(config, PaperConfig | EgocentricPointConfig):
        return PointHead(
            config.hidden[-1],
            config.commands,
            parameter_loss=cast(ParameterLoss, config.parameter_loss),
            parameter_weight=config.parameter_weight,
        )
    config = cast(EgocentricConfig, config)
    return MixtureHead(
        width=config.hidden[-1],
        parameter_width=config.parameter_hidden[-1],
        kick_width=config.kick_hidden[-1] + config.kick_attention,
        target_width=config.kick_attention,
        planned="plan" in config.kick_blocks,
        candidates=config.kick_candidates,
        candidate_dropout=config.kick_dropout,
        target_points=config.target_points,
        commands=config.commands,
        parameter_weight=config.parameter_weight,
        target_weight=config.target_weight,
    )


def parameter_count(model: nn.Module) -> int:
    """Return the number of trained weights."""
    return sum(weights.numel() for weights in model.parameters())


def model_id(model: nn.Module) -> str:
    """Return a hash of the weights, by which figures are known to belong to this model."""
    digest = hashlib.blake2b(digest_size=8)
    for name, tensor in sorted(model.state_dict().items()):
        digest.update(name.encode())
        digest.update(tensor.detach().cpu().contiguous().reshape(-1).view(torch.uint8).numpy().tobytes())
    return digest.hexdigest()
