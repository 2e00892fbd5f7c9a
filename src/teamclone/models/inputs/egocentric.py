"""Inputs in the actor's axes as a module: chosen blocks, normalised, made by the kernels of `engine.inputs`.

None of the blocks but ``role`` knows a player by its uniform number.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import torch
from torch import Tensor, nn

from teamclone.engine.inputs.layout import BLOCKS, PAST_FRAMES, SIDED, WIDTH, places
from teamclone.engine.inputs.project import Frames, project
from teamclone.models.inputs.geometry import InputLayout
from teamclone.models.inputs.paper import Normalisation
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.player_types import DEFAULTS
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.world.channels import CHANNEL, FLAG_ON_FIELD
from teamclone.world.mirror import mirror_state
from teamclone.world.state import State

CLIP = 10.0
"""Standard deviations to which inputs are limited, so that unseen values do no great harm."""


class EgocentricFeatures(nn.Module):
    """The columns of the chosen blocks, normalised and limited, then the other parts of `Inputs` as they are.

    Args:
        blocks: some of BLOCKS; ``core`` is always among the columns, and tackle and ways are with ``plan``.
        others: have OTHER of all OTHERS.

    Attributes:
        names: of all columns. n_inputs: how many of them are normalised. layout: where each part is.
    """

    signs: Tensor

    def __init__(self, blocks: tuple[str, ...] = BLOCKS, *, others: bool = False) -> None:
        super().__init__()
        self.others = others
        self.blocks = tuple(block for block in BLOCKS if block in blocks)
        self.history = PAST_FRAMES if "past" in blocks else 0
        self.channels = (
            *("x", "y", "vx", "vy", "body", "stamina", "effort", "recovery", "capacity", "type", "flags"),
            *(("neck", "view_width") if "view" in blocks else ()),
            *(("age",) if "age" in blocks else ()),
            "last_command",
        )
        widths = {name: WIDTH[name] for name in ("core", *self.blocks)}
        self.layout = InputLayout(columns=sum(widths.values()), others=others, plan="plan" in self.blocks)
        self.n_inputs = self.layout.columns
        self.names = (
            *(f"{name}_{i}" for name, width in widths.items() for i in range(width)),
            *self.layout.tail,
        )
        self.places, _ = places(self.blocks, others=others)
        self.normalisation = Normalisation(self.n_inputs)
        self.register_buffer("signs", self._signs(), persistent=False)

    def _signs(self) -> Tensor:
        """Return (len(names),) -1 for columns that change their sign where left and right are exchanged, else 1."""
        state = _any(self.history)
        plain, mirrored = self.project(state), self.project(mirror_state(state, torch.arange(N_PLAYERS)))
        turned = (plain + mirrored).abs().amax(0) < (plain - mirrored).abs().amax(0)
        # No player has the ball in these situations, so the columns of plans are zero.
        turned |= torch.tensor([name in SIDED for name in self.names])
        return torch.where(turned, -1.0, 1.0)

    def counterparts(self, places: Tensor) -> Tensor:
        """Return the column permutation of a left-right reflection, (len(names),); signs are in `signs`.

        Only the block ``role`` depends on ``places``.
        """
        order = list(range(len(self.names)))
        if "role" in self.blocks:
            first = self.names.index("role_0")
            order[first : first + N_TEAM] = (first + places[:N_TEAM]).tolist()
        return torch.tensor(order)

    def columns(self, blocks: tuple[str, ...]) -> list[int]:
        """Return the places of the columns of ``core`` and of some blocks."""
        return [i for i, name in enumerate(self.names[: self.n_inputs]) if name.rpartition("_")[0] in ("core", *blocks)]

    def project(self, state: State) -> Tensor:
        """Return (batch, len(names)) inputs before normalisation, made on the processor.

        Raises:
            ValueError: the state has fewer frames before it than the features read.
        """
        make = _operation if torch.compiler.is_exporting() else _made
        made: Tensor = make(list(state), self.places, len(self.names))
        return made

    def fit(self, chunks: Iterable[Tensor]) -> None:
        """Fit the normalisation to projected training samples, chunk by chunk."""
        self.normalisation.fit(chunk[:, : self.n_inputs] for chunk in chunks)
        # Columns that change their sign in the mirror must do so after normalisation, too.
        self.normalisation.mean[self.signs[: self.n_inputs] < 0] = 0.0

    def normalise(self, columns: Tensor) -> Tensor:
        """Return (batch, len(names)) normalised columns of `project`; GEOMETRY and the columns after it stay."""
        inputs, geometry = columns[:, : self.n_inputs], columns[:, self.n_inputs :]
        return torch.cat([self.normalisation(inputs).clamp(-CLIP, CLIP), geometry], dim=1)

    def forward(self, state: State) -> Tensor:
        """Return (batch, len(names)) normalised inputs."""
        return self.normalise(self.project(state))


def _made(state: Sequence[Tensor], places: Sequence[int], columns: int) -> Tensor:
    """Return (batch, columns) inputs of a state, on its device and of its type."""
    *frames, frame, actor = (part.cpu().numpy() for part in state)
    made, _ = project(Frames(*frames), frame, actor, places, columns)
    return torch.from_numpy(made).to(state[0])


@torch.library.custom_op("teamclone::inputs", mutates_args=())
def _operation(state: Sequence[Tensor], places: Sequence[int], columns: int) -> Tensor:
    """The inputs as an operation of PyTorch, so that an exported model can contain them; see `_made`."""
    return _made(state, places, columns)


@_operation.register_fake
def _(state: Sequence[Tensor], places: Sequence[int], columns: int) -> Tensor:
    return state[0].new_empty(state[-1].shape[0], columns)


def _any(history: int) -> State:
    """Return a few situations in which nothing is zero, equal or straight ahead."""
    random = torch.Generator().manual_seed(0)
    n, n_channels = 8, len(CHANNEL)

    def between(low: float, high: float, *shape: int) -> Tensor:
        return low + (high - low) * torch.rand(*shape, generator=random)

    players = between(-0.4, 0.4, n, 1 + history, N_PLAYERS, n_channels)
    for name, low, high in (("x", -50, 50), ("y", -30, 30), ("body", -170, 170), ("neck", -80, 80)):
        players[..., CHANNEL[name]] = between(low, high, n, 1 + history, N_PLAYERS)
    for name, value in (
        ("effort", 1.0),
        ("recovery", 1.0),
        ("flags", FLAG_ON_FIELD),
        ("last_command", CommandKind.DASH),
    ):
        players[..., CHANNEL[name]] = value
    players[..., CHANNEL["stamina"]] = between(2000, 8000, n, 1 + history, N_PLAYERS)
    ball = between(-1, 1, n, 1 + history, 4) * torch.tensor([50.0, 30.0, 1.0, 1.0])
    types = torch.tensor(list(DEFAULTS.values())).expand(n, N_PLAYERS, -1)
    state = State.now(
        ball=ball[:, 0], players=players[:, 0], types=types, actor=torch.arange(n), mode_cycles=torch.ones(n)
    )
    return state._replace(
        past_ball=ball[:, 1:], past_players=players[:, 1:], past_known=torch.ones(n, history, dtype=torch.bool)
    )
