"""The class `Clone` of the header: the answers of the kernels in Python, whatever the network and the state."""

from __future__ import annotations

import subprocess
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from tests.cpp import CHECKED, QUICK, compiled, run
from tests.situations import situations
from tests.unit.engine.network.test_answer import MODELS, varied

from teamclone.engine.clone import CompiledClone
from teamclone.engine.inputs.layout import PAST_FRAMES
from teamclone.engine.inputs.project import Frames
from teamclone.engine.network.draw import point_of
from teamclone.engine.network.weights import Weights, write_weights
from teamclone.export.contract import ARRAYS, CHECK, WEIGHTS
from teamclone.export.entries import ENTRIES
from teamclone.export.header import header
from teamclone.export.translate import check_kernels
from teamclone.models.packing import pack
from teamclone.rcss.server_params import SERVER_FIELD
from teamclone.world.channels import CHANNEL, FLAG_GOALIE, FLAG_ON_FIELD
from teamclone.world.state import State

OK, NO_SUCH_PLAYER, OTHER_RULES = 0, 8, 9
"""Values of `Status`."""
ODD = (0.0, 1e-30, 1e30, -1e30, 1e9, -1e9, 50.0, -50.0, 1000.0, np.nan, np.inf, -np.inf)


def odd_state(n: int) -> State:
    """Situations with missing players, goalkeepers, and numbers that no log should hold."""
    random = np.random.default_rng(5)
    state = situations(n, seed=9, history=PAST_FRAMES)
    flags = state.players[..., CHANNEL["flags"]]
    flags[torch.from_numpy(random.random(flags.shape) < 0.2)] = 0.0
    flags[:, 0] += FLAG_GOALIE * (flags[:, 0] > 0)
    for part in (state.ball, state.players, state.types, state.past_players):
        cells = part.reshape(n, -1)
        for row in range(0, n, 2):
            for place in random.integers(0, cells.shape[1], 3):
                cells[row, place] = random.choice(ODD)
    return state


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Callable[[tuple[str, ...]], Path]:
    """The program of the check, each compiled once."""
    made: dict[tuple[str, ...], Path] = {}
    text = header()

    def of(flags: tuple[str, ...]) -> Path:
        if flags not in made:
            source = Path(str(files("teamclone.export").joinpath(CHECK)))
            made[flags] = compiled(tmp_path_factory.mktemp("clone"), text, "check", source=source, flags=flags)
        return made[flags]

    return of


def written(folder: Path, state: State, weights: Weights) -> None:
    """Write what the program reads."""
    write_weights(folder / WEIGHTS, weights)
    for name, kind in ARRAYS.items():
        getattr(state, name).contiguous().numpy().astype(kind).tofile(folder / name)


