"""A match for JaSMIn, read back by the description of its format."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from teamclone.evaluation.match_columns import MatchColumns
from teamclone.logs import find_matches, read_match, read_pair
from teamclone.rcss import state_bits
from teamclone.rcss.playmodes import PlayMode
from teamclone.replay.jasmin import write_jasmin


@dataclass
class Body:
    type: int
    flags: int
    x: float
    y: float
    body: float
    neck: float | None
    stamina: float | None


@dataclass
class Frame:
    time: float
    mode: str
    score: tuple[int, int]
    ball: tuple[float, float] = (0.0, 0.0)
    players: dict[tuple[str, int], Body] = field(default_factory=dict)


@dataclass
class Read:
    head: list[str]
    params: dict[str, object] = field(default_factory=dict)
    types: dict[int, dict[str, float]] = field(default_factory=dict)
    teams: list[str] = field(default_factory=list)
    frames: list[Frame] = field(default_factory=list)


PLAYER = re.compile(r"([lrLR]) (\d+)( \d+)? (0x[0-9a-f]+) (\S+) (\S+) (\S+)(?: \(j (\S+)\))?(?: \(s (\S+)\))?")


def read(path: Path) -> Read:
    first, *lines = path.read_text(encoding="utf-8").split("\n")
    found, types = Read(first.split()), {}
    for line in lines:
        kind, _, rest = line.partition(" ")
        if kind == "EP":
            found.params = json.loads(rest)
        elif kind == "PT":
            number, _, text = rest.partition(" ")
            found.types[int(number)] = json.loads(text)
        elif kind == "T":
            found.teams = rest.split(" ")
        elif kind == "S":
            time, mode, left, right, *_ = rest.split(" ")
            found.frames.append(Frame(float(time), mode, (int(left), int(right))))
        elif kind == "b":
            x, y = rest.split(" ")
            found.frames[-1].ball = float(x), float(y)
        elif kind in "lrLR" and kind:
            match = PLAYER.fullmatch(line)
            assert match is not None, line
            who = match[1].lower(), int(match[2])
            assert (match[3] is not None) == match[1].isupper()
            if match[3]:
                types[who] = int(match[3])
            neck, stamina = (None if text is None else float(text) for text in match.group(8, 9))
            x, y, body = map(float, match.group(5, 6, 7))
            found.frames[-1].players[who] = Body(types[who], int(match[4], 16), x, y, body, neck, stamina)
        else:
            assert not line, line
    return found


def compare(path: Path, match: MatchColumns) -> Read:
    write_jasmin(path, match)
    found = read(path)
    assert found.head == ["RPL", "2D", "1"]
    assert len(found.frames) == len(match.frames["cycle"])
    assert len(found.types) == len(match.types["player_decay"])
    assert len(found.teams) == 4
    there = (match.players["state"] & state_bits.STAND) != 0
    for at, frame in enumerate(found.frames):
        assert frame.time == pytest.approx(0.1 * match.frames["cycle"][at])
        assert frame.mode == PlayMode(match.frames["playmode"][at]).name.lower()
        assert frame.score == (match.frames["left_score"][at], match.frames["right_score"][at])
        assert frame.ball == pytest.approx((match.frames["ball_x"][at], match.frames["ball_y"][at]), abs=0.006)
        assert len(frame.players) == there[at].sum()
        for (side, unum), body in frame.players.items():
            slot = unum - 1 + (0 if side == "l" else 11)
            values = {name: column[at, slot] for name, column in match.players.items()}
            assert (body.type, body.flags) == (values["type"], values["state"])
            assert (body.x, body.y, body.body) == pytest.approx((values["x"], values["y"], values["body"]), abs=0.006)
            assert (body.stamina is None) == np.isnan(values["stamina"])
            assert body.stamina is None or body.stamina == pytest.approx(values["stamina"], abs=0.51)
            assert (body.neck is None) == np.isnan(values["neck"])
    return found


def cut(columns: MatchColumns, n: int) -> MatchColumns:
    """The first frames of a match."""
    frames = {name: values[:n] for name, values in columns.frames.items()}
    return replace(columns, frames=frames, players={name: values[:n] for name, values in columns.players.items()})


def test_a_real_match(samples_dir: Path, tmp_path: Path) -> None:
    columns = MatchColumns.of(read_match(min(samples_dir.glob("*.rcg.xz"))))
    found = compare(tmp_path / "match.replay", cut(columns, 150))
    assert found.teams[:2] == [columns.left, columns.right]
    assert found.params["ball_decay"] == columns.params["ball_decay"]


def test_odd_matches(fixtures_dir: Path, tmp_path: Path) -> None:
    pairs = [pair for pair in find_matches([fixtures_dir]) if pair.rcg is not None]
    assert len(pairs) > 15
    for pair in pairs:
        compare(tmp_path / "match.replay", cut(MatchColumns.of(read_pair(pair)), 60))


def test_names_cannot_break_the_records(samples_dir: Path, tmp_path: Path) -> None:
    columns = MatchColumns.of(read_match(min(samples_dir.glob("*.rcg.xz"))))
    odd = replace(cut(columns, 3), left="a b\nS 1 play_on 9 9", right=None)
    found = compare(tmp_path / "match.replay", odd)
    assert found.teams[:2] == ["a_b_S_1_play_on_9_9", "nobody"]
