"""A clone written for C++: header, weights, and a contract that says what goes in and what has to come out."""

from __future__ import annotations

import datetime
import hashlib
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.resources import as_file, files
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from teamclone import __version__
from teamclone.dataset.reader import open_dataset
from teamclone.engine.clone import CompiledClone
from teamclone.engine.inputs.layout import PAST_FRAMES, places
from teamclone.engine.inputs.project import Frames, project
from teamclone.engine.network.weights import read_weights, write_weights
from teamclone.errors import RunError, UsageError
from teamclone.export.header import VERSION, header
from teamclone.models.clone import Clone
from teamclone.models.packing import pack
from teamclone.rcss import player_types, server_params
from teamclone.rcss.commands import parameters_of
from teamclone.system.documents import read_document, write_document
from teamclone.system.files import write_atomic
from teamclone.training.run import Run
from teamclone.world.channels import CATEGORICAL, MEASURED, POSITION
from teamclone.world.state import State

FORMAT = 1
"""Format number of contract.json."""
HEADER, WEIGHTS, CONTRACT, CHECK = "teamclone.hpp", "weights.bin", "contract.json", "check.cpp"
"""Files of an export."""
SAMPLES = 200
"""States in a contract."""
FLAGS = ("-std=c++17", "-O2", "-ffp-contract=off")
"""With which the header is compiled. Contraction would round once where Python rounds twice."""
CLOSE = 5e-5
"""Largest difference of a probability to Python's."""
CLOSE_NUMBER = 0.01
"""Difference of a command's number, in power, degrees and metres, beyond which it counts as another one."""
FEW = 50
"""One in so many states may have another number: the single best one is the median of a mixture's components, and where
two of them are as good, the last digit decides."""
ARRAYS = {
    "ball": np.float32,
    "players": np.float32,
    "types": np.float32,
    "server": np.float32,
    "past_ball": np.float32,
    "past_players": np.float32,
    "past_known": np.uint8,
    "mode": np.int64,
    "mode_cycles": np.float32,
    "actor": np.int64,
}
"""Arrays of samples, in `world.state.State` of one frame a sample, and their types in files."""
Arrays = dict[str, NDArray[Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """How near the answers of a program are to those in the contract.

    Attributes:
        n: states. probability: largest difference. number: largest difference of a command's numbers, in power, degrees
            and metres. apart: states with a number that is farther off than CLOSE_NUMBER.
        median_us: microseconds of an answer, away from the ball and near it; NaN without such states.
    """

    n: int
    probability: float
    number: float
    apart: int
    median_us: tuple[float, float]

    @property
    def close(self) -> bool:
        """Whether they are as near as rounding lets them."""
        return self.probability <= CLOSE and self.apart <= max(1, self.n // FEW)


def write_export(run: Run, out: Path, *, checkpoint: str = "best-loss", n: int = SAMPLES) -> dict[str, Any]:
    """Write a run's clone for C++ into a folder, and return the contract.

    Args:
        out: a new folder, an empty one, or one of an export before, which is replaced.
        checkpoint: which weights. n: states in the contract.

    Raises:
        UsageError: the folder has other files.
        RunError: there is no such checkpoint, or a weight is not a finite number.
        DatasetError: the run's dataset is missing or damaged.
    """
    known = {HEADER, WEIGHTS, CONTRACT, CHECK}
    if out.exists() and (not out.is_dir() or not {path.name for path in out.iterdir()} <= known):
        raise UsageError(f"{out}: expected a new or an empty folder, or one of an export before; choose another one")
    model = run.load_model(checkpoint).cpu().eval()
    weights = pack(model)
    samples = samples_of(run, model, n)
    expected = pytorch_answers(model, samples)
    out.mkdir(parents=True, exist_ok=True)
    (out / CONTRACT).unlink(missing_ok=True)  # the last one written, so that what is there belongs together
    write_atomic(out / HEADER, header().encode())
    write_weights(out / WEIGHTS, weights)
    write_atomic(out / CHECK, files("teamclone.export").joinpath(CHECK).read_bytes())
    contract = {
        "format": FORMAT,
        "created": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "versions": {"teamclone": __version__, "torch": torch.__version__, "header": VERSION},
        "model_id": weights.model_id,
        "team": run.team,
        "checkpoint": checkpoint,
        "dataset": _dataset(run),
        "commands": list(model.config.commands),
        "parameters": [
            {"name": item.name, "command": item.kind.name.lower(), "number": item.argument, "limit": item.limit}
            for item in parameters_of(model.config.commands)
        ],
        "channels": [
            {"name": one.name, "unit": one.unit, "about": one.about} for one in (*POSITION, *MEASURED, *CATEGORICAL)
        ],
        "needs": {"channels": list(model.inputs.channels), "history": model.inputs.history},
        "type_fields": list(player_types.FIELDS),
        "server_fields": list(server_params.FIELDS),
        "files": {name: _sha256(out / name) for name in (HEADER, WEIGHTS)},
        "samples": {name: _listed(values) for name, values in samples.items()},
        "answers": {name: _listed(values) for name, values in expected.items()},
    }
    write_document(out / CONTRACT, contract)
    return contract


def check_export(folder: Path, *, compiler: str | None = None) -> dict[str, Comparison | None]:
    """Run the states of a contract again, and compare the answers.

    Args:
        compiler: of C++; None for g++ or clang++, whichever there is.

    Returns:
        The comparison with the kernels in Python, ``python``, and with the compiled header, ``cpp``; None for the
        latter where there is no compiler.

    Raises:
        RunError: the folder is no export or one of another version, a file is not the one that the contract names, or
            the header does not compile or run.
    """
    contract = read_document(
        folder / CONTRACT,
        what="an export",
        number=FORMAT,
        command="teamclone export",
        error=RunError,
        folder=folder,
        shape={
            "versions": {"teamclone": str},
            "files": {HEADER: str, WEIGHTS: str},
            "samples": dict,
            "answers": dict,
            "commands": [str],
        },
    )
    for name, digest in contract["files"].items():
        path = folder / name
        if not path.is_file() or _sha256(path) != digest:
            raise RunError(f"{path}: missing, or not the file of this contract; export again with `teamclone export`")
    if (folder / HEADER).read_text(encoding="utf-8") != header():
        # What is compiled and run here is what this version would write, nothing from elsewhere.
        raise RunError(
            f"{folder / HEADER}: not the header of this version of teamclone, the contract is of version "
            f"{contract['versions']['teamclone']}; export again with `teamclone export`, or check it with that version"
        )
    try:
        samples = {name: _unlisted(contract["samples"][name], kind) for name, kind in ARRAYS.items()}
        expected = {name: _unlisted(contract["answers"][name], np.float64) for name in ("near", "answers")}
    except (KeyError, TypeError, ValueError) as error:
        raise RunError(
            f"{folder / CONTRACT}: its states cannot be read ({error!r}); export again with `teamclone export`"
        ) from None
    found = next((name for name in (compiler, "g++", "clang++") if name and shutil.which(name)), None)
    made = compiled_answers(folder, samples, found) if found else None
    return {
        "python": compared(kernel_answers(folder, samples), expected, None),
        "cpp": None if made is None else compared(made[0], expected, made[1]),
    }


def samples_of(run: Run, model: Clone, n: int) -> Arrays:
    """Return states of the run's dataset, one in four of them with the ball near, as far as there are such."""
    data = open_dataset(run.dataset_path)
    random = np.random.default_rng(0)
    rows = random.choice(len(data), min(len(data), 40 * n), replace=False)
    state = data.state(rows, history=PAST_FRAMES).each()
    near = _near(state)
    order = random.permutation(len(rows))
    first = [order[near[order]][: n // 4], order[~near[order]]]
    chosen = np.sort(np.concatenate(first)[:n])
    part = state.select(torch.from_numpy(chosen)).each()
    data.need(model.inputs.channels, rows[chosen], history=model.inputs.history)
    return {name: getattr(part, name).contiguous().numpy().astype(kind) for name, kind in ARRAYS.items()}


def state_of(samples: Arrays) -> State:
    """Return samples as a state, of one frame each."""
    tensors = {name: torch.from_numpy(np.ascontiguousarray(values)) for name, values in samples.items()}
    tensors["past_known"] = tensors["past_known"].bool()
    return State(frame=torch.arange(len(tensors["actor"])), **tensors)


def _near(state: State) -> NDArray[np.bool_]:
    """Return which actors may reach the ball, as the header judges it."""
    *frames, frame, actor = (part.numpy() for part in state)
    return project(Frames(*frames), frame, actor, *places((), others=False))[1]


@torch.inference_mode()
def pytorch_answers(model: Clone, samples: Arrays) -> Arrays:
    """Return what PyTorch answers: (n,) who is near the ball, (n, commands, 3) probability and numbers of commands."""
    state = state_of(samples)
    near = _near(state)
    answer = model.answer(state, kick_rows=torch.from_numpy(np.flatnonzero(near)))
    parameters = answer.point().parameters.double().numpy()
    return {"near": near.astype(np.float64), "answers": _rows(model.config.commands, answer.probabilities, parameters)}


def _rows(commands: Sequence[str], probabilities: Any, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    made = np.zeros((len(parameters), len(commands), 3))
    made[..., 0] = probabilities
    for place, item in enumerate(parameters_of(tuple(commands))):
        made[:, list(commands).index(item.kind.name.lower()), 1 + item.argument] = parameters[:, place]
    return made


def kernel_answers(folder: Path, samples: Arrays) -> Arrays:
    """Return what the kernels answer in Python with the weights of an export."""
    clone = CompiledClone(read_weights(folder / WEIGHTS))
    *frames, frame, actor = (part.numpy() for part in state_of(samples))
    answers, near = clone.answers(Frames(*frames), frame, actor)
    parts = [clone.network.view(one) for one in answers]
    parameters = np.array([part.parameters for part in parts], np.float64)
    probabilities = np.array([part.probabilities for part in parts])
    return {"near": near.astype(np.float64), "answers": _rows(clone.commands, probabilities, parameters)}


def compiled_answers(folder: Path, samples: Arrays, compiler: str, repeats: int = 3) -> tuple[Arrays, NDArray[Any]]:
    """Return what the compiled header answers, and (n,) microseconds."""
    with tempfile.TemporaryDirectory() as place, as_file(files("teamclone.export").joinpath(CHECK)) as source:
        work = Path(place)
        command = [compiler, *FLAGS, "-I", str(folder.resolve()), str(source), "-o", str(work / "check")]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RunError(f"{folder / HEADER}: {compiler} does not compile it: {done.stderr.strip()[:2000]}")
        for name, values in samples.items():
            values.tofile(work / name)
        shutil.copyfile(folder / WEIGHTS, work / WEIGHTS)
        done = subprocess.run([str(work / "check"), place, str(repeats)], capture_output=True, text=True, check=False)
        if done.returncode:
            raise RunError(f"{folder}: the compiled header fails: {done.stderr.strip() or done.returncode}")
        n = len(samples["actor"])
        answered = np.fromfile(work / "answered").reshape(n, -1)
        statuses = np.fromfile(work / "statuses", np.int64)
        if statuses.any():
            raise RunError(
                f"{folder}: the header answers {int(np.count_nonzero(statuses))} of {n} states with an error"
            )
        micros = np.fromfile(work / "micros").reshape(n, repeats).min(1)
    return {"near": answered[:, 0], "answers": answered[:, 1:-4].reshape(n, -1, 3)}, micros


def compared(made: Arrays, expected: Arrays, micros: NDArray[Any] | None) -> Comparison:
    """Compare answers; ``micros`` (n,) are the microseconds that they took, None if nobody looked."""
    away = np.abs(made["answers"] - expected["answers"])
    away[..., 1:] = np.minimum(away[..., 1:], np.abs(away[..., 1:] - 360.0))  # degrees go round
    near = expected["near"] > 0
    times = [float(np.median(micros[part])) if micros is not None and part.any() else np.nan for part in (~near, near)]
    return Comparison(
        n=len(near),
        probability=float(away[..., 0].max()),
        number=float(away[..., 1:].max()),
        apart=int((away[..., 1:] > CLOSE_NUMBER).any((1, 2)).sum()),
        median_us=(times[0], times[1]),
    )


def _dataset(run: Run) -> dict[str, Any]:
    data = open_dataset(run.dataset_path)
    return {"id": data.meta["id"], "matches": [match["match_id"] for match in data.matches]}


def _listed(values: NDArray[Any]) -> dict[str, Any]:
    """Return an array as JSON: its shape, and its numbers, null for none."""
    if values.dtype.kind == "f":
        # As few digits as give the same number again.
        cells = [None if np.isnan(cell) else float(str(cell)) for cell in values.reshape(-1)]
    else:
        cells = values.reshape(-1).tolist()
    return {"shape": list(values.shape), "values": cells}


def _unlisted(listed: dict[str, Any], kind: Any) -> NDArray[Any]:
    cells = [np.nan if cell is None else cell for cell in listed["values"]]
    return np.array(cells, kind).reshape(listed["shape"])


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()
