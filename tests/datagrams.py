"""Datagrams as rcssserver sends them to monitors and players."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from teamclone.logs import Match
from teamclone.rcss import state_bits
from teamclone.rcss.players import N_TEAM
from teamclone.rcss.playmodes import PlayMode

AFTER_STATE = {
    3: b"-50 0.5 0.25 -0.125 90 -45 (v h 120) (s 8000 1 1) (c 0 1 2 3 4 5 6 7 8 9 10)",
    4: b"-50 0.5 0.25 -0.125 90 -45 (v h 120) (s 8000 1 1 130600) (c 0 1 2 3 4 5 6 7 8 9 10)",
    5: b"-50 0.5 0.25 -0.125 90 -45 (v h 120) (fp 12 3) (s 8000 1 1 130600) (c 0 1 2 3 4 5 6 7 8 9 10 11)",
}
"""A player as text versions have it."""


def packet(
    states: Mapping[tuple[str, int], str] = {},
    *,
    cycle: int = 7,
    pm: int = 3,
    teams: bytes = b"Red null 1 2",
    version: int = 3,
) -> bytes:
    players = b" ".join(
        b"((%s %d) 0 %s %s)" % (side.encode(), unum, states.get((side, unum), "0").encode(), AFTER_STATE[version])
        for side in "lr"
        for unum in range(1, 12)
    )
    return b"(show %d (pm %d) (tm %s) ((b) 1.5 -2 0.25 0) " % (cycle, pm, teams) + players + b")\0"


WHOLE = packet({("l", 1): "0x9"})


def full_state(match: Match, frame: int, *, side: int = 1, was: Mapping[str, NDArray[np.bool_]]) -> bytes:
    """What a player on ``side`` would have been sent in a frame of a match, by version 18 of the protocol.

    Args:
        was: (n_frames, 22) who was frozen by a tackle (``t``), kicked (``k``) or was frozen by a foul (``f``), which no
            column of a log says as a full state does.
    """
    game = match.game
    frames, players = ({name: column[frame] for name, column in part.items()} for part in (game.frames, game.players))
    people = []
    for slot in np.flatnonzero(players["state"] & state_bits.STAND):
        values = [f"{players[name][slot]:.6g}" for name in ("x", "y", "vx", "vy", "body", "neck")]
        stamina = " ".join(f"{players[name][slot]:.7g}" for name in ("stamina", "effort", "recovery", "capacity"))
        keeps = " g" if players["state"][slot] & state_bits.GOALIE else ""
        does = next((f" {letter}" for letter in "tkf" if was[letter][frame, slot]), "")
        card = " y" if players["state"][slot] & state_bits.YELLOW_CARD else ""
        name = f"p {'l' if slot < N_TEAM else 'r'} {slot % N_TEAM + 1}{keeps} {players['type'][slot]}"
        people.append(f" (({name}) {' '.join(values)} (focus_point 0 0) (stamina {stamina}){does}{card})")
    scores = (frames["left_score"], frames["right_score"])[::side]
    ball = " ".join(f"{frames[name]:.6g}" for name in ("ball_x", "ball_y", "ball_vx", "ball_vy"))
    mode = PlayMode(int(frames["playmode"])).name.lower()
    return (
        f"(fullstate {frames['cycle']} (pmode {mode}) (vmode high wide) (count 0 0 0 0 0 0 0 0 0) (arm (movable 0) "
        f"(expires 0) (target 0 0) (count 0)) (score {scores[0]} {scores[1]}) ((b) {ball}){''.join(people)})\0"
    ).encode()


def sense(match: Match, frame: int, slot: int) -> bytes:
    """What a player would have felt in a frame of a match, by version 18 of the protocol."""
    players = {name: column[frame, slot] for name, column in match.game.players.items()}
    felt = ("kick", "dash", "turn", "say", "turn_neck", "catch", "move", "change_view", "change_focus")
    counts = "".join(f" ({name} {players[f'count_{name}']})" for name in felt)
    collided = players["state"] & (state_bits.BALL_COLLIDE | state_bits.PLAYER_COLLIDE | state_bits.POST_COLLIDE)
    return (
        f"(sense_body {match.game.frames['cycle'][frame]} (view_mode high normal) (stamina 8000 1 1 130600) "
        f"(speed 0 0) (head_angle 0){counts} (arm (movable 0) (expires 0) (target 0 0) (count 0)) "
        f"(focus (target none) (count 0)) (tackle (expires 0) (count {players['count_tackle']})) "
        f"(collision {'(player)' if collided else 'none'}) "
        "(foul (charged 0) (card none)) (focus_point 0 0))\0"
    ).encode()
