"""Binary game logs: versions 1, 2 and 3 of servers before 12, which later servers still write on request.

Big endian C structs with the padding of x86 (rcssserver `types.h`, `dispsender.cpp`). A record is an int16 mode and
the struct of that mode; frames are gathered by their offsets and decoded at once.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from teamclone.errors import LogError
from teamclone.logs import columns
from teamclone.logs.assemble import TeamMark, checked_type, final_teams, frame_columns, player_type_columns
from teamclone.logs.match import Columns, GameLog, Problem, Severity, empty_columns
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS
from teamclone.rcss.playmodes import PlayMode

COARSE = 16.0
"""Positions of versions 1 and 2 are whole sixteenths of a metre (SHOWINFO_SCALE)."""
FINE = 65536.0
"""Numbers of version 3 are fixed point with 16 fractional bits (SHOWINFO_SCALE2)."""

_SHOW, _MSG, _DRAW, _BLANK, _PLAYMODE, _TEAM, _TYPE, _SERVER, _PLAYER = range(1, 10)
"""Record modes."""

_TEAM_T = np.dtype([("name", "S16"), ("score", ">i2")])
_POS_T = np.dtype([(name, ">i2") for name in ("state", "side", "unum", "angle", "x", "y")])
_SHOWINFO_T = np.dtype(
    {
        "names": ["playmode", "teams", "pos", "time"],
        "formats": ["i1", (_TEAM_T, 2), (_POS_T, N_PLAYERS + 1), ">i2"],
        "offsets": [0, 2, 38, 314],
        "itemsize": 316,
    }
)
"""A frame of versions 1 and 2. ``pos`` 0 is the ball."""

_COUNTS = (
    CommandKind.KICK,
    CommandKind.DASH,
    CommandKind.TURN,
    CommandKind.SAY,
    CommandKind.TURN_NECK,
    CommandKind.CATCH,
    CommandKind.MOVE,
    CommandKind.CHANGE_VIEW,
)
_FIXED = ("x", "y", "vx", "vy", "body", "neck", "view_width")
_PLAYER_T = np.dtype(
    [
        ("state", ">i2"),
        ("type", ">i2"),
        *((name, ">i4") for name in _FIXED),
        ("view_quality", ">i2"),
        *((name, ">i4") for name in ("stamina", "effort", "recovery")),
        *((columns.counter_name(kind), ">i2") for kind in _COUNTS),
    ],
    align=True,
)
_SHORT_SHOWINFO_T2 = np.dtype(
    [("ball", ">i4", 4), ("players", _PLAYER_T, N_PLAYERS), ("time", ">i2")],
    align=True,
)
"""A frame of version 3."""


@dataclass(frozen=True, slots=True)
class _Parameters:
    """The places and scales of the parameters in a struct; built by ``_parameters``."""

    dtype: np.dtype[np.void]
    scales: dict[str, float]
    added_later: frozenset[str]
    """Took the place of spare fields: zero where the server did not know them, anything where a converter did not."""

    def unpack(self, content: bytes) -> dict[str, float]:
        row = np.frombuffer(content, self.dtype)[0]
        values = {name: float(row[name]) / scale for name, scale in self.scales.items()}
        return {name: value for name, value in values.items() if value or name not in self.added_later}

    def without_later(self, values: Mapping[str, float]) -> dict[str, float]:
        return {name: value for name, value in values.items() if name not in self.added_later}


_FORMATS = {"whole": (">i2", 1.0), "long": (">i4", 1.0), "fixed": (">i4", FINE)}


def _parameters(*groups: tuple[str, str], added_later: str = "") -> _Parameters:
    """Describe a struct by groups of (format, names in text logs); ``_`` is a value that text logs do not have."""
    fields: list[tuple[str, str]] = []
    scales: dict[str, float] = {}
    for kind, names in groups:
        code, scale = _FORMATS[kind]
        for name in names.split():
            if name == "_":
                fields.append((f"_{len(fields)}", code))
            else:
                fields.append((name, code))
                scales[name] = scale
    return _Parameters(np.dtype(fields, align=True), scales, frozenset(added_later.split()))


_TYPE_PARAMETERS = _parameters(
    ("whole", "id"),
    (
        "fixed",
        "player_speed_max stamina_inc_max player_decay inertia_moment dash_power_rate player_size kickable_margin "
        "kick_rand extra_stamina effort_max effort_min kick_power_rate foul_detect_probability "
        "catchable_area_l_stretch _ _ _ _ _ _ _",
    ),
    added_later="kick_power_rate foul_detect_probability catchable_area_l_stretch",
)
_SERVER_PARAMETERS = _parameters(
    (
        "fixed",
        "goal_width inertia_moment player_size player_decay player_rand player_weight player_speed_max "
        "player_accel_max stamina_max stamina_inc_max recover_init recover_dec_thr recover_min recover_dec effort_init "
        "effort_dec_thr effort_min effort_dec effort_inc_thr effort_inc kick_rand",
    ),
    ("whole", "team_actuator_noise"),
    (
        "fixed",
        "prand_factor_l prand_factor_r kick_rand_factor_l kick_rand_factor_r ball_size ball_decay ball_rand "
        "ball_weight ball_speed_max ball_accel_max dash_power_rate kick_power_rate kickable_margin control_radius _ "
        "maxpower minpower maxmoment minmoment maxneckmoment minneckmoment maxneckang minneckang visible_angle "
        "visible_distance wind_dir wind_force wind_ang wind_rand _ catchable_area_l catchable_area_w "
        "catch_probability",
    ),
    ("whole", "goalie_max_moves"),
    ("fixed", "ckick_margin offside_active_area_size"),
    (
        "whole",
        "wind_none wind_random say_coach_cnt_max say_coach_msg_size clang_win_size clang_define_win clang_meta_win "
        "clang_advice_win clang_info_win clang_mess_delay clang_mess_per_cycle half_time simulator_step send_step "
        "recv_step sense_body_step _ say_msg_size hear_max hear_inc hear_decay catch_ban_cycle slow_down_factor "
        "use_offside forbid_kick_off_offside",
    ),
    ("fixed", "offside_kick_margin audio_cut_dist quantize_step quantize_step_l _ _ _ _ _ _ _"),
    ("whole", "coach coach_w_referee old_coach_hear send_vi_step"),
    (
        "fixed",
        "slowness_on_top_for_left_team _ keepaway_length keepaway_width ball_stuck_area max_tackle_power "
        "max_back_tackle_power tackle_dist tackle_back_dist tackle_width",
    ),
    (
        "whole",
        "start_goal_l start_goal_r fullstate_l fullstate_r drop_ball_time synch_mode synch_offset synch_micro_sleep "
        "point_to_ban point_to_duration",
    ),
    added_later="ball_stuck_area max_tackle_power max_back_tackle_power tackle_dist tackle_back_dist tackle_width",
)
"""The second ``slowness_on_top`` is skipped: the server stores the left team's value there."""
_PLAYER_PARAMETERS = _parameters(
    ("whole", "player_types subs_max pt_max"),
    (
        "fixed",
        "player_speed_max_delta_min player_speed_max_delta_max stamina_inc_max_delta_factor player_decay_delta_min "
        "player_decay_delta_max inertia_moment_delta_factor dash_power_rate_delta_min dash_power_rate_delta_max "
        "player_size_delta_factor kickable_margin_delta_min kickable_margin_delta_max kick_rand_delta_factor "
        "extra_stamina_delta_min extra_stamina_delta_max effort_max_delta_factor effort_min_delta_factor",
    ),
    ("long", "random_seed"),
    (
        "fixed",
        "new_dash_power_rate_delta_min new_dash_power_rate_delta_max new_stamina_inc_max_delta_factor "
        "kick_power_rate_delta_min kick_power_rate_delta_max foul_detect_probability_delta_factor "
        "catchable_area_l_stretch_min catchable_area_l_stretch_max _",
    ),
    ("whole", "allow_mult_default_type _ _ _ _ _ _ _ _ _"),
    added_later="new_dash_power_rate_delta_min new_dash_power_rate_delta_max new_stamina_inc_max_delta_factor "
    "kick_power_rate_delta_min kick_power_rate_delta_max foul_detect_probability_delta_factor "
    "catchable_area_l_stretch_min catchable_area_l_stretch_max",
)
_PLAUSIBLE = {
    "kick_power_rate": (0.001, 0.1),
    "foul_detect_probability": (0.0, 1.0),
    "catchable_area_l_stretch": (1.0, 10.0),
}
"""Bounds of the later parameters of a type; values outside them are garbage from a converter's memory."""