def answered(
    program: Path, folder: Path, state: State, weights: Weights
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the statuses, and (n, ...) near, then probability and numbers of each command, then the drawn ones."""
    written(folder, state, weights)
    run(program, str(folder), "1")
    return np.fromfile(folder / "statuses", np.int64), np.fromfile(folder / "answered").reshape(len(state.actor), -1)


def by_python(state: State, weights: Weights) -> NDArray[np.float64]:
    """The same of the kernels in Python."""
    clone = CompiledClone(weights)
    network = clone.network
    *frames, frame, actor = (part.numpy() for part in state)
    rows = []
    for index in range(len(actor)):
        answer = clone.answer(Frames(*frames), int(actor[index]), frame=int(frame[index]))
        row = []
        for place in range(len(clone.commands)):
            numbers = np.zeros(2)
            point_of.py_func(network.weights.spec, answer, place, numbers)
            row += [float(answer.probabilities[place]), *numbers]
        likeliest = clone.commands.index(network.likeliest())
        drawn, numbers = network.sample(np.array([0.3, 0.6, 0.2, 0.9, 0.5]))
        rows.append([*row, likeliest, clone.commands.index(drawn), *numbers])
    return np.array(rows)


def assert_close(made: NDArray[np.float64], expected: NDArray[np.float64]) -> None:
    """Probabilities to 1e-5, numbers to a thousandth: medians may hang on the last digit of a share."""
    away = np.abs(made - expected)
    assert away[:, :-3:3].max() < 1e-5
    assert np.minimum(away, np.abs(away - 360.0)).max() < 1e-3


def test_the_kernels_obey_the_rules() -> None:
    assert check_kernels(ENTRIES) == []


@pytest.mark.parametrize(
    "name",
    ["paper of all inputs and commands", "three papers of all commands", "point", "mixture", "move", "all", "two"],
)
def test_every_family_answers_as_in_python(program: Callable[..., Path], name: str, tmp_path: Path) -> None:
    weights, state = pack(varied(MODELS[name])), situations(60, seed=4, history=PAST_FRAMES)
    statuses, made = answered(program(QUICK), tmp_path, state, weights)
    assert (statuses == OK).all()
    assert 0 < made[:, 0].sum() <= 60
    assert_close(made[:, 1:], by_python(state, weights))


@pytest.mark.parametrize("name", ["paper", "all"])
def test_odd_states_end_in_an_answer_or_a_status(program: Callable[..., Path], name: str, tmp_path: Path) -> None:
    weights, state = pack(varied(MODELS[name])), odd_state(150)
    statuses, made = answered(program(CHECKED), tmp_path, state, weights)
    there = state.players[torch.arange(150), state.actor, CHANNEL["flags"]].long() & FLAG_ON_FIELD != 0
    assert set(statuses.tolist()) == {OK, NO_SUCH_PLAYER}
    assert (statuses[~there.numpy()] == NO_SUCH_PLAYER).all()
    sound = np.isfinite(made).all(1) & (statuses == OK)
    sound[::2] = False  # numbers without a meaning
    some = state.select(torch.from_numpy(np.flatnonzero(sound))).each()
    assert_close(made[sound, 1:], by_python(some, weights))


def test_random_bytes_do_no_harm(program: Callable[..., Path], tmp_path: Path) -> None:
    weights, state = pack(varied(MODELS["all"])), situations(200, history=PAST_FRAMES)
    state, random = state._replace(server=state.server.clone()), np.random.default_rng(11)
    for part in (state.ball, state.players, state.types, state.server, state.past_ball, state.past_players):
        noise = random.integers(0, 256, (*part.shape, 4), np.uint8).view(np.float32)[..., 0]
        some = random.random(part.shape) < 0.03
        part[torch.from_numpy(some)] = torch.from_numpy(noise[some])
    state.players[..., CHANNEL["flags"]] = FLAG_ON_FIELD
    statuses, _ = answered(program(CHECKED), tmp_path, state, weights)
    assert {OK, OTHER_RULES} >= set(statuses.tolist())


def test_other_rules_are_refused_where_kicks_are_planned(program: Callable[..., Path], tmp_path: Path) -> None:
    state = situations(4, history=PAST_FRAMES)
    state = state._replace(server=state.server.clone())
    state.server[1, SERVER_FIELD["ball_speed_max"]] = 2.7
    for name, expected in (("plan", [OK, OTHER_RULES, OK, OK]), ("mixture", [OK] * 4)):
        assert answered(program(QUICK), tmp_path, state, pack(varied(MODELS[name])))[0].tolist() == expected


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda data: b"", "no weights of a network"),
        (lambda data: b"PK" + data[2:], "no weights of a network"),
        (lambda data: data[:8] + b"\7\0\0\0" + data[12:], "another format"),
        (lambda data: data[:-1], "damaged"),
        (lambda data: data[:5000] + bytes([data[5000] ^ 1]) + data[5001:], "damaged"),
    ],
)
def test_other_files_are_refused(
    program: Callable[..., Path], tmp_path: Path, change: Callable[[bytes], bytes], words: str
) -> None:
    written(tmp_path, situations(1, history=PAST_FRAMES), pack(varied(MODELS["mixture"])))
    path = tmp_path / WEIGHTS
    path.write_bytes(change(path.read_bytes()))
    done = subprocess.run([program(CHECKED), str(tmp_path), "1"], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert words in done.stderr
