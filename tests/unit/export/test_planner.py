"""Plans in C++: equal to those of Numba to the bit, on real situations and odd ones, with scratch memory to spare."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from tests.cpp import CHECKED, QUICK, compiled, run
from tests.planned import plans_of
from tests.situations import situations

from teamclone.dataset.build import DatasetConfig, build_dataset
from teamclone.dataset.reader import open_dataset
from teamclone.export.entries import ENTRIES, MEMORY_BYTES
from teamclone.export.translate import translate
from teamclone.planner.columns import PLAN
from teamclone.planner.kick_sequences import DIRECTIONS, ORDER_FIELDS, PAIRS, kick_order
from teamclone.planner.scene import COLUMNS, ROWS, fill_scene
from teamclone.rcss.commands import CLONED_KINDS, CommandKind
from teamclone.store import create_store
from teamclone.store.ingest import ingest
from teamclone.world.channels import CHANNEL, FLAG_GOALIE
from teamclone.world.state import State

Parts = tuple[np.ndarray, ...]
"""What `plan` is given: ball, players, types, server, actor."""
ODD = (0.0, 1.0, -1.0, 1e-300, 1e300, -1e300, 1e9, -1e9, 1e-9, 50.0, -50.0, 180.0, 1000.0, np.nan, np.inf, -np.inf)


def parts_of(state: State) -> Parts:
    each = state.each()
    return tuple(part.numpy() for part in (each.ball, each.players, each.types, each.server, each.actor))


def scenes(ball: np.ndarray, players: np.ndarray, types: np.ndarray, server: np.ndarray) -> np.ndarray:
    made = np.zeros((len(ball), ROWS, COLUMNS))
    for index, scene in enumerate(made):
        fill_scene(ball[index], players[index], types[index], server[index], scene)
    return made


def plans(*parts: np.ndarray) -> np.ndarray:
    """Return the plans by Numba."""
    *_, server, actor = parts
    return plans_of(scenes(*parts[:4]), actor, server)


@pytest.fixture(scope="module")
def real(samples_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Parts:
    """Kicks and tackles of a real match."""
    folder = tmp_path_factory.mktemp("real")
    store = create_store(folder / "store")
    ingest([samples_dir / "20261122113747-WEBase_1-vs-HELIOS_base_8.rcg.xz"], store)
    build_dataset(DatasetConfig(teams=("HELIOS_base",)), store=store, out=folder / "dataset")
    data = open_dataset(folder / "dataset")
    kind = data.target(range(len(data))).kind
    wanted = [CLONED_KINDS.index(one) for one in (CommandKind.KICK, CommandKind.TACKLE)]
    return parts_of(data.state(torch.nonzero(torch.isin(kind, torch.tensor(wanted)))[:, 0].numpy()))


@pytest.fixture(scope="module")
def odd() -> Parts:
    """Situations at the ball with missing players, goalkeepers, and numbers that no log should hold."""
    random = np.random.default_rng(7)
    ball, players, types, server, actor = (part.copy() for part in parts_of(situations(600, seed=3)))
    ball, players, types, server = (part.astype(np.float64) for part in (ball, players, types, server))
    flags = players[..., CHANNEL["flags"]]
    flags[random.random(flags.shape) < 0.1] = 0.0
    flags[:, 11] += FLAG_GOALIE * (flags[:, 11] > 0)
    for part, cells in ((ball, 1), (players, 3), (types, 3), (server, 2)):
        for row in part.reshape(len(part), -1)[::2]:
            row[random.integers(0, len(row), cells)] = random.choice(ODD, cells)
        for row in part.reshape(len(part), -1)[1::3]:
            row[random.integers(0, len(row), cells)] *= random.normal(0, 3, cells)
    return ball, players, types, server, actor


@pytest.fixture(scope="module")
def header() -> str:
    return translate([entry for entry in ENTRIES if entry.name == "plan"], version="v1")


@pytest.fixture(scope="module")
def program(header: str, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Programs that plan, each compiled once."""
    made: dict[tuple[str, tuple[str, ...]], Path] = {}

    def of(compiler: str, flags: tuple[str, ...]) -> Path:
        key = compiler, flags
        if key not in made:
            folder = tmp_path_factory.mktemp("plans")
            made[key] = compiled(folder, header, "plans", compiler=compiler, flags=flags)
        return made[key]

    return of