_DRAWINFO_SIZE = 74
_SIZES: dict[int, dict[int, int]] = {
    2: {_SHOW: _SHOWINFO_T.itemsize, _DRAW: _DRAWINFO_SIZE, _BLANK: 0},
    3: {
        _SHOW: _SHORT_SHOWINFO_T2.itemsize,
        _DRAW: _DRAWINFO_SIZE,
        _BLANK: 0,
        _PLAYMODE: 1,
        _TEAM: 2 * _TEAM_T.itemsize,
        _TYPE: _TYPE_PARAMETERS.dtype.itemsize,
        _SERVER: _SERVER_PARAMETERS.dtype.itemsize,
        _PLAYER: _PLAYER_PARAMETERS.dtype.itemsize,
    },
}
"""Bytes of a record behind its mode, by version; messages carry their own length."""
_PLAYMODES = frozenset(int(mode) for mode in PlayMode)
_V1_RECORD = 2052
"""Every record of version 1, its mode included."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Record:
    """``frame`` is the index of the frame that follows, ``start`` and ``stop`` bound the bytes behind the mode."""

    mode: int
    frame: int
    start: int
    stop: int


@dataclass(slots=True, kw_only=True)
class _Records:
    """A binary log cut into records: offsets of the frames, the other records that say something one by one.

    ``complete`` is whether a message has the result.
    """

    shows: list[int] = field(default_factory=list)
    others: list[_Record] = field(default_factory=list)
    complete: bool = False
    problems: list[Problem] = field(default_factory=list)

    def take(self, data: bytes, *, mode: int, start: int, stop: int) -> None:
        """Take in the record whose bytes behind the mode these are."""
        if mode == _SHOW:
            self.shows.append(start)
        elif mode == _MSG:
            self.complete = self.complete or data.find(b"(result ", start, stop) >= 0
        elif mode not in (_DRAW, _BLANK):
            # The last play mode before a frame is the one that holds.
            record = _Record(mode=mode, frame=len(self.shows), start=start, stop=stop)
            last = self.others[-1] if self.others else None
            if mode == _PLAYMODE and last is not None and (last.mode, last.frame) == (mode, record.frame):
                self.others.pop()
            self.others.append(record)


def read_binary(data: bytes, *, path: Path | None = None) -> GameLog:
    """Read a game log of version 1, 2 or 3.

    Args:
        data: the decompressed file from its first byte.
        path: named in errors and problems.

    Raises:
        LogError: it does not begin like such a log, or there is not one whole frame.
    """
    if data[:3] == b"ULG":
        version = data[3] if len(data) > 3 else 0
        if version not in (2, 3):
            raise LogError(f"expected binary log version 2 or 3, got {version}", path=path, byte=3)
    elif len(data) >= 2 and struct.unpack_from(">h", data)[0] in (_SHOW, _MSG, _DRAW, _BLANK):
        version = 1
    else:
        raise LogError("expected a binary game log; its first bytes are of no known version", path=path, byte=0)
    records = _cut_fixed(data, path=path) if version == 1 else _cut(data, version=version, path=path)
    if not records.shows:
        raise LogError(f"holds no frame: expected records of binary version {version}", path=path)
    if version == 3:
        game = _decode_fine(data, records, path=path)
    else:
        game = _decode_coarse(data, records, version=version, path=path)
    # Version 1 has no header: two bytes of anything can look like one, but hardly the names as well.
    for name in (game.left.name, game.right.name):
        if name is not None and not (name.isascii() and name.isprintable()):
            raise LogError(f"expected a binary game log, but a team's name would be {name!r}", path=path, byte=0)
    return game


def _cut_fixed(data: bytes, *, path: Path | None) -> _Records:
    """Cut version 1: records of one length."""
    found = _Records()
    for start in range(0, len(data) - _V1_RECORD + 1, _V1_RECORD):
        mode = struct.unpack_from(">h", data, start)[0]
        if mode in (_SHOW, _MSG, _DRAW, _BLANK):
            found.take(data, mode=mode, start=start + 2, stop=start + _V1_RECORD)
        else:
            found.problems.append(_unknown(mode, path=path, byte=start))
    if len(data) % _V1_RECORD:
        found.problems.append(_truncated(data, path=path, byte=len(data) - len(data) % _V1_RECORD))
    return found


def _cut(data: bytes, *, version: int, path: Path | None) -> _Records:
    """Cut versions 2 and 3: a record's mode gives its length."""
    found = _Records()
    position = 4
    while position < len(data):
        begin, start = position, position + 2
        size: int | None = None
        if start <= len(data):
            mode = struct.unpack_from(">h", data, begin)[0]
            if mode == _MSG:
                size = 4 + struct.unpack_from(">H", data, start + 2)[0] if start + 4 <= len(data) else len(data)
            elif (size := _SIZES[version].get(mode)) is None:
                # Without the length of this record the next one cannot be found.
                found.problems.append(_unknown(mode, path=path, byte=begin))
                break
        if size is None or start + size > len(data):
            found.problems.append(_truncated(data, path=path, byte=begin))
            break
        found.take(data, mode=mode, start=start, stop=start + size)
        position = start + size
    return found


