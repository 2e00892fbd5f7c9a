from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch
from tests.synthetic import make_dataset

from teamclone.dataset.layout import (
    CATEGORICAL_INDEX,
    FORMAT,
    FRAME_ARRAYS,
    MEASURED_INDEX,
    MISSING,
    NO_CODE,
    SAMPLE_ARRAYS,
    Split,
)
from teamclone.dataset.reader import open_dataset
from teamclone.dataset.write import write_dataset
from teamclone.errors import DatasetError
from teamclone.rcss.commands import CLONED, REPERTOIRE, CommandKind
from teamclone.rcss.player_types import FIELDS
from teamclone.rcss.playmodes import PlayMode
from teamclone.world.channels import CHANNEL, PLAYER_CHANNELS, TYPE_FIELD


def tiny(folder: Path, **changes: np.ndarray) -> Path:
    """Two matches of one frame each; three samples."""
    frames = {array.name: np.zeros((2, *array.shape), array.dtype) for array in FRAME_ARRAYS}
    samples = {array.name: np.zeros((3, *array.shape), array.dtype) for array in SAMPLE_ARRAYS}
    frames["match"][:] = (0, 1)
    frames["ball"][1] = (1.5, -2.0, 0.25, -0.5)
    frames["position"][1, 7] = (-30.25, 12.5)
    frames["measured"][1, 7, MEASURED_INDEX["vx"]] = -1234
    frames["measured"][1, 7, MEASURED_INDEX["body"]] = -17999
    frames["measured"][1, 7, MEASURED_INDEX["stamina"]] = 31999
    frames["measured"][1, 7, MEASURED_INDEX["capacity"]] = 32650
    frames["categorical"][1, 7, CATEGORICAL_INDEX["type"]] = 2
    frames["categorical"][1, 7, CATEGORICAL_INDEX["last_command"]] = CommandKind.KICK
    frames["categorical"][1, 3, CATEGORICAL_INDEX["last_command"]] = CommandKind.CATCH
    frames["categorical"][0, 5, CATEGORICAL_INDEX["last_command"]] = NO_CODE
    frames["measured"][0, :, MEASURED_INDEX["neck"]] = MISSING
    samples["frame"][:] = (0, 1, 1)
    samples["player"][:] = (5, 7, 3)
    samples["kind"][:] = (0, 2, 1)
    samples["parameters"][1] = (80.0, -45.0)
    samples["split"][:] = (Split.TRAIN, Split.TEST, Split.TRAIN)
    for name, value in changes.items():
        (frames if name in frames else samples)[name] = value
    types = np.arange(2 * 3 * len(FIELDS), dtype=np.float32).reshape(2, 3, len(FIELDS))
    meta = {"team": "A", "matches": [{"match_id": name, "opponent": "B"} for name in "ab"]}
    return write_dataset(folder, frames=frames, samples=samples, player_types=types, meta=meta)


def test_rows_become_raw_states(tmp_path: Path) -> None:
    dataset = open_dataset(tiny(tmp_path / "ds"))
    rows = np.array([1, 0, 1])
    state = dataset.state(rows)
    assert (len(state.ball), state.frame.tolist()) == (2, [1, 0, 1])  # a frame of several samples comes once
    state = state.each()
    assert state.ball.tolist() == [[1.5, -2.0, 0.25, -0.5], [0] * 4, [1.5, -2.0, 0.25, -0.5]]
    assert state.actor.tolist() == [7, 5, 7]
    assert state.players.shape == (3, 22, len(PLAYER_CHANNELS))
    player = dict(zip(PLAYER_CHANNELS, state.players[0, 7].tolist(), strict=True))
    expected = {"x": -30.25, "y": 12.5, "vx": -0.1234, "body": -179.99, "stamina": 7999.75, "capacity": 130600.0}
    assert {name: player[name] for name in expected} == pytest.approx(expected, rel=1e-6)
    # Types: of match 1, type 2 for player 7 and type 0 for the others; of match 0, type 0.
    assert state.types[0, 7, 0] == (3 + 2) * len(FIELDS)
    assert state.types[0, 6, 0] == 3 * len(FIELDS)
    assert state.types[1, 7, TYPE_FIELD["player_decay"]] == TYPE_FIELD["player_decay"]
    target = dataset.target(rows)
    assert target.kind.tolist() == [2, 0, 2]
    assert target.parameters.tolist() == [[80, -45], [0, 0], [80, -45]]


