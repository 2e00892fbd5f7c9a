"""Does a clone that plays see what it saw in training?

It is asked again on the log of a match that it played with `teamclone live team RUN --deterministic`: how many of the
commands that it sent does it give again?

    python benchmarks/live.py RUN match.rcg.gz --side left
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import teamclone as tc
from teamclone.live.decisions import HISTORY, Decisions, Draw
from teamclone.logs import Match
from teamclone.logs.align import first_body_commands, slot_of
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import TEAM_SLOTS
from teamclone.rcss.playmodes import SITUATION, Situation
from teamclone.world.channels import CHANNEL, FLAG_GOALIE
from teamclone.world.view import view

LINED_UP = (Situation.OTHER, Situation.BEFORE_KICK_OFF, Situation.GOAL)
"""Where a team lines up, or nothing is played, it does not ask its clone."""


def sent(match: Match, *, side: int) -> dict[int, dict[int, tuple[int, float]]]:
    """The commands of a team by frame and number: kind and first number."""
    own, commands = TEAM_SLOTS[0 if side > 0 else 1], match.commands
    found: dict[int, dict[int, tuple[int, float]]] = {}
    for row in first_body_commands(commands, match.frames["playmode"]):
        slot = int(slot_of(commands["side"][[row]], commands["unum"][[row]])[0])
        if own.start <= slot < own.stop:
            given = int(commands["kind"][row]), float(commands["arg0"][row])
            found.setdefault(int(commands["frame"][row]), {})[slot - own.start + 1] = given
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path)
    parser.add_argument("match", type=Path)
    parser.add_argument("--side", choices=("left", "right"), default="left")
    options = parser.parse_args()
    side = 1 if options.side == "left" else -1
    match = tc.read_match(options.match)
    world, decisions = view(match, side=side), Decisions(tc.load(options.run).compiled(), draw=Draw.NOTHING)
    goalie = (world.players[..., CHANNEL["flags"]].astype(int) & FLAG_GOALIE) != 0
    asked = same = 0
    apart: list[float] = []
    for frame, given in sent(match, side=side).items():
        if frame < HISTORY or SITUATION[world.mode[frame]] in LINED_UP:
            continue
        unums = [unum for unum, (kind, _) in given.items() if kind != CommandKind.MOVE]
        keepers = [unum for unum in unums if goalie[frame, unum - 1]]
        seen = world.select(np.arange(frame - HISTORY, frame + 1))
        for unum, order in decisions.of(seen, unums, catchers=keepers).items():
            if order.kind is None:
                continue
            kind, number = given[unum]
            asked, same = asked + 1, same + (order.kind == kind)
            if order.kind == kind:
                apart.append(abs(order.numbers[0] - number))
    print(f"{same:,} of {asked:,} commands are given again")
    print("first number, apart: " + ", ".join(f"p{q} {np.percentile(apart, q):.2g}" for q in (50, 99, 99.9)))


if __name__ == "__main__":
    main()