def _unknown(mode: int, *, path: Path | None, byte: int) -> Problem:
    text = f"unknown record mode {mode}; the rest of the file cannot be read and is left out"
    return Problem(code="bad-record", severity=Severity.ERROR, text=text, path=path, byte=byte)


def _truncated(data: bytes, *, path: Path | None, byte: int) -> Problem:
    text = f"the last record is cut off after {len(data) - byte} bytes; it is left out"
    return Problem(code="truncated", severity=Severity.WARNING, text=text, path=path, byte=byte)


def _gather(data: bytes, offsets: list[int], dtype: np.dtype[np.void]) -> NDArray[np.void]:
    """Return the structs at these offsets, shape (n,)."""
    windows = np.lib.stride_tricks.sliding_window_view(np.frombuffer(data, np.uint8), dtype.itemsize)
    structs: NDArray[np.void] = windows[offsets].view(dtype)[:, 0]
    return structs


def _decode_coarse(data: bytes, records: _Records, *, version: int, path: Path | None) -> GameLog:
    shows = _gather(data, records.shows, _SHOWINFO_T)
    players = empty_columns(columns.PLAYERS, len(shows), N_PLAYERS)
    pos = shows["pos"][:, 1:]
    players["state"][:] = pos["state"].astype(np.uint16)
    players["body"][:] = pos["angle"]
    for axis in ("x", "y"):
        players[axis][:] = pos[axis] / COARSE
    ball = shows["pos"][:, 0]
    modes: list[tuple[int, int]] = []
    for frame, mode in enumerate(shows["playmode"].tolist()):
        _add_mode(modes, frame, mode)
    teams: list[TeamMark] = []
    for frame, pair in enumerate(shows["teams"].tolist()):
        _add_team(teams, frame, pair)
    return _log(
        version,
        records,
        cycle=shows["time"],
        ball=np.stack([ball["x"], ball["y"]], axis=1) / COARSE,
        players=players,
        modes=modes,
        teams=teams,
        path=path,
    )


