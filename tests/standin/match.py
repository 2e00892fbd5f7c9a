"""The match that the stand-in for rcssserver plays: its players, its clock and its logs."""

from __future__ import annotations

import gzip
import math
import time
from pathlib import Path

MODES = {"before_kick_off": 1, "time_over": 2, "play_on": 3}
COUNTERS = ("kick", "dash", "turn", "catch", "move", "turn_neck", "change_view", "say", "tackle", "pointto")
COUNTERS += ("attentionto", "change_focus")
"""In the order of logs; change_focus is younger than the others."""

FELT = ("kick", "dash", "turn", "say", "turn_neck", "catch", "move", "change_view", "change_focus")
"""Counters that a player is told, in the order of the server; that of tackles stands apart."""

NUMBERS = {"kick": 2, "dash": 1, "turn": 1, "catch": 1, "move": 2, "tackle": 1, "turn_neck": 1}
"""The commands that are taken once a cycle, with the numbers they need. All but turn_neck share one place."""

PLAYER_TYPE = (
    "(player_speed_max 1.05)(stamina_inc_max 45)(player_decay 0.4)(inertia_moment 5)(dash_power_rate 0.006)"
    "(player_size 0.3)(kickable_margin 0.7)(kick_rand 0.1)(extra_stamina 50)(effort_max 1)(effort_min 0.6)"
    "(kick_power_rate 0.027)(foul_detect_probability 0.5)(catchable_area_l_stretch 1)"
)
DECAY = 0.4
STAND, FAILED_KICK, GOALIE = 0x1, 0x6, 0x8
"""Bits of a player's state."""


class Player:
    """A place in a team, whether somebody plays there or not."""

    def __init__(self, side: str, unum: int):
        self.side = side
        self.sign = 1 if side == "l" else -1
        self.unum = unum
        self.body = self.neck = 0.0
        self.type = 0
        self.counts = dict.fromkeys(COUNTERS, 0)
        self.leave()

    def leave(self) -> None:
        self.state = 0
        self.x, self.y = -3.0 * self.unum * self.sign, -37.0
        self.begin_cycle()

    def begin_cycle(self) -> None:
        self.dx = self.dy = self.turn = 0.0
        self.taken: set[str] = set()
        self.state &= ~FAILED_KICK

    def command(self, name: str, words: list[str], mode: str) -> bool:
        """Takes a command or ignores it; False for one that the server cannot read."""
        if name not in self.counts:
            return True
        numbers = []
        if name in NUMBERS:
            try:
                numbers = [float(word) for word in words if word not in ("on", "off", "true", "false")]
            except ValueError:
                return False
            if len(numbers) < NUMBERS[name] or not all(map(math.isfinite, numbers)):
                return False
            place = "neck" if name == "turn_neck" else "body"
            if place in self.taken or (name == "move" and mode != "before_kick_off"):
                return True
            self.taken.add(place)
        self.counts[name] += 1
        if name == "dash":
            length = 0.01 * min(max(numbers[0], 0.0), 100.0)
            angle = math.radians(self.body + (numbers[1] if len(numbers) > 1 else 0.0))
            self.dx, self.dy = length * math.cos(angle), length * math.sin(angle)
        elif name == "turn":
            self.turn = min(max(numbers[0], -180.0), 180.0)
        elif name == "turn_neck":
            self.neck = min(max(self.neck + numbers[0], -90.0), 90.0)
        elif name == "move":
            self.x, self.y = numbers[0] * self.sign, numbers[1] * self.sign
        elif name == "kick":
            self.state |= FAILED_KICK
        return True

    def step(self, mode: str) -> None:
        if mode != "play_on":
            self.dx = self.dy = 0.0
        self.x = min(max(self.x + self.dx, -57.5), 57.5)
        self.y = min(max(self.y + self.dy, -39.0), 39.0)
        self.body = (self.body + self.turn + 180.0) % 360.0 - 180.0

    def text(self, version: int) -> str:
        """The player as packets for monitors of this version have him."""
        state = hex(self.state) if self.state else "0"
        counts = list(self.counts.values())
        return (
            f" (({self.side} {self.unum}) {self.type} {state} {round(self.x, 4):g} {round(self.y, 4):g} "
            f"{round(self.dx * DECAY, 4):g} {round(self.dy * DECAY, 4):g} {round(self.body, 3):g} "
            f"{round(self.neck, 3):g} (v h 120){' (fp 0 0)' if version >= 5 else ''} "
            f"(s 8000 1 1{' 130600' if version >= 4 else ''}) "
            f"(c {' '.join(map(str, counts if version >= 5 else counts[:-1]))}))"
        )

    def full(self) -> str:
        """The player in a full state of protocol version 18 and later."""
        goalie = " g" if self.state & GOALIE else ""
        return (
            f" ((p {self.side} {self.unum}{goalie} {self.type}) {self.x:g} {self.y:g} {self.dx * DECAY:g} "
            f"{self.dy * DECAY:g} {self.body:g} {self.neck:g} (focus_point 0 0) (stamina 8000 1 1 130600))"
        )

    def sense(self, cycle: int) -> str:
        """What the player feels."""
        counts = "".join(f" ({name} {self.counts[name]})" for name in FELT)
        return (
            f"(sense_body {cycle} (view_mode high normal) (stamina 8000 1 1 130600) (speed 0 0) (head_angle 0){counts} "
            "(arm (movable 0) (expires 0) (target 0 0) (count 0)) (focus (target none) (count 0)) "
            f"(tackle (expires 0) (count {self.counts['tackle']})) (collision none) (foul (charged 0) (card none)) "
            "(focus_point 0 0))"
        )


