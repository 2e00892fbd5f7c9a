"""The events of a match counted once more, by walking over its frames in plain Python: slow, and by no array at all.

It shares with the package the words and the thresholds of the definitions, the parameters of the server, and no step.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any

from made_match import Row
from teamclone.events import definitions as the
from teamclone.logs import Match
from teamclone.rcss.playmodes import PlayMode
from teamclone.rcss.server_params import OLDEST, number

STAND, KICK, KICK_FAULT, GOALIE, CATCH, CATCH_FAULT = 0x1, 0x2, 0x4, 0x8, 0x10, 0x20
TACKLE, TACKLE_FAULT = 0x1000, 0x2000
LEAVES = ("kick_in", "corner_kick", "goal_kick")
FAULTS = ("offside", "back_pass", "free_kick_fault", "catch_fault", "illegal_defense")
GOAL_X, GOAL_Y = 52.5, 7.01


@dataclass
class Touch:
    """Who kicked and tackled, and who caught, on a frame."""

    frame: int
    kickers: list[int] = field(default_factory=list)
    tacklers: list[int] = field(default_factory=list)
    catchers: list[int] = field(default_factory=list)

    @property
    def players(self) -> list[int]:
        return self.kickers + self.tacklers


def side(slot: int) -> int:
    return 1 if slot < 11 else -1


def unum(slot: int) -> int:
    return slot % 11 + 1


class PlainEvents:
    """One match."""

    def __init__(self, match: Match | SimpleNamespace) -> None:
        frames, players, params = match.frames, match.players, match.game.server_params
        self.n = len(frames["cycle"])
        self.mode = [
            PlayMode(mode).name.lower() if mode < len(PlayMode) else f"unknown {mode}"
            for mode in frames["playmode"].tolist()
        ]
        self.ball = list(zip(frames["ball_x"].tolist(), frames["ball_y"].tolist(), strict=True))
        self.state, self.dashes = players["state"].tolist(), players["count_dash"].tolist()
        self.x, self.y = players["x"].tolist(), players["y"].tolist()
        self.decay = number(params, "ball_decay", version=OLDEST)
        self.fast = the.SHOT_SPEED * number(params, "ball_speed_max", version=OLDEST)
        self.touches = {touch.frame: touch for touch in self.find_touches()}

    def find_touches(self) -> Iterator[Touch]:
        for frame in range(self.n - 1):
            touch = Touch(frame)
            for slot in range(22):
                before, after = self.state[frame][slot], self.state[frame + 1][slot]
                if after & KICK and not after & KICK_FAULT:
                    touch.kickers.append(slot)
                if after & TACKLE and not after & TACKLE_FAULT and (not before & TACKLE or before & TACKLE_FAULT):
                    touch.tacklers.append(slot)
                if after & CATCH and not after & CATCH_FAULT and (not before & CATCH or before & CATCH_FAULT):
                    touch.catchers.append(slot)
            if touch.players or touch.catchers:
                yield touch

    # -- the course of play

    def what(self, frame: int) -> str:
        """A play mode without its side."""
        return self.mode[frame].removesuffix("_l").removesuffix("_r")

    def team(self, frame: int) -> int:
        """The side in a play mode's name."""
        return {"_l": 1, "_r": -1}.get(self.mode[frame][-2:], 0)

    def stops(self, frame: int) -> bool:
        return frame > 0 and self.mode[frame] != self.mode[frame - 1] and self.mode[frame] != "play_on"

    def counts(self, touch: Touch) -> bool:
        after = touch.frame + 1
        return self.what(after) in ("play_on", "goal_kick") or self.mode[after] != self.mode[touch.frame]

    def is_fault(self, frame: int) -> bool:
        return self.what(frame) in FAULTS or self.what(frame).startswith("foul_")

    def ending(self, touch: Touch) -> tuple[str, int, list[int], int]:
        """Of the touch of one player: outcome, frame, players and side of what comes next."""
        mine = side(touch.players[0])
        for frame in range(touch.frame + 1, self.n):
            if self.stops(frame):
                if self.what(frame) in LEAVES:
                    return "out", frame, [], 0
                if self.mode[frame] in ("goal_l", "goal_r"):
                    return "goal", frame, [], 0
                if self.what(frame) == "offside" and self.team(frame) == mine:
                    return "offside", frame, [], 0
                return "stopped", frame, [], 0
            if frame in self.touches:
                following = self.touches[frame]
                slots = following.players or following.catchers
                sides = {side(slot) for slot in slots}
                if len(sides) > 1:
                    return "", frame, slots, 0
                whose = sides.pop()
                if whose == mine:
                    return "completed", frame, slots, whose
                return "intercepted" if following.players else "caught", frame, slots, whose
        return "end", self.n - 1, [], 0

    def moved(self, first: int, second: int) -> float:
        return math.dist(self.ball[first], self.ball[second])

    # -- the events

    def rows(self) -> list[Row]:
        """All but fouls, cards, players and periods, whose words are those of the log."""
        made = [
            *self.chained(),
            *self.own(),
            *self.single(),
            *self.spells(),
            *self.presses(),
            *self.set_plays(),
        ]
        return sorted(made)

    def chained(self) -> Iterator[Row]:
        """By the rules of rcg2data."""
        last: Touch | None = None
        began = 0
        restarted = False
        for frame in range(self.n):
            touch = self.touches.get(frame - 1)
            if touch is not None:
                if last is not None and len(last.players) == 1 and touch.players:
                    yield from self.pair(last, touch, restarted)
                last, restarted = (touch if self.counts(touch) else None), False
                began = touch.frame
            if self.stops(frame):
                restarted = True
            if frame == 0:
                continue
            if self.what(frame) == "goal" and self.what(frame - 1) != "goal":
                yield from self.goal(frame, last)
            if self.what(frame) in LEAVES and self.what(frame) != self.what(frame - 1):
                loser = -self.team(frame)
                mine = [] if last is None else [slot for slot in last.players if side(slot) == loser]
                start = frame if last is None else began
                yield ("out of bounds", "", start, frame, loser, unum(mine[0]) if len(mine) == 1 else 0, 0, 0)
                last = None

    def pair(self, last: Touch, touch: Touch, restarted: bool) -> Iterator[Row]:
        who, several = last.players[0], len(touch.players) > 1
        sides = {side(slot) for slot in touch.players}
        start, end = last.frame, touch.frame
        one = touch.players[0]
        me = (side(who), unum(who))
        if len(sides) > 1:
            yield ("multi touch", "", start, end, *me, 0, 0)
            return
        other = 0 if several else unum(one)
        if side(who) not in sides:
            outcome = "restart" if restarted else "won"
            yield ("interception", outcome, start, end, -side(who), other, *me)
            return
        outcome = "restart" if restarted else "failed" if several or touch.tacklers else "completed"
        if several or one != who:
            row = ("pass", outcome, start, end, *me, side(who), other)
            yield row
            yield from self.through(row)
            return
        count = self.dashes
        if count[end + 1][who] > count[start + 1][who] if count[end + 1][who] >= 0 else self.ran(start, end, who):
            yield ("dribble", outcome, start, end, *me, *me)
            if not restarted and self.moved(start, end) >= the.SELF_PASS_M:
                yield ("self pass", outcome, start, end, *me, *me)
        elif touch.tacklers:
            yield ("ball touch", "", start, end, *me, *me)

    def ran(self, start: int, end: int, slot: int) -> bool:
        xy = [(self.x[frame + 1][slot], self.y[frame + 1][slot]) for frame in (start, end)]
        return math.dist(*xy) > 1.0

    def through(self, row: Any) -> Iterator[Row]:
        _, outcome, start, end, team, *_ = row
        if outcome == "restart":
            return
        opponents = [
            self.x[start][slot] * team for slot in range(22) if side(slot) == -team and self.state[start][slot] & STAND
        ]
        line = max(sorted(opponents)[-2] if len(opponents) > 1 else 0, 0)
        if self.ball[start][0] * team < line < self.ball[end][0] * team:
            yield ("through pass", *row[1:])

    def goal(self, frame: int, last: Touch | None) -> Iterator[Row]:
        team = self.team(frame)
        sides = {side(slot) for slot in last.players} if last is not None else set()
        number_of = unum(last.players[0]) if last is not None and len(last.players) == 1 else 0
        if last is not None and sides == {team}:
            yield ("goal", "scored", frame, frame, team, number_of, 0, 0)
            yield ("shot", "goal", last.frame, frame, team, number_of, 0, 0)
        elif sides == {-team}:
            yield ("goal", "own goal", frame, frame, team, 0, -team, number_of)
        else:
            yield ("goal", "unclear", frame, frame, team, 0, 0, 0)

    def own(self) -> Iterator[Row]:
        """Shots, clearances, and what was lost."""
        scored = {row[2] for row in self.chained() if row[:2] == ("shot", "goal")}
        for touch in self.touches.values():
            if len(touch.players) != 1 or not self.counts(touch) or touch.frame in scored:
                continue
            who = touch.players[0]
            outcome, end, slots, whose = self.ending(touch)
            team, start = side(who), touch.frame
            other = (whose, unum(slots[0]) if len(slots) == 1 else 0)
            me = (team, unum(who))
            again = outcome == "completed" and slots == [who]
            aim = None if again else self.aim(start, team)
            if aim is not None:
                keeper = whose == -team and len(slots) == 1 and self.state[end][slots[0]] & GOALIE
                if not aim or outcome == "out":
                    result = "wide"
                elif keeper:
                    result = "saved"
                else:
                    result = "blocked" if slots else "stopped"
                yield ("shot", result, start, end, *me, *other)
                continue
            if outcome not in ("intercepted", "caught", "out", "offside"):
                continue
            speed = self.moved(start, start + 1)
            away = (self.ball[start + 1][0] - self.ball[start][0]) * team >= 0
            own_third = self.ball[start][0] * team < -17.5
            far = self.moved(start, end) >= the.CLEARANCE_M
            if outcome != "offside" and own_third and away and far and speed >= self.fast:
                yield ("clearance", outcome, start, end, *me, *other)
                continue
            if math.dist((self.x[end][who], self.y[end][who]), self.ball[end]) > the.CONTROL_M:
                row = ("pass", outcome, start, end, *me, *other)
                yield row
                yield from self.through(row)
            elif outcome in ("intercepted", "caught"):
                yield ("dribble", "lost", start, end, *me, *other)

    def aim(self, start: int, team: int) -> bool | None:
        """Roll the ball on: whether it crosses the line between the posts; None where it is no shot."""
        (x, y), (x1, y1) = self.ball[start], self.ball[start + 1]
        vx, vy = x1 - x, y1 - y
        if not math.hypot(vx, vy) >= self.fast or math.hypot(team * GOAL_X - x1, y1) > the.SHOT_RANGE_M:
            return None
        if vx * team <= 0 or x1 * team >= GOAL_X:
            return None
        x, y = x1, y1
        for _ in range(2000):
            vx, vy = vx * self.decay, vy * self.decay
            if (x + vx) * team >= GOAL_X:
                crosses = abs(y + (team * GOAL_X - x) / vx * vy)
                return None if crosses > GOAL_Y + the.SHOT_MARGIN_M else crosses <= GOAL_Y
            x, y = x + vx, y + vy
        return None

    def single(self) -> Iterator[Row]:
        """Kicks, catches, tackles, one by one."""
        before: Touch | None = None
        stopped = False
        for frame in range(self.n):
            stopped |= self.stops(frame)
            touch = self.touches.get(frame)
            if touch is None:
                for slot in self.missed(frame):
                    yield ("tackle", "missed", frame, frame, side(slot), unum(slot), 0, 0)
                continue
            for slot in touch.kickers:
                yield ("kick", "", frame, frame, side(slot), unum(slot), 0, 0)
            for slot in touch.catchers:
                last = before.players if before is not None and not stopped and len(before.players) == 1 else []
                other = (side(last[0]), unum(last[0])) if last else (0, 0)
                yield ("catch", "", frame, frame, side(slot), unum(slot), *other)
            for slot in touch.tacklers:
                end, getter, whose = self.after_tackle(frame)
                other = (0, 0) if getter is None else (side(getter), unum(getter))
                yield ("tackle", "won" if whose == side(slot) else "lost", frame, end, side(slot), unum(slot), *other)
            for slot in self.missed(frame):
                yield ("tackle", "missed", frame, frame, side(slot), unum(slot), 0, 0)
            before, stopped = touch, False

    def missed(self, frame: int) -> Iterator[int]:
        if frame + 1 < self.n:
            for slot in range(22):
                if self.state[frame + 1][slot] & TACKLE_FAULT and not self.state[frame][slot] & TACKLE_FAULT:
                    yield slot

    def after_tackle(self, start: int) -> tuple[int, int | None, int]:
        for frame in range(start + 1, self.n):
            if self.stops(frame):
                named = self.team(frame)
                return frame, None, -named if self.is_fault(frame) else named
            if frame in self.touches:
                players = self.touches[frame].players
                sides = {side(slot) for slot in players or self.touches[frame].catchers}
                return frame, players[0] if len(players) == 1 else None, sides.pop() if len(sides) == 1 else 0
        return self.n - 1, None, 0

    def owners(self) -> list[tuple[int, Touch | None]]:
        """Whose the ball is in each frame, and by which touch."""
        made: list[tuple[int, Touch | None]] = []
        owner: tuple[int, Touch | None] = (0, None)
        for frame in range(self.n):
            if self.stops(frame):
                owner = (0, None)
            touch = self.touches.get(frame)
            if touch is not None and touch.players and self.counts(touch):
                sides = {side(slot) for slot in touch.players}
                if len(sides) == 1:
                    owner = (sides.pop(), touch)
            made.append(owner if self.mode[frame] == "play_on" else (0, None))
        return made

    def spells(self) -> Iterator[Row]:
        owner = [*self.owners(), (9, None)]
        start = 0
        for frame in range(1, self.n + 1):
            if owner[frame][0] == owner[start][0]:
                continue
            team, first = owner[start]
            last = owner[frame - 1][1]
            if team and first is not None and last is not None:
                numbers = [unum(one.players[0]) if len(one.players) == 1 else 0 for one in (first, last)]
                end = min(frame, self.n - 1)
                yield (
                    "possession",
                    self.spell_ends(frame, team, owner),
                    start,
                    end,
                    team,
                    numbers[0],
                    team,
                    numbers[1],
                )
            start = frame

    def spell_ends(self, frame: int, team: int, owner: list[tuple[int, Touch | None]]) -> str:
        if frame == self.n:
            return "end"
        if owner[frame][0] == -team:
            return "lost"
        touch = self.touches.get(frame - 1)
        if touch is not None and not touch.players:
            return "caught"
        if self.what(frame) in LEAVES:
            return "out"
        if self.what(frame) == "goal":
            return "goal"
        if self.what(frame) == "offside":
            return "offside"
        return "foul" if self.is_fault(frame) else "stopped"

    def presses(self) -> Iterator[Row]:
        owner = self.owners()
        for slot in range(22):
            start, ran = None, 0.0
            for frame in range(self.n + 1):
                near = frame < self.n and owner[frame][0] == -side(slot) and self.state[frame][slot] & STAND
                place = (self.x[frame][slot], self.y[frame][slot]) if near else (0.0, 0.0)
                distance = math.dist(place, self.ball[frame]) if near else math.inf
                if distance <= the.PRESS_M:
                    if start is None:
                        start, ran = frame, 0.0
                    if frame + 1 < self.n and distance > 0:
                        step = (self.x[frame + 1][slot] - place[0], self.y[frame + 1][slot] - place[1])
                        way = (self.ball[frame][0] - place[0], self.ball[frame][1] - place[1])
                        ran += max(0.0, (step[0] * way[0] + step[1] * way[1]) / distance)
                elif start is not None:
                    if frame - start >= the.PRESS_CYCLES and ran >= the.PRESS_RUN_M:
                        end = min(frame, self.n - 1)
                        won = owner[end][0] == side(slot)
                        touch = owner[start][1]
                        assert touch is not None
                        other = (-side(slot), unum(touch.players[0])) if len(touch.players) == 1 else (0, 0)
                        yield ("press", "won" if won else "lost", start, end, side(slot), unum(slot), *other)
                    start = None

    def set_plays(self) -> Iterator[Row]:
        others = ("play_on", "null", "before_kick_off", "time_over", "first_half_over", "pause", "human_judge")
        for frame in range(self.n):
            what = self.what(frame)
            if frame and self.mode[frame] == self.mode[frame - 1]:
                continue
            if what in others or what.startswith("unknown") or what == "goal" or self.is_fault(frame):
                continue
            end = next((at for at in range(frame, self.n) if self.mode[at] != self.mode[frame]), self.n - 1)
            team = self.team(frame)
            first = next((at for at in range(frame, end) if at in self.touches), None)
            taker = self.touches[first].players if first is not None else []
            mine = len(taker) == 1 and side(taker[0]) == team
            yield ("set play", what.replace("_", " "), frame, end, team, unum(taker[0]) if mine else 0, 0, 0)
