"""A stand-in for rcssserver 19 in synchronous mode, for tests of whatever runs matches.

It is the server from the outside: options, ports, protocol, what it says on stdout and stderr, log files and their
names, exit codes, what it does about clients that are late, gone or surplus. It is no simulator: after the kick-off it
is play_on until time is up, the ball lies in the centre, nobody scores, tires, tackles or collides. A player's first
body command of a cycle is counted; (dash) and (turn) move him a little and exactly, and every kick fails. Left out are
the trainer, extra time, penalties, real-time mode, two-leg dashes, and all of the messages to clients
that ours do not read.

These options do something: port, coach_port, olcoach_port, auto_mode, half_time, nr_normal_halfs, connect_wait,
kick_off_wait, game_over_wait, fullstate_l/r, game/text_log_dir/compression, game_log_version 4 to 6, log_date_format.
The others of the real server are accepted and stand in the log.

Environment, beside RCSS_CONF_DIR:
    STANDIN_WAIT_MS        how long a cycle waits for (done), 1250 unless given
    STANDIN_PAUSE_MS       how long a cycle lasts at least before the first kick-off, 50 unless given
    STANDIN_DIE_AT         dies of SIGSEGV at this cycle, leaving incomplete logs
    STANDIN_HANG_AT        sleeps from this cycle on; only SIGKILL ends it
    STANDIN_DROP_AT        closes the connection of the left team's number 5 at this cycle
    STANDIN_EXIT_EARLY_AT  closes its logs at this cycle and exits as if the match were over
"""

from __future__ import annotations

import os
import re
import select
import signal
import socket
import sys
import time

from match import GOALIE, STAND, Match, Player, Team
from options import read_options, write_missing

# The real server, too, takes "+-_" for a range of characters.
NAME = r"[+-_a-zA-Z0-9]+"
PLAYER_NAME = re.compile(rf"\(init ({NAME})")
PLAYER_INIT = re.compile(rf"\(init {NAME}(?: ?\(goalie\)| ?\(version [\d.]+\))*\)")
COACH_INIT = re.compile(rf"\(init ({NAME})(?: ({NAME}))?(?: ?\(version [\d.]+\))?\)")
VERSION = re.compile(r"version (\d+)")
COMMAND = re.compile(r'\(([a-z_]+)((?: [^()" ]+| "[^"]*")*)\)')


class Client:
    """A player, coach or monitor, behind a socket of its own as in the real server."""

    def __init__(self, address: tuple[str, int], *, team: Team | None = None, player: Player | None = None):
        self.address = address
        self.team = team
        self.player = player
        self.monitor_version = 0  # of those who are no monitor
        self.thinks = player is not None
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.socket.connect(address)