def planned(program: Path, folder: Path, scene: np.ndarray, parts: Parts, memory: int) -> tuple[np.ndarray, int, int]:
    """Return the plans of scenes, the bytes of scratch memory that they took, and how many lacked some."""
    _, _, _, server, actor = parts
    servers, which = np.unique(server[:, ORDER_FIELDS].astype(np.float64), axis=0, return_inverse=True)
    with np.errstate(all="ignore"):
        orders = np.stack([kick_order(tuple(one)) for one in servers.tolist()])
    inputs = {
        "scenes": scene,
        "actors": actor.astype(np.int64),
        "which": which.reshape(-1).astype(np.int64),
        "orders": orders.astype(np.int64),
        "made": np.zeros((len(actor), len(PLAN))),
        "shapes": np.array([ROWS, COLUMNS, len(PLAN), DIRECTIONS, PAIRS]),
    }
    for name, cells in inputs.items():
        cells.tofile(folder / name)
    run(program, str(folder), str(memory))
    used, overflows = np.fromfile(folder / "used", np.int64)
    return np.fromfile(folder / "plans").reshape(-1, len(PLAN)), int(used), int(overflows)


def assert_equal(program: Path, folder: Path, parts: Parts) -> None:
    """Compare plans of C++ with those of Numba, bit by bit."""
    with np.errstate(all="ignore"):
        expected = plans(*parts)
        made, _, overflows = planned(program, folder, scenes(*parts[:4]), parts, MEMORY_BYTES)
    assert overflows == 0
    different = np.flatnonzero((made.view(np.int64) != expected.view(np.int64)).any(1))
    assert len(different) == 0, f"{len(different)} of {len(made)} differ, the first in row {different[0]}"
    assert (expected[:, 0] > 0).sum() > 50


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
def test_plans_of_real_matches_are_equal(
    program: Callable[..., Path], real: Parts, tmp_path: Path, compiler: str
) -> None:
    assert_equal(program(compiler, QUICK), tmp_path, real)


@pytest.mark.parametrize("flags", [QUICK, CHECKED], ids=["quick", "checked"])
def test_plans_of_odd_situations_are_equal(
    program: Callable[..., Path], odd: Parts, tmp_path: Path, flags: tuple[str, ...]
) -> None:
    assert_equal(program("g++", flags), tmp_path, odd)


def test_random_bytes_are_planned_on_without_a_fault(program: Callable[..., Path], odd: Parts, tmp_path: Path) -> None:
    """Not as they are, since a number that is none ends a plan at once: most bytes make huge or tiny numbers."""
    with np.errstate(all="ignore"):
        scene = scenes(*odd[:4])
    bytes_ = np.random.default_rng(1).integers(0, 256, (len(scene), ROWS * COLUMNS * 8), np.uint8)
    noise = np.nan_to_num(bytes_.view(np.float64).reshape(scene.shape), posinf=1e300, neginf=-1e300)
    where = np.random.default_rng(2).random(scene.shape) < 0.02
    scene[where] = noise[where]
    scene[:, :, 9] = 1.0  # all are on the pitch
    planned(program("g++", CHECKED), tmp_path, scene, odd, MEMORY_BYTES)


def test_scratch_memory_is_to_spare_and_its_end_is_reported(
    program: Callable[..., Path], real: Parts, tmp_path: Path
) -> None:
    parts = tuple(part[:40] for part in real)
    checked = program("g++", CHECKED)
    _, used, overflows = planned(checked, tmp_path, scenes(*parts[:4]), parts, MEMORY_BYTES)
    assert overflows == 0
    assert 10_000 < used < MEMORY_BYTES / 2
    made, _, overflows = planned(checked, tmp_path, scenes(*parts[:4]), parts, 20_000)
    assert overflows > 20
    assert len(made) == 40