def test_the_play_mode_is_seen_from_the_modelled_teams_side(tmp_path: Path) -> None:
    """Of two matches, the team on the right in the second."""
    make_dataset(tmp_path / "ds", frames_per_match=5)
    made = open_dataset(tmp_path / "ds")
    modes = [PlayMode.PLAY_ON, *[PlayMode.KICK_IN_L] * 3, PlayMode.GOAL_R]
    made.frames["playmode"][:10] = torch.tensor(modes * 2)
    made.frames["mode_cycles"][:10] = torch.tensor([0, 0, 1, 5, 0, 0, 0, 1, 2, 0])
    made.meta["matches"][1]["side"] = "right"
    rows = np.array([10 * frame for frame in range(10)])
    state = made.state(rows)
    right = [PlayMode.PLAY_ON, *[PlayMode.KICK_IN_R] * 3, PlayMode.GOAL_L]
    assert state.mode.tolist() == [*modes, *right]
    assert state.mode_cycles.tolist() == [0, 0, 1, 5, 0, 0, 0, 1, 2, 0]
    assert made.mode(rows).tolist() == state.mode.tolist()


def test_further_commands(tmp_path: Path) -> None:
    assert open_dataset(make_dataset(tmp_path / "four", frames_per_match=1)).commands == CLONED
    dataset = open_dataset(make_dataset(tmp_path / "all", frames_per_match=30, commands=REPERTOIRE))
    assert dataset.commands == REPERTOIRE
    assert set(dataset.samples["kind"].tolist()) == set(range(7))
    # What was done last: CommandKind ids, 0 for nothing.
    kinds = dataset.frames["categorical"][dataset.samples["frame"].long(), dataset.samples["player"].long()]
    last = dataset.last_kind(np.arange(len(dataset)))
    expected = {0: "none", **{CommandKind[name.upper()]: name for name in REPERTOIRE[:-1]}}
    assert [REPERTOIRE[index] for index in last] == [
        expected[kind] for kind in kinds[:, CATEGORICAL_INDEX["last_command"]].tolist()
    ]


@pytest.mark.parametrize("commands", [["dash"], [*CLONED, "none", "catch"], [*CLONED, "jump"]])
def test_commands_that_no_dataset_has_are_told(tmp_path: Path, commands: list[str]) -> None:
    folder = make_dataset(tmp_path / "ds", frames_per_match=1)
    document = json.loads((folder / "dataset.json").read_text())
    (folder / "dataset.json").write_text(json.dumps(document | {"commands": commands}))
    with pytest.raises(
        DatasetError, match="expected commands dash, turn, kick, tackle and then, in this order, some of"
    ):
        open_dataset(folder)


def test_what_the_log_lacks_is_nan(tmp_path: Path) -> None:
    state = open_dataset(tiny(tmp_path / "ds")).state(torch.tensor([0, 1]))
    assert state.players[0, :, CHANNEL["neck"]].isnan().all()
    assert not state.players[1].isnan().any()


CYCLES = np.array([5, 6, 7, 9, 10, 10, 11, 12, 13, 14])
"""Of one match and then, from the seventh frame on, of another: a gap, a stoppage, another match that goes on."""