class Team:
    def __init__(self, side: str):
        self.side = side
        self.name = ""
        self.coach_name = ""
        self.players = [Player(side, unum) for unum in range(1, 12)]
        self.size = 0  # who has ever connected
        self.has_goalie = False

    @property
    def result(self) -> str:
        return "_".join(filter(None, (self.name, self.coach_name, "0"))) if self.name else "null"


class Log:
    """A log file, called incomplete until it is closed."""

    def __init__(self, folder: str, kind: str, level: int):
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.suffix = f".{kind}.gz" if level > 0 else f".{kind}"
        self.path = self.folder / f"incomplete{self.suffix}"
        self.file = gzip.GzipFile(self.path, "wb", level) if level > 0 else self.path.open("wb")

    def write(self, line: str) -> None:
        self.file.write(f"{line}\n".encode())

    def close(self, name: str) -> None:
        self.file.close()
        self.path.rename(self.folder / f"{name}{self.suffix}")


class Match:
    """``news`` is what the referee has said and nobody has been told yet; ``over`` says why the server stops."""

    def __init__(self, options: dict[str, dict[str, str]]):
        self.options = {name: value.strip('"') for name, value in options["server"].items()}
        self.half_time = 10 * self.number("half_time")
        self.end = self.half_time * self.number("nr_normal_halfs")
        self.game_over_wait = self.number("game_over_wait")
        self.started = time.localtime()
        self.teams = (Team("l"), Team("r"))
        self.players = [player for team in self.teams for player in team.players]
        self.mode, self.time, self.stoppage = "before_kick_off", 0, 0
        self.news: list[str] = []
        self.over: str | None = None
        self.parameters = [
            f"({module}_param {''.join(f'({name} {value})' for name, value in options[module].items())})"
            for module in ("server", "player")
        ]
        self.parameters += [f"(player_type (id {number}){PLAYER_TYPE})" for number in range(18)]
        self.commands = Log(self.options["text_log_dir"], "rcl", self.number("text_log_compression"))
        self.frames = Log(self.options["game_log_dir"], "rcg", self.number("game_log_compression"))
        self.frames.write("\n".join((f"ULG{self.number('game_log_version')}", *self.parameters)))
        self.logged_mode = self.logged_score = ""
        self.wait_again()

    def number(self, name: str) -> int:
        return int(self.options[name])

    def wait_again(self) -> None:
        self.kick_off_wait, self.connect_wait = self.number("kick_off_wait"), self.number("connect_wait")

    def step(self) -> None:
        """One cycle of the simulator, from the commands received since the last one."""
        for player in self.players:
            player.step(self.mode)
        if self.mode == "play_on":
            self.time, self.stoppage = self.time + 1, 0
            if 0 < self.end <= self.time:
                self.referee("time_up")
                self.change_mode("time_over")
            elif self.half_time > 0 and self.time % self.half_time == 0:
                self.referee("half_time")
                self.change_mode("before_kick_off")
        else:
            self.stoppage += 1
        self.shows: dict[int, str] = {}
        if self.mode != "before_kick_off" and self.logged_mode != "time_over":
            self.log_frame()

    def log_frame(self) -> None:
        if self.mode != self.logged_mode:
            self.frames.write(f"(playmode {self.time} {self.mode})")
        if self.score != self.logged_score:
            self.frames.write(f"(team {self.time} {self.score})")
        self.logged_mode, self.logged_score = self.mode, self.score
        # Logs of version 6 are made of what monitors of version 5 get, and so on.
        self.frames.write(f"(show {self.time}{self.objects(self.number('game_log_version') - 1)})")

    def objects(self, version: int) -> str:
        if version not in self.shows:
            self.shows[version] = " ((b) 0 0 0 0)" + "".join(player.text(version) for player in self.players)
        return self.shows[version]

    def full_state(self) -> str:
        """What players get of all that are there. Nobody scores, so both sides get the same."""
        players = "".join(player.full() for player in self.players if player.state & STAND)
        return (
            f"(fullstate {self.time} (pmode {self.mode}) (vmode high wide) (count 0 0 0 0 0 0 0 0 0) "
            f"(arm (movable 0) (expires 0) (target 0 0) (count 0)) (score 0 0) ((b) 0 0 0 0){players})"
        )

    def packet(self, version: int) -> str:
        """What a monitor of this version gets in this cycle."""
        return f"(show {self.time} (pm {MODES[self.mode]}) (tm {self.score}){self.objects(version)})"

    def go_on(self) -> None:
        """Kicks off and ends the match without a human, after the waits of the options."""
        if self.mode == "before_kick_off":
            if self.time > 0 or all(player.state & STAND for player in self.players):
                self.kick_off_wait -= 1
            else:
                self.connect_wait -= 1
            if self.kick_off_wait <= 0 or self.connect_wait <= 0:
                self.kick_off()
        elif self.mode == "play_on":
            self.wait_again()
        else:
            self.game_over_wait -= 1
            if self.game_over_wait <= 0:
                self.over = "Game Over. Exiting..."

    def kick_off(self) -> None:
        side = "left" if self.half_time <= 0 or self.time // self.half_time % 2 == 0 else "right"
        print(f"Kick_off_{side}", flush=True)
        self.referee(f"kick_off_{side[0]}")
        self.change_mode("play_on")

    def change_mode(self, mode: str) -> None:
        self.mode = mode
        self.referee(mode)

    def referee(self, text: str) -> None:
        self.log_command(f"(referee {text})")
        self.news.append(f"(hear {self.time} referee {text})")

    def log_command(self, text: str) -> None:
        self.commands.write(f"{self.time},{self.stoppage}\t{text}")

    @property
    def score(self) -> str:
        return f"{' '.join(team.name or 'null' for team in self.teams)} 0 0"

    def flush(self) -> None:
        for log in (self.commands, self.frames):
            log.file.flush()

    def close(self) -> None:
        result = f"{self.teams[0].result}-vs-{self.teams[1].result}"
        self.frames.write(f'(msg {self.time} 1 "(result {time.strftime("%Y%m%d%H%M", self.started)} {result})")')
        self.frames.write(f"(team {self.time} {self.score})")
        for log in (self.commands, self.frames):
            log.close(time.strftime(self.options["log_date_format"], self.started) + result)