def _decode_fine(data: bytes, records: _Records, *, path: Path | None) -> GameLog:
    shows = _gather(data, records.shows, _SHORT_SHOWINFO_T2)
    found = shows["players"]
    players = empty_columns(columns.PLAYERS, len(shows), N_PLAYERS)
    players["state"][:] = found["state"].astype(np.uint16)
    for name in ("type", "view_quality", *(columns.counter_name(kind) for kind in _COUNTS)):
        players[name][:] = found[name]
    for name in ("x", "y", "vx", "vy", "stamina", "effort", "recovery"):
        players[name][:] = found[name] / FINE
    for name in ("body", "neck", "view_width"):
        players[name][:] = np.degrees(found[name] / FINE)
    modes: list[tuple[int, int]] = []
    teams: list[TeamMark] = []
    types: dict[int, dict[str, float]] = {}
    params: dict[int, dict[str, float]] = {_SERVER: {}, _PLAYER: {}}
    for record in records.others:
        content = data[record.start : record.stop]
        if record.mode == _PLAYMODE:
            _add_mode(modes, record.frame, content[0])
        elif record.mode == _TEAM:
            _add_team(teams, record.frame, np.frombuffer(content, _TEAM_T).tolist())
        elif record.mode == _TYPE:
            try:
                number, fields = checked_type(_TYPE_PARAMETERS.unpack(content))
            except ValueError as error:
                text = f"record left out: {error}"
                records.problems.append(
                    Problem(code="bad-record", severity=Severity.WARNING, text=text, path=path, byte=record.start)
                )
            else:
                types[number] = fields
        elif record.mode == _SERVER:
            params[_SERVER] = _SERVER_PARAMETERS.unpack(content)
        elif record.mode == _PLAYER:
            params[_PLAYER] = _PLAYER_PARAMETERS.unpack(content)
    if not all(
        low <= fields.get(name, low) <= high for fields in types.values() for name, (low, high) in _PLAUSIBLE.items()
    ):
        types = {number: _TYPE_PARAMETERS.without_later(fields) for number, fields in types.items()}
        params[_PLAYER] = _PLAYER_PARAMETERS.without_later(params[_PLAYER])
        text = "parameters of player types younger than version 3 are not set; the server's defaults stand for them"
        records.problems.append(Problem(code="unset-parameters", severity=Severity.NOTE, text=text, path=path))
    return _log(
        3,
        records,
        cycle=shows["time"],
        ball=shows["ball"] / FINE,
        players=players,
        modes=modes,
        teams=teams,
        path=path,
        types=types,
        server_params=params[_SERVER],
        player_params=params[_PLAYER],
    )