def followed(folder: Path) -> Path:
    """Ten frames of two matches with a sample each; the ball lies at (place of the frame, cycle)."""
    frames = {array.name: np.zeros((10, *array.shape), array.dtype) for array in FRAME_ARRAYS}
    samples = {array.name: np.zeros((10, *array.shape), array.dtype) for array in SAMPLE_ARRAYS}
    frames["match"][6:] = 1
    frames["cycle"][:] = CYCLES
    frames["ball"][:, 0], frames["ball"][:, 1] = np.arange(10), CYCLES
    frames["position"][:, 3, 0] = -np.arange(10)
    frames["measured"][:, 3, MEASURED_INDEX["body"]] = 100 * np.arange(10)
    frames["measured"][2, 3, MEASURED_INDEX["neck"]] = MISSING
    samples["frame"][:] = np.arange(10)
    samples["player"][:] = 3
    meta = {"team": "A", "matches": [{"match_id": name, "opponent": "B"} for name in "ab"]}
    types = np.zeros((2, 1, len(FIELDS)), np.float32)
    return write_dataset(folder, frames=frames, samples=samples, player_types=types, meta=meta)


def test_history_is_the_cycles_before_in_the_same_match(tmp_path: Path) -> None:
    rows = np.array([9, 2, 0, 3, 4, 5, 6, 7])
    state = open_dataset(followed(tmp_path / "ds")).state(rows, history=2).each()
    known = {0: (0, 0), 2: (1, 1), 3: (0, 0), 4: (1, 0), 5: (0, 0), 6: (0, 0), 7: (1, 0), 9: (1, 1)}
    assert state.past_known.int().tolist() == [list(known[row]) for row in rows]
    assert state.past_ball.shape == (8, 2, 4)
    assert state.past_players.shape == (8, 2, 22, len(PLAYER_CHANNELS))
    for index, row in enumerate(rows):
        for back in range(2):
            # Where it is not known the past repeats the present.
            frame = row - back - 1 if known[row][back] else row
            assert state.past_ball[index, back].tolist() == [frame, CYCLES[frame], 0, 0]
            then = state.past_players[index, back]
            assert (then[3, CHANNEL["x"]], then[3, CHANNEL["body"]]) == (-frame, frame)
            assert bool(then[3, CHANNEL["neck"]].isnan()) == (frame == 2)
    assert state.ball[:, 0].tolist() == rows.tolist()


def test_no_history_unless_asked_for(tmp_path: Path) -> None:
    dataset = open_dataset(followed(tmp_path / "ds"))
    plain, asked = dataset.state(np.arange(10)), dataset.state(torch.arange(10), history=40)
    assert plain.past_ball.shape == (10, 0, 4)
    assert plain.past_players.shape == (10, 0, 22, len(PLAYER_CHANNELS))
    assert plain.past_known.shape == (10, 0)
    for name in ("ball", "types", "actor"):
        assert torch.equal(getattr(plain, name), getattr(asked, name))
    # However far back one looks, what is known was so many cycles before.
    row, back = asked.past_known.nonzero().T
    assert torch.equal(asked.past_ball[row, back, 1].long(), torch.from_numpy(CYCLES)[row] - back - 1)
    assert asked.past_known[9].nonzero()[:, 0].tolist() == [0, 1, 2]


def test_last_kind_is_the_actors_own_executed_command(tmp_path: Path) -> None:
    # Row 0: not in the log; row 1: kick; row 2: catch, which no clone predicts.
    assert open_dataset(tiny(tmp_path / "ds")).last_kind(np.arange(3)).tolist() == [-1, 2, -1]


def test_splits_and_matches(tmp_path: Path) -> None:
    dataset = open_dataset(tiny(tmp_path / "ds"))
    assert dataset.split(Split.TRAIN).tolist() == [0, 2]
    assert dataset.split(Split.TEST).tolist() == [1]
    assert dataset.split(Split.UNSEEN).tolist() == []
    assert dataset.match(np.array([2, 0])).tolist() == [1, 0]
    assert [match["match_id"] for match in dataset.matches] == ["a", "b"]


def test_id_follows_the_content(tmp_path: Path) -> None:
    same = open_dataset(tiny(tmp_path / "one")).id, open_dataset(tiny(tmp_path / "two")).id
    assert same[0] == same[1]
    other = open_dataset(tiny(tmp_path / "three", executed=np.array([True, False, False])))
    assert other.id != same[0]


