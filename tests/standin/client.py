"""A team for rcssserver 19 or its stand-in, in synchronous mode: eleven players and a coach in one process, or one of
them. They kick off, dash and turn, always the same in the same cycle, and cannot play. Options make them crash, hang or
leave processes behind, so that tests can see what a runner of matches makes of it.

It stops when the server is gone; exit code 1 says that the server never took anybody in.
"""

from __future__ import annotations

import argparse
import os
import select
import signal
import socket
import subprocess
import sys
import time
from zlib import crc32

KICKER = 11
COACH = 12
RETRY_SECONDS = 0.5


def read_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, allow_abbrev=False)
    parser.add_argument("--name", default="Standin")
    parser.add_argument("--host", default="127.0.0.1")
    parser.add_argument("--port", type=int, default=6000)
    parser.add_argument("--olcoach-port", type=int, help="play with a coach, who connects here")
    parser.add_argument("--unum", type=int, help="only this client: 1 the goalkeeper, 12 the coach")
    parser.add_argument("--players", type=int, default=11, help="play with fewer than eleven")
    parser.add_argument("--coach", action="store_const", dest="unum", const=COACH, help="as --unum 12")
    parser.add_argument("--patience", type=float, default=5.0, help="seconds without a message before it gives up")
    faults = parser.add_argument_group("faults")
    faults.add_argument("--crash-at", type=int, metavar="CYCLE", help="exit with code 3")
    faults.add_argument("--crash-unum", type=int, metavar="N", help="with --crash-at: only player N vanishes")
    faults.add_argument("--hang-at", type=int, metavar="CYCLE", help="answer no more")
    faults.add_argument("--never-connect", action="store_true", help="sleep until killed")
    faults.add_argument("--refuse-to-die", action="store_true", help="ignore all but SIGKILL, stay after the match")
    faults.add_argument("--fork", action="store_true", help="go on as a daemon")
    faults.add_argument("--leave-children", action="store_true", help="start a sleep 1000 that stays")
    faults.add_argument("--hole-every", type=int, metavar="N", help="no body command in every N-th cycle")
    faults.add_argument("--clash-every", type=int, metavar="N", help="two body commands in every N-th cycle")
    return parser.parse_args()


class Client:
    def __init__(self, options: argparse.Namespace, unum: int):
        self.options = options
        self.unum = unum  # the goalkeeper and the coach apart only until the server gives him one
        self.is_coach = unum == COACH
        port = (options.olcoach_port or 6002) if self.is_coach else options.port
        self.server = (socket.gethostbyname(options.host), port)
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.greeting = f"(init {options.name} (version 19){' (goalie)' if unum == 1 else ''})"
        self.connected = self.gone = self.has_moved = False
        self.mode = ""
        self.cycle = 0
        self.heard = time.monotonic()
        self.knocked = 0.0

    def knock(self) -> None:
        if time.monotonic() - self.knocked > RETRY_SECONDS:
            self.knocked = time.monotonic()
            self.socket.sendto(f"{self.greeting}\0".encode(), self.server)

    def send(self, text: str) -> None:
        try:
            self.socket.send(f"{text}\0".encode())
        except BlockingIOError:
            pass
        except OSError:
            self.gone = True

    def receive(self) -> None:
        """Reads all there is. Of several (think) that have piled up one is answered, or we would always be late."""
        must_think = False
        while not self.gone:
            try:
                data, address = self.socket.recvfrom(65536)
            except BlockingIOError:
                break
            except OSError:
                self.gone = True
                return
            self.heard = time.monotonic()
            words = data.rstrip(b"\0").decode(errors="replace").split(" ", 4)
            if words[0] == "(think)":
                must_think = True
            elif words[0] in ("(sense_body", "(see_global"):
                self.cycle = int(words[1].rstrip(")"))
            elif words[0] == "(hear" and words[2] == "referee":
                self.mode = words[3].rstrip(")")
                self.has_moved = False
            elif words[0] == "(init" and not self.connected:
                self.connected = True
                self.socket.connect(address)
                if self.is_coach:
                    self.send("(eye on)")
                else:
                    self.unum = int(words[2])
                    self.mode = words[3].rstrip(")")
            elif words[0] == "(error" and not (self.is_coach and words[1] == "no_such_team)"):
                print(f"{self.options.name} {self.unum}: {' '.join(words)}", file=sys.stderr, flush=True)
                self.gone = not self.connected
        if must_think:
            self.think()

    def think(self) -> None:
        options = self.options
        if options.crash_at is not None and self.cycle >= options.crash_at:
            if options.crash_unum is None:
                os._exit(3)
            if options.crash_unum == self.unum:
                self.gone = True
                return
        while options.hang_at is not None and self.cycle >= options.hang_at:
            signal.pause()
        self.send("(done)" if self.is_coach else f"{self.body_command()}(turn_neck 0)(done)")

    def body_command(self) -> str:
        if self.mode == "before_kick_off" and not self.has_moved:
            self.has_moved = True
            return "(move -0.5 0)" if self.unum == KICKER else f"(move {4 * self.unum - 54} {7 * self.unum % 30 - 15})"
        if self.mode.startswith("kick_off") and self.unum == KICKER:
            return "(kick 20 0)"
        number = crc32(f"{self.options.name} {self.unum} {self.cycle}".encode())
        commands = [f"(dash {number % 101})", f"(turn {number % 361 - 180})"]
        if (self.cycle + self.unum) % 2:
            commands.reverse()
        if self.is_due(self.options.hole_every):
            return ""
        return "".join(commands[: 2 if self.is_due(self.options.clash_every) else 1])

    def is_due(self, every: int | None) -> bool:
        return bool(every) and self.cycle % every == 0


def play(options: argparse.Namespace) -> bool:
    """Plays until the server is gone; whether it was ever there."""
    team = [*range(1, options.players + 1), *([COACH] if options.olcoach_port else [])]
    unums = team if options.unum is None else [options.unum]
    clients = {client.socket.fileno(): client for client in (Client(options, unum) for unum in unums)}
    poll = select.poll()
    for number in clients:
        poll.register(number, select.POLLIN)
    has_played = False
    while clients:
        for client in clients.values():
            # The server knows no coach of a team without players.
            if not client.connected and (has_played or not client.is_coach or len(unums) == 1):
                client.knock()
        ready = poll.poll(100)
        for number, _ in ready:
            clients[number].receive()
        has_played = has_played or any(client.connected for client in clients.values())
        for number, client in list(clients.items()):
            if not ready and client.mode == "time_over":
                client.send("(done)")  # after the match only an error tells that the server is gone
            if client.gone or time.monotonic() - client.heard > options.patience:
                poll.unregister(number)
                clients.pop(number).socket.close()
    return has_played


def main() -> None:
    options = read_options()
    signal.signal(signal.SIGINT, signal.SIG_IGN if options.refuse_to_die else signal.SIG_DFL)
    if options.refuse_to_die:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
    if options.fork:
        if os.fork():
            os._exit(0)
        os.setsid()
    if options.leave_children:
        subprocess.Popen(["sleep", "1000"])
    has_played = False if options.never_connect else play(options)
    while options.never_connect or options.refuse_to_die:
        signal.pause()
    sys.exit(0 if has_played else 1)


if __name__ == "__main__":
    main()
