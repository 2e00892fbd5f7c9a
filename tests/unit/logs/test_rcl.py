"""Single messages, as section 3 of the server's grammar has them (rcssserver `player_command_parser.ypp`)."""

from __future__ import annotations

import math

import numpy as np
import pytest

from teamclone.errors import LogError
from teamclone.logs.match import CommandLog
from teamclone.logs.rcl import read_commands
from teamclone.rcss.commands import CommandKind


def read(*lines: str) -> CommandLog:
    return read_commands("".join(line + "\n" for line in lines).encode(), left="A", right="B_2")


def commands_of(message: str) -> list[tuple[str, bool, tuple[float, ...], int, str]]:
    """(kind, valid, numbers, legs, text) of each command of one message."""
    log = read(f"10,0\tRecv A_7: {message}")
    found = []
    for row, kind in enumerate(log.commands["kind"]):
        numbers = tuple(float(log.commands[f"arg{index}"][row]) for index in range(4))
        while numbers and math.isnan(numbers[-1]):
            numbers = numbers[:-1]
        start, stop = log.commands["text_start"][row], log.commands["text_stop"][row]
        found.append(
            (
                CommandKind(kind).name.lower(),
                bool(log.commands["valid"][row]),
                numbers,
                int(log.commands["legs"][row]),
                log.text[start:stop].decode(),
            )
        )
    return found


def test_every_command_of_a_message():
    assert commands_of('(dash 100)(turn_neck 23.5)(attentionto our 9)(say "d(f.x<2 a")(done)') == [
        ("dash", True, (100.0, 0.0), 0, ""),
        ("turn_neck", True, (23.5,), 0, ""),
        ("attentionto", True, (), 0, "our 9"),
        ("say", True, (), 0, "d(f.x<2 a"),
        ("done", True, (), 0, ""),
    ]


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("(dash 80 -45.5)", ("dash", True, (80.0, -45.5), 0, "")),
        ("(kick 61.5 -20)", ("kick", True, (61.5, -20.0), 0, "")),
        ("(turn +1e1)", ("turn", True, (10.0,), 0, "")),
        ("(turn .5)", ("turn", True, (0.5,), 0, "")),
        # Without a point it is an int of 32 bits, which wraps.
        ("(turn 4294967386)", ("turn", True, (90.0,), 0, "")),
        ("(turn 3000000000)", ("turn", True, (-1294967296.0,), 0, "")),
        ("(turn 99999999999999999999)", ("turn", True, (-1.0,), 0, "")),
        ("(turn 4294967386.0)", ("turn", True, (float(np.float32(4294967386.0)),), 0, "")),
        ("( turn  10 )", ("turn", True, (10.0,), 0, "")),
        ("(tackle 30)", ("tackle", True, (30.0,), 0, "")),
        ("(tackle 30 maybe)", ("tackle", False, (), 0, "30 maybe")),
        ("(change_view bad)", ("change_view", False, (), 0, "bad")),
        ("(change_view wide)", ("change_view", True, (), 0, "wide")),
        ("(tackle 30 on)", ("tackle", True, (30.0,), 0, "on")),
        ("(catch -90)", ("catch", True, (-90.0,), 0, "")),
        ("(move -10 5)", ("move", True, (-10.0, 5.0), 0, "")),
        ("(change_focus 10 20)", ("change_focus", True, (10.0, 20.0), 0, "")),
        ("(change_view narrow high)", ("change_view", True, (), 0, "narrow high")),
        ("(pointto 10 20)", ("pointto", True, (10.0, 20.0), 0, "")),
        ("(pointto off)", ("pointto", True, (), 0, "off")),
        ("(init A (version 19) (goalie))", ("init", True, (), 0, "A (version 19) (goalie)")),
        ("(say hello)(turn 30)", ("say", True, (), 0, "hello)(turn 30")),
    ],
)
def test_one_command(message: str, expected: tuple):
    assert commands_of(message) == [expected]


def test_two_leg_dashes():
    assert commands_of("(dash (l 50 -30) (r 100 0))") == [("dash", True, (50.0, -30.0, 100.0, 0.0), 3, "")]
    assert commands_of("(dash (r 100 0)(left 50 -30))") == [("dash", True, (50.0, -30.0, 100.0, 0.0), 3, "")]
    ((_, valid, numbers, legs, _),) = commands_of("(dash (right 10 20))")
    assert (valid, legs, numbers[2:]) == (True, 2, (10.0, 20.0))
    assert np.isnan(numbers[:2]).all()
    assert commands_of("(dash (l 50))")[0][:4] == ("dash", False, (), 0)
    assert commands_of("(dash (l 50 0)(l 50 0))")[0][1] is False