def test_made_dataset_has_every_split(tmp_path: Path) -> None:
    dataset = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=20))
    assert [len(dataset.split(split)) for split in Split] == [200] * 4


@pytest.mark.parametrize(
    ("array", "value", "text"),
    [
        ("frame", np.array([0, 1, 2]), "samples/frame: expected 0..1, got 0..2"),
        ("player", np.array([0, 1, 11]), "samples/player: expected 0..10"),
        ("kind", np.array([0, 1, 4]), "samples/kind: expected 0..3"),
        ("match", np.array([0, 2]), "frames/match: expected 0..1"),
        ("ball", np.zeros((2, 3), np.float32), r"frames/ball: expected shape \(2, 4\)"),
        ("split", np.zeros(2), r"samples/split: expected shape \(3,\)"),
    ],
)
def test_writer_refuses_what_readers_could_not_gather(tmp_path: Path, array: str, value: np.ndarray, text: str) -> None:
    with pytest.raises(DatasetError, match=text):
        tiny(tmp_path / "ds", **{array: value})
    assert list(tmp_path.iterdir()) == []


def test_writer_does_not_touch_what_is_there(tmp_path: Path) -> None:
    tiny(tmp_path / "ds")
    with pytest.raises(DatasetError, match="already exists"):
        tiny(tmp_path / "ds")
    assert len(open_dataset(tmp_path / "ds")) == 3


def test_missing_foreign_or_other_format(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="nowhere: no such folder; make one with `teamclone dataset`"):
        open_dataset(tmp_path / "nowhere")
    with pytest.raises(DatasetError, match=r"not a dataset, it has no dataset\.json"):
        open_dataset(tmp_path)
    document = tiny(tmp_path / "ds") / "dataset.json"
    meta = json.loads(document.read_text())
    document.write_text(json.dumps(meta | {"format": 99}))
    with pytest.raises(DatasetError, match=f"dataset of format 99, this version reads {FORMAT}; make it again"):
        open_dataset(tmp_path / "ds")
    for text in ("{", "[]", "{}", "3"):
        document.write_text(text)
        with pytest.raises(DatasetError, match="not the description of a dataset"):
            open_dataset(tmp_path / "ds")


@pytest.mark.parametrize("name", ["frames/measured", "samples/kind", "player_types"])
def test_damaged_arrays(tmp_path: Path, name: str) -> None:
    path = tiny(tmp_path / "ds") / f"{name}.npy"
    whole = path.read_bytes()
    for length in (0, 5, 60, len(whole) - 1):
        path.write_bytes(whole[:length])
        with pytest.raises(DatasetError, match=r"\.npy: damaged"):
            open_dataset(tmp_path / "ds")
    np.save(path, np.zeros(7))
    with pytest.raises(DatasetError, match=r"\.npy: expected .*, got float64 \(7,\)"):
        open_dataset(tmp_path / "ds")
    path.unlink()
    with pytest.raises(DatasetError, match=r"\.npy: missing"):
        open_dataset(tmp_path / "ds")


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("samples/frame", 7, r"samples/frame: expected 0\.\.1, got 0\.\.7"),
        ("samples/frame", -1, r"samples/frame: expected 0\.\.1, got -1"),
        ("samples/player", 11, r"samples/player: expected 0\.\.10"),
        ("samples/kind", 4, r"samples/kind: expected 0\.\.3"),
        ("frames/match", 2, r"frames/match: expected 0\.\.1"),
        ("frames/categorical", 254, r"frames/categorical type: expected 0\.\."),
    ],
)
def test_indices_that_point_at_nothing(tmp_path: Path, name: str, value: int, words: str) -> None:
    path = tiny(tmp_path / "ds") / f"{name}.npy"
    values = np.load(path)
    values[-1] = value
    np.save(path, values)
    with pytest.raises(DatasetError, match=words):
        open_dataset(tmp_path / "ds")