def _add_mode(modes: list[tuple[int, int]], frame: int, mode: int) -> None:
    if not modes or modes[-1][1] != mode:
        modes.append((frame, mode))


def _add_team(marks: list[TeamMark], frame: int, pair: Sequence[tuple[bytes, int]]) -> None:
    # Behind the NUL that ends a name stands whatever was in memory.
    left, right = (name.split(b"\0")[0].decode("latin-1") or None for name, _ in pair)
    scores = (pair[0][1], pair[1][1], 0, 0, 0, 0)
    if not marks or (marks[-1].left, marks[-1].right, marks[-1].scores) != (left, right, scores):
        marks.append(TeamMark(frame=frame, left=left, right=right, scores=scores))


def _log(
    version: int,
    records: _Records,
    *,
    cycle: NDArray[np.int16],
    ball: NDArray[np.floating],
    players: Columns,
    modes: Sequence[tuple[int, int]],
    teams: Sequence[TeamMark],
    path: Path | None,
    types: Mapping[int, Mapping[str, float]] | None = None,
    server_params: Mapping[str, float] | None = None,
    player_params: Mapping[str, float] | None = None,
) -> GameLog:
    left, right = final_teams(teams)
    known = [(frame, mode if mode in _PLAYMODES else int(PlayMode.NULL)) for frame, mode in modes]
    if known != list(modes):
        strange = next(mode for _, mode in modes if mode not in _PLAYMODES)
        text = f"play mode {strange} is unknown, kept as 0"
        records.problems.append(Problem(code="unknown-playmode", severity=Severity.WARNING, text=text, path=path))
    return GameLog(
        log_version=str(version),
        left=left,
        right=right,
        frames=frame_columns(cycle=cycle.astype(np.int32), ball=ball, modes=known, teams=teams),
        players=players,
        # The types are not in versions 1 and 2; every player there counts as type 0, the server's default.
        player_types=player_type_columns(types or {0: {}}),
        server_params=dict(server_params or {}),
        player_params=dict(player_params or {}),
        complete=records.complete,
        problems=tuple(records.problems),
    )