class Server:
    def __init__(self, options: dict[str, dict[str, str]]):
        self.wait = int(os.environ.get("STANDIN_WAIT_MS", "1250")) / 1000
        self.pause = int(os.environ.get("STANDIN_PAUSE_MS", "50")) / 1000
        self.clients: dict[int, Client] = {}
        self.waiting: set[Client] = set()
        self.missed = 0
        self.poll = select.poll()
        self.ports: dict[int, tuple[socket.socket, str]] = {}
        for name in ("port", "coach_port", "olcoach_port"):
            port = int(options["server"][name])
            listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            try:
                listener.bind(("", port))
            except OSError as error:
                sys.exit(f"Error initializing sockets: port={port}. {error.strerror}")
            listener.setblocking(False)
            self.ports[listener.fileno()] = (listener, name)
            self.poll.register(listener, select.POLLIN)
        self.match = Match(options)

    def run(self) -> None:
        match = self.match
        while match.over is None:
            match.step()
            for client in [client for client in self.clients.values() if client.monitor_version]:
                self.send(client, match.packet(client.monitor_version))
            for player in match.players:
                player.begin_cycle()
            self.fail()
            if match.options["auto_mode"] == "1":
                match.go_on()
            if match.over is None:
                self.send_senses()
                self.think()
        print(f"\n{match.over}", flush=True)
        match.close()

    def fail(self) -> None:
        """The faults that a test asked for."""

        def due(name: str) -> bool:
            return os.environ.get(f"STANDIN_{name}_AT") == str(self.match.time)

        if due("DIE") or due("HANG"):
            self.match.flush()
        if due("DIE"):
            os.kill(os.getpid(), signal.SIGSEGV)
        while due("HANG"):
            time.sleep(60)
        if due("DROP"):
            lost = self.match.teams[0].players[4]
            for client in [client for client in self.clients.values() if client.player is lost]:
                self.drop(client)
        if due("EXIT_EARLY"):
            self.match.over = "Quit Server. Exiting..."

    def send_senses(self) -> None:
        fullstate = self.match.full_state()
        for client in [client for client in self.clients.values() if client.team]:
            for text in self.match.news:
                self.send(client, text)
            if client.player:
                self.send(client, client.player.sense(self.match.time))
                if self.match.options[f"fullstate_{client.player.side}"] == "1":
                    self.send(client, fullstate)
        self.match.news.clear()

    def think(self) -> None:
        """Lets the clients think and takes their commands until all of them are done or the wait is over."""
        if self.match.time == 0:
            time.sleep(self.pause)
        self.waiting = {client for client in self.clients.values() if client.thinks}
        for client in list(self.waiting):
            self.send(client, "(think)")
        deadline = time.monotonic() + self.wait
        left = self.wait
        while left > 0 and self.match.over is None:
            # No longer than this, since a signal does not end it.
            for number, _ in self.poll.poll(1000 * min(left, 0.05) if self.waiting else 0):
                if number in self.ports:
                    self.accept(*self.ports[number])
                elif number in self.clients:
                    self.receive(self.clients[number])
            if not self.waiting:
                self.missed = 0
                return
            left = deadline - time.monotonic()
        if self.match.time > 0 and self.match.over is None:
            self.missed += 1
            print(f"Someone missed a cycle at {self.match.time}", file=sys.stderr, flush=True)
        if self.missed > 20:
            print("Waiting too long for clients! Exiting", file=sys.stderr, flush=True)
            self.match.over = "Quit Server. Exiting..."

    def send(self, client: Client, text: str) -> None:
        try:
            client.socket.send(f"{text}\0".encode())
        except BlockingIOError:  # nobody reads it
            self.drop(client)
        except OSError:  # nobody is there any more
            self.receive(client, gone=True)

    def receive(self, client: Client, *, gone: bool = False) -> None:
        """Takes all that a client has sent; one that has gone may have said goodbye before."""
        while client.socket.fileno() in self.clients:
            try:
                data = client.socket.recv(8192)
            except BlockingIOError:
                if gone:
                    self.drop(client)
                return
            except OSError:
                gone = True
                continue
            text, nul, _ = data.partition(b"\0")
            if not nul:
                self.send(client, "(warning message_not_null_terminated)")
            self.take(client, text.decode(errors="replace"))

    def take(self, client: Client, text: str) -> None:
        if client.team is None:
            if text == "(dispbye)":
                self.drop(client)
            elif text == "(dispstart)" and self.match.mode == "before_kick_off":
                self.match.kick_off()
            return
        self.log(client, text)
        for name, rest in COMMAND.findall(text):
            if name == "done":
                self.waiting.discard(client)
            elif name == "bye":
                self.drop(client)
            elif client.player is None:
                client.thinks = rest == " on" if name == "eye" else client.thinks
                if name == "change_player_type":
                    self.change_type(client, *map(int, rest.split()))
            elif not client.player.command(name, rest.split(), self.match.mode):
                self.send(client, "(error illegal_command_form)")

    def change_type(self, coach: Client, unum: int, kind: int) -> None:
        """Gives a player a type, as a coach may before the kick-off, unless a team mate has it."""
        players = coach.team.players
        taken = any(player.type == kind and player.unum != unum and kind for player in players)
        if taken or self.match.time > 0:
            self.send(coach, "(warning max_of_that_type_on_field)")
        else:
            players[unum - 1].type = kind
            self.send(coach, f"(ok change_player_type {unum} {kind})")

    def log(self, client: Client, text: str) -> None:
        sender = client.player.unum if client.player else "Coach"
        self.match.log_command(f"Recv {client.team.name}_{sender}: {text}")

    def drop(self, client: Client) -> None:
        if self.clients.pop(client.socket.fileno(), None) is None:
            return
        self.poll.unregister(client.socket)
        self.waiting.discard(client)
        client.socket.close()
        if client.team is None:
            print("A monitor disconnected", flush=True)
        elif client.player is None:
            print(f"An online coach disconnected : ({client.team.name})", flush=True)
        else:
            client.player.leave()
            print(f"A player disconnected : ({client.team.name} {client.player.unum})", flush=True)

    def accept(self, listener: socket.socket, port: str) -> None:
        """Takes in whoever knocks at one of the three ports, or tells him why not."""
        while True:
            try:
                data, address = listener.recvfrom(8192)
            except BlockingIOError:
                return
            text = data.partition(b"\0")[0].decode(errors="replace").removesuffix("\n")
            known = [client for client in self.clients.values() if client.address == address]
            error = None
            if known:
                self.send(known[0], "(error only_init_allowed_on_init_port)")
            elif port == "coach_port":
                error = "connected_offline_coach_without_coach_mode"
            elif port == "olcoach_port":
                error = self.add_coach(text, address)
            elif text.startswith("(dispinit"):
                error = self.add_monitor(text, address)
            elif text.startswith("(reconnect "):
                error = self.add_again(text, address)
            else:
                error = self.add_player(text, address)
            if error:
                listener.sendto(f"(error {error})\0".encode(), address)

    def add(self, client: Client, what: str, greetings: list[str]) -> None:
        self.clients[client.socket.fileno()] = client
        self.poll.register(client.socket, select.POLLIN)
        print(f"A new {what} connected.", flush=True)
        for greeting in greetings:
            self.send(client, greeting)

    def add_player(self, text: str, address: tuple[str, int]) -> str | None:
        if not text.startswith("(init "):
            return "unknown_command"
        name = PLAYER_NAME.match(text)
        if name is None:
            return "illegal_teamname"
        if len(name[1]) > 15:
            return "illegal_teamname_or_too_long_teamname"
        if not PLAYER_INIT.match(text):
            return "illegal_command_form"
        team = next((team for team in self.match.teams if team.name in ("", name[1])), None)
        if team is None:
            return "no_more_team"
        team.name = name[1]
        version = version_in(text, default=3)
        is_goalie = "(goalie)" in text
        if team.size == 11 or (is_goalie and team.has_goalie) or not 1 <= version <= 19:
            return "no_more_player_or_goalie_or_illegal_client_version"
        player = team.players[team.size]
        team.size += 1
        team.has_goalie |= is_goalie
        player.state = STAND | GOALIE if is_goalie else STAND
        client = Client(address, team=team, player=player)
        self.log(client, text)
        welcome = f"(init {team.side} {player.unum} {self.match.mode})"
        self.add(client, f"(v{version}) player ({team.name} {player.unum})", [welcome, *self.match.parameters])
        return None

    def add_again(self, text: str, address: tuple[str, int]) -> str | None:
        """Takes back a player whose connection was lost; the real server refuses it in play_on, this one never."""
        _, name, unum = text.strip("()").split()
        team = next((team for team in self.match.teams if team.name == name), None)
        player = team.players[int(unum) - 1] if team else None
        if player is None or player.state & STAND:
            return "no_such_team_or_player"
        player.state = STAND | (GOALIE if player.unum == 1 else 0)
        client = Client(address, team=team, player=player)
        self.log(client, text)
        welcome = f"(reconnect {team.side} {self.match.mode})"
        self.add(client, f"(reconnect) player ({team.name} {unum})", [welcome, *self.match.parameters])
        return None

    def add_coach(self, text: str, address: tuple[str, int]) -> str | None:
        names = COACH_INIT.match(text)
        if names is None:
            return "illegal_command_form"
        team = next((team for team in self.match.teams if team.name == names[1]), None)
        if team is None:
            return "no_such_team"
        if any(client.team is team and client.player is None for client in self.clients.values()):
            return "already_have_coach"
        team.coach_name = names[2] or ""
        client = Client(address, team=team)
        self.log(client, text)
        self.add(client, f"(v{version_in(text, default=5)}) online coach ({team.name})", [f"(init {team.side} ok)"])
        return None

    def add_monitor(self, text: str, address: tuple[str, int]) -> str | None:
        version = version_in(text, default=1)
        if version not in (3, 4, 5):
            return "illegal_client_version"
        client = Client(address)
        client.monitor_version = version
        self.add(client, f"(v{version}) monitor", self.match.parameters)
        return None


def version_in(text: str, *, default: int) -> int:
    found = VERSION.search(text)
    return int(found[1]) if found else default


def main() -> None:
    print("rcssserver-19.0.0\n", flush=True)
    options = read_options(sys.argv[1:])
    write_missing(options)
    print(f"Simulator Random Seed: {int(time.time())}", flush=True)
    server = Server(options)

    def stop(*_: object) -> None:
        server.match.over = "Server Killed. Exiting..."

    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, stop)
    print("\nHit CTRL-C to exit", flush=True)
    server.run()


if __name__ == "__main__":
    main()
