"""How a team lines up: its places at kick-offs, its goalkeeper, and which player types it gives to whom.

No command shows this: the moves before a match have no frame in its log, and a coach's substitutions are no player's.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset.layout import CATEGORICAL_INDEX
from teamclone.dataset.reader import Dataset
from teamclone.errors import RunError
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import OTHER_SIDE, PlayMode
from teamclone.system.documents import read_document, write_document
from teamclone.world.channels import FLAG_GOALIE
from teamclone.world.traits import ranks

FORMAT = 1
"""Format number of line_up.json."""
FILE = "line_up.json"
"""Its name in a run."""

TRAITS = (
    "dash_power_rate", "player_decay", "inertia_moment", "kickable_margin", "kick_rand", "stamina_inc_max",
    "extra_stamina", "effort_max", "top_speed",
)  # fmt: skip
"""What a coach may choose a type by: its parameters, and the speed that it reaches with full power."""
_LEAST_SPREAD = 0.02
"""Standard deviation of a rank below which no preference counts as sharper."""

_PLACES = [[float]]
_SHAPE = {
    "team": str,
    "goalkeeper": int,
    "own_kick_off": _PLACES,
    "other_kick_off": _PLACES,
    "traits": [str],
    "preferred": _PLACES,
    "spread": _PLACES,
    "matches": int,
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LineUp:
    """How a team lines up. Places are in metres, the team attacking +x; rows are the numbers 1 to 11.

    Attributes:
        team: its name in its logs.
        goalkeeper: number of the goalkeeper, 0 where the team has none.
        own_kick_off, other_kick_off: (11, 2) places of the players when the own or the other team kicks off.
        preferred, spread: (11, len(TRAITS)) mean and standard deviation of the rank of each player's type among those
            of its match by each trait, 0 the least and 1 the greatest.
        matches: from how many.
    """

    team: str
    goalkeeper: int
    own_kick_off: NDArray[np.float64]
    other_kick_off: NDArray[np.float64]
    preferred: NDArray[np.float64]
    spread: NDArray[np.float64]
    matches: int

    def types(self, types: NDArray[np.floating]) -> NDArray[np.int64]:
        """Return (11,) the type of each player, all different, that is most like those it had.

        Args:
            types: (n_types, len(player_types.FIELDS)) of the match to play, at least eleven.

        Raises:
            ValueError: there are fewer types than players.
        """
        from scipy.optimize import linear_sum_assignment  # takes half a second, which few need

        if len(types) < N_TEAM:
            raise ValueError(f"expected at least {N_TEAM} player types, got {len(types)}")
        rank = ranks(types, TRAITS)
        cost = (((rank[None] - self.preferred[:, None]) / self.spread[:, None]) ** 2).sum(axis=2)
        players, chosen = linear_sum_assignment(cost)
        made: NDArray[np.int64] = np.zeros(N_TEAM, np.int64)
        made[players] = chosen
        return made


def line_up_of(dataset: Dataset) -> LineUp | None:
    """Return how the team of a dataset lines up; None where the dataset has no kick-offs, as without set plays."""
    frames = {name: dataset.frames[name].numpy() for name in ("match", "playmode", "mode_cycles", "position")}
    codes = dataset.frames["categorical"].numpy()
    turned = np.array([match.get("side") == "right" for match in dataset.matches])
    mode = np.where(turned[frames["match"]], OTHER_SIDE[frames["playmode"]], frames["playmode"])
    places = []
    for kick_off in (PlayMode.KICK_OFF_L, PlayMode.KICK_OFF_R):
        begins = np.flatnonzero((mode == kick_off) & (frames["mode_cycles"] == 0))
        if not len(begins):
            return None
        places.append(np.median(frames["position"][begins, :N_TEAM].astype(np.float64), axis=0))
    first = np.unique(frames["match"], return_index=True)[1]
    goalie = (codes[first, :N_TEAM, CATEGORICAL_INDEX["flags"]] & FLAG_GOALIE) != 0
    keeper = int(goalie.sum(axis=0).argmax()) + 1 if goalie.any() else 0
    preferred, spread = _preferences(dataset, codes[first, :N_TEAM, CATEGORICAL_INDEX["type"]], frames["match"][first])
    return LineUp(
        team=str(dataset.meta["team"]),
        goalkeeper=keeper,
        own_kick_off=places[0],
        other_kick_off=places[1],
        preferred=preferred,
        spread=spread,
        matches=len(first),
    )


def _preferences(
    dataset: Dataset, given: NDArray[np.uint8], matches: NDArray[np.int32]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return (11, len(TRAITS)) mean and standard deviation of the traits of the types that the players were given.

    Args:
        given: (n, 11) types at the beginning of n matches. matches: (n,) their indices. Those whose log does not say
            are left out; where none says, all types are the same to every player.
    """
    had = [
        ranks(dataset.player_types[match].numpy(), TRAITS)[types]
        for match, types in zip(matches.tolist(), given, strict=True)
        if types.max() < dataset.player_types.shape[1]
    ]
    if not had:
        return np.zeros((N_TEAM, len(TRAITS))), np.ones((N_TEAM, len(TRAITS)))
    return np.mean(had, axis=0), np.maximum(np.std(had, axis=0), _LEAST_SPREAD)


def save_line_up(folder: Path, line_up: LineUp) -> None:
    """Write how a team lines up into the folder of a run."""
    write_document(
        folder / FILE,
        {
            "format": FORMAT,
            "team": line_up.team,
            "goalkeeper": line_up.goalkeeper,
            "own_kick_off": line_up.own_kick_off.round(2).tolist(),
            "other_kick_off": line_up.other_kick_off.round(2).tolist(),
            "traits": list(TRAITS),
            "preferred": line_up.preferred.round(4).tolist(),
            "spread": line_up.spread.round(4).tolist(),
            "matches": line_up.matches,
        },
    )


def read_line_up(folder: Path) -> LineUp:
    """Read how the team of a run lines up.

    Raises:
        RunError: there is no such file, it is of another format, or damaged.
    """
    document = read_document(
        folder / FILE,
        what="how a team lines up",
        number=FORMAT,
        command="teamclone train, from a dataset with set plays",
        error=RunError,
        folder=folder,
        again="train again",
        shape=_SHAPE,
    )
    arrays = {name: _array(folder / FILE, document, name) for name in ("preferred", "spread")}
    arrays |= {name: _array(folder / FILE, document, name) for name in ("own_kick_off", "other_kick_off")}
    if document["traits"] != list(TRAITS) or not 0 <= document["goalkeeper"] <= N_TEAM:
        raise RunError(f"{folder / FILE}: has traits or a goalkeeper that no team can have; train again")
    return LineUp(team=document["team"], goalkeeper=document["goalkeeper"], matches=document["matches"], **arrays)


def _array(path: Path, document: dict[str, Any], name: str) -> NDArray[np.float64]:
    columns = 2 if name.endswith("kick_off") else len(TRAITS)
    rows = document[name]
    if len(rows) != N_TEAM or any(len(row) != columns for row in rows):
        raise RunError(f"{path}: {name}: expected {N_TEAM} rows of {columns} numbers; train again")
    return np.array(rows, np.float64)