@pytest.mark.parametrize(
    "message",
    [
        "(dash 100.)",
        "(dash nan)",
        "(dash -nan 10)",
        "(kick inf 0)",
        "(turn)",
        "(dash 1 2 3)",
        "(turn 0x10)",
        "(turn 1,5)",
        "(turn 10",
        "turn",
    ],
)
def test_what_the_server_refuses(message: str):
    assert [valid for _, valid, *_ in commands_of(message)] == [False]


def test_a_mistake_ends_a_message_but_not_what_stands_before_it():
    assert [(kind, valid) for kind, valid, *_ in commands_of("(turn 10)(foo)(turn 5)")] == [
        ("turn", True),
        ("illegal", False),
        ("turn", False),
    ]
    assert [(kind, valid) for kind, valid, *_ in commands_of('(turn 10)(say "at:3")(dash 60)')] == [
        ("turn", True),
        ("say", False),
        ("dash", False),
    ]


def test_senders_and_stamps():
    log = read(
        "0,9\tRecv A_1: (init A (version 19) (goalie))",
        "3,0\t(referee kick_off_l)",
        "3,7\tRecv B_2_11: (turn 1)(turn 2)",
        "3,7\tRecv B_2_11: (turn 3)",
        "3,8\tRecv B_2_11: (turn 4)",
        "3,8\tRecv A_Coach: (done)",
        "3,8\tRecv Coach: (start)",
        "3,8\tRecv A_2: ",
        "CYCLE_TIMES: 3",
    )
    commands = log.commands
    columns = ("line", "cycle", "stoppage", "side", "unum", "order")
    assert list(zip(*(commands[name].tolist() for name in columns), strict=True)) == [
        (1, 0, 9, 1, 1, 0),
        (3, 3, 7, -1, 11, 0),
        (3, 3, 7, -1, 11, 1),
        (4, 3, 7, -1, 11, 2),
        (5, 3, 8, -1, 11, 0),
        (6, 3, 8, 1, 0, 0),
        (7, 3, 8, 0, 0, 0),
    ]
    assert log.has_stoppage
    assert log.event_texts == ("kick_off_l",)
    assert (log.events["cycle"][0], log.events["stoppage"][0], log.events["line"][0]) == (3, 0, 2)
    assert [problem.code for problem in log.problems] == ["odd-line"]


def test_servers_12_stamp_without_the_stoppage_counter():
    log = read("10\tRecv A_7: (turn 10)", "11\tRecv A_7: (turn 11)")
    assert not log.has_stoppage
    assert log.commands["cycle"].tolist() == [10, 11]
    assert log.commands["stoppage"].tolist() == [0, 0]


@pytest.mark.parametrize(
    ("line", "code"),
    [
        ("10,0\tRecv C_3: (turn 1)", "unknown-sender"),
        ("10,0\tRecv A_12: (turn 1)", "odd-line"),
        ("10,0\tRecv A_0: (turn 1)", "odd-line"),
        ("x,0\tRecv A_1: (turn 1)", "odd-line"),
    ],
)
def test_lines_that_are_left_out_and_named(line: str, code: str):
    log = read("9,0\tRecv A_1: (turn 5)", line, "11,0\tRecv A_1: (turn 6)")
    assert log.commands["arg0"].tolist() == [5, 6]
    (problem,) = log.problems
    assert (problem.code, problem.line) == (code, 2)


def test_a_message_goes_on_in_lines_without_a_stamp():
    """A client may send line breaks between commands; the server runs all of them and logs the message as it came."""
    log = read(
        *("(turn 1)", "9,0\tRecv A_1: (change_view wide)", "  (dash 60)", "(turn_neck 5)", "10,0\tRecv A_2: (turn 6)"),
        *("", "(dash 7)"),
    )
    kinds = [CommandKind(kind).name for kind in log.commands["kind"]]
    assert kinds == ["CHANGE_VIEW", "DASH", "TURN_NECK", "TURN"]
    assert log.commands["line"].tolist() == [2, 2, 2, 5]
    assert log.commands["order"].tolist() == [0, 1, 2, 0]
    assert log.commands["valid"].all()
    assert log.commands["cycle"].tolist() == [9, 9, 9, 10]
    # Nothing comes before the first, and a blank line ends a message.
    (problem,) = log.problems
    assert (problem.code, problem.line) == ("odd-line", 1)
    assert problem.text.startswith("2 line(s)")


@pytest.mark.parametrize("data", [b"", b"\n\n", b"ULG6\n(show 1", b"hello\tworld\n"])
def test_not_a_command_log(data: bytes):
    with pytest.raises(LogError, match="not a command log"):
        read_commands(data, left="A", right="B")
