"""Scanning kernels: bytes of a text log to arrays of numbers, compiled by Numba.

They allocate nothing and raise nothing: what they cannot read they mark, and the callers in `rcg_text` and `rcl`
say it in words. A number is read as an integer mantissa over a power of ten, which is exact for the digits that
logs hold (fewer than 16).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from teamclone.rcss.commands import CommandKind

Bytes = NDArray[np.uint8]

_POWERS = 10.0 ** np.arange(23)

# Where the float columns of a player stand in the array that scan_shows fills.
PLAYER_FLOATS = (
    "x",
    "y",
    "vx",
    "vy",
    "body",
    "neck",
    "pointto_x",
    "pointto_y",
    "view_width",
    "focus_distance",
    "focus_direction",
    "stamina",
    "effort",
    "recovery",
    "capacity",
)
N_COUNTERS = 12

# Outcomes of a show line.
OK = 0
BAD_NUMBER = 1
BAD_STRUCTURE = 2
WRONG_PLAYERS = 3


@njit(cache=True, inline="always")
def _is_digit(byte: int) -> bool:
    return 48 <= byte <= 57


@njit(cache=True)
def _number(buffer: Bytes, start: int, stop: int) -> tuple[float, int]:
    """The number at ``start`` and the position behind it; -1 for the position where there is none.

    nan and inf, which C++ streams print for broken values, are read as NaN.
    """
    position = start
    negative = False
    if position < stop and (buffer[position] == 45 or buffer[position] == 43):
        negative = buffer[position] == 45
        position += 1
    mantissa = 0
    decimals = 0
    digits = 0
    while position < stop and _is_digit(buffer[position]):
        if digits < 18:
            mantissa = mantissa * 10 + (buffer[position] - 48)
        else:
            decimals -= 1
        digits += 1
        position += 1
    if position < stop and buffer[position] == 46:
        position += 1
        if position >= stop or not _is_digit(buffer[position]):
            return np.nan, -1
        while position < stop and _is_digit(buffer[position]):
            if digits < 18:
                mantissa = mantissa * 10 + (buffer[position] - 48)
                decimals += 1
            digits += 1
            position += 1
    if digits == 0:
        if position + 3 <= stop and (
            (buffer[position] == 110 and buffer[position + 1] == 97 and buffer[position + 2] == 110)
            or (buffer[position] == 105 and buffer[position + 1] == 110 and buffer[position + 2] == 102)
        ):
            return np.nan, position + 3
        return np.nan, -1
    exponent = 0
    if position < stop and (buffer[position] == 101 or buffer[position] == 69):
        position += 1
        down = False
        if position < stop and (buffer[position] == 45 or buffer[position] == 43):
            down = buffer[position] == 45
            position += 1
        if position >= stop or not _is_digit(buffer[position]):
            return np.nan, -1
        while position < stop and _is_digit(buffer[position]):
            if exponent < 1000:
                exponent = exponent * 10 + (buffer[position] - 48)
            position += 1
        if down:
            exponent = -exponent
    scale = exponent - decimals
    value = float(mantissa)
    while scale > 22:
        value *= _POWERS[22]
        scale -= 22
        if value == np.inf:
            break
    while scale < -22:
        value /= _POWERS[22]
        scale += 22
        if value == 0.0:
            break
    value = value * _POWERS[scale] if scale >= 0 else value / _POWERS[-scale]
    return (-value if negative else value), position


@njit(cache=True)
def _hexadecimal(buffer: Bytes, start: int, stop: int) -> tuple[int, int]:
    """``0x..`` or a plain decimal at ``start`` and the position behind it; -1 where there is none."""
    position = start
    value = 0
    if position + 1 < stop and buffer[position] == 48 and buffer[position + 1] == 120:
        position += 2
        first = position
        while position < stop:
            byte = buffer[position]
            if _is_digit(byte):
                digit = byte - 48
            elif 97 <= byte <= 102:
                digit = byte - 87
            elif 65 <= byte <= 70:
                digit = byte - 55
            else:
                break
            value = (value * 16 + digit) & 0xFFFFFFFF
            position += 1
        return value, (position if position > first else -1)
    first = position
    while position < stop and _is_digit(buffer[position]):
        value = (value * 10 + (buffer[position] - 48)) & 0xFFFFFFFF
        position += 1
    return value, (position if position > first else -1)


@njit(cache=True, inline="always")
def _blank(buffer: Bytes, position: int, stop: int) -> int:
    while position < stop and (buffer[position] == 32 or buffer[position] == 9 or buffer[position] == 13):
        position += 1
    return position


@njit(cache=True)
def _expect(buffer: Bytes, position: int, stop: int, byte: int) -> int:
    """The position behind blanks and ``byte``; -1 where something else stands."""
    if position < 0:
        return -1
    position = _blank(buffer, position, stop)
    if position < stop and buffer[position] == byte:
        return position + 1
    return -1


@njit(cache=True)
def _skip_group(buffer: Bytes, position: int, stop: int) -> int:
    """The position behind the closing parenthesis of the group we are in; -1 where it does not close."""
    depth = 1
    while position < stop:
        if buffer[position] == 40:
            depth += 1
        elif buffer[position] == 41:
            depth -= 1
            if depth == 0:
                return position + 1
        position += 1
    return -1


@njit(cache=True)
def _scan_player(
    buffer: Bytes,
    position: int,
    stop: int,
    frame: int,
    floats: Any,
    types: Any,
    states: Any,
    qualities: Any,
    attention_sides: Any,
    attention_unums: Any,
    counters: Any,
) -> tuple[int, int]:
    """Reads ``((l 1) 0 0x9 ...)`` behind its first parenthesis: (position behind it or of the error, slot or -code)."""
    begin = position
    position = _expect(buffer, position, stop, 40)
    if position < 0 or position + 1 >= stop:
        return begin, -BAD_STRUCTURE
    side = buffer[position]
    if side != 108 and side != 114:
        return begin, -BAD_STRUCTURE
    number, position = _number(buffer, _blank(buffer, position + 1, stop), stop)
    if position < 0 or not 1 <= number <= 11:
        return begin, -BAD_STRUCTURE
    slot = int(number) - 1 + (11 if side == 114 else 0)
    position = _expect(buffer, position, stop, 41)
    if position < 0:
        return begin, -BAD_STRUCTURE
    value, after = _number(buffer, _blank(buffer, position, stop), stop)
    if after < 0:
        return position, -BAD_NUMBER
    types[frame, slot] = np.uint8(int(value) & 0xFF) if value == value else np.uint8(0)
    bits, position = _hexadecimal(buffer, _blank(buffer, after, stop), stop)
    if position < 0:
        return after, -BAD_NUMBER
    states[frame, slot] = bits
    count = 0
    while True:
        at = _blank(buffer, position, stop)
        if at >= stop:
            return at, -BAD_STRUCTURE
        if buffer[at] == 40 or buffer[at] == 41:
            break
        value, position = _number(buffer, at, stop)
        if position < 0:
            return at, -BAD_NUMBER
        if count < 8:
            floats[count, frame, slot] = value
        count += 1
    if count != 6 and count != 8:
        return at, -BAD_STRUCTURE
    position = at
    while position < stop and buffer[position] == 40:
        position += 1
        tag = buffer[position] if position < stop else 0
        second = buffer[position + 1] if position + 1 < stop else 0
        if tag == 118:  # v: view
            at = _blank(buffer, position + 1, stop)
            qualities[frame, slot] = 1 if at < stop and buffer[at] == 104 else 0
            value, after = _number(buffer, _blank(buffer, at + 1, stop), stop)
            if after < 0:
                return at, -BAD_NUMBER
            floats[8, frame, slot] = value
            position = after
        elif tag == 102 and second == 112:  # fp: focus point
            position += 2
            for index in range(9, 11):
                value, after = _number(buffer, _blank(buffer, position, stop), stop)
                if after < 0:
                    return position, -BAD_NUMBER
                floats[index, frame, slot] = value
                position = after
        elif tag == 115:  # s: stamina, effort, recovery and, from version 5, capacity
            position += 1
            for index in range(11, 15):
                at = _blank(buffer, position, stop)
                if index == 14 and at < stop and buffer[at] == 41:
                    break
                value, after = _number(buffer, at, stop)
                if after < 0:
                    return at, -BAD_NUMBER
                floats[index, frame, slot] = value
                position = after
        elif tag == 102:  # f: whom he listens to
            at = _blank(buffer, position + 1, stop)
            if at < stop:
                attention_sides[frame, slot] = 1 if buffer[at] == 108 else -1
            value, after = _number(buffer, _blank(buffer, at + 1, stop), stop)
            if after < 0 or not 0 <= value <= 255:
                return at, -BAD_NUMBER
            attention_unums[frame, slot] = np.uint8(value)
            position = after
        elif tag == 99:  # c: counters
            position += 1
            index = 0
            while True:
                at = _blank(buffer, position, stop)
                if at < stop and buffer[at] == 41:
                    break
                value, after = _number(buffer, at, stop)
                if after < 0 or not abs(value) < 2147483648.0:
                    return at, -BAD_NUMBER
                if index < N_COUNTERS:
                    counters[index, frame, slot] = np.int32(value)
                index += 1
                position = after
        position = _skip_group(buffer, position, stop)
        if position < 0:
            return stop, -BAD_STRUCTURE
        position = _blank(buffer, position, stop)
    position = _expect(buffer, position, stop, 41)
    if position < 0:
        return stop, -BAD_STRUCTURE
    return position, slot


@njit(cache=True)
def scan_shows(
    buffer: Bytes,
    starts: NDArray[np.int64],
    stops: NDArray[np.int64],
    cycles: NDArray[np.int32],
    ball: NDArray[np.float32],
    floats: NDArray[np.float32],
    types: NDArray[np.uint8],
    states: NDArray[np.uint32],
    qualities: NDArray[np.uint8],
    attention_sides: NDArray[np.int8],
    attention_unums: NDArray[np.uint8],
    counters: NDArray[np.int32],
    outcomes: NDArray[np.uint8],
    places: NDArray[np.int64],
) -> int:
    """Reads n lines ``(show ...)`` of log versions 4 to 6.

    Args:
        buffer: the log.
        starts, stops: (n,) where each line begins and ends.
        cycles: (n,); ball: (4, n); floats: (15, n, 22) in the order of PLAYER_FLOATS; types, states, qualities,
            attention_sides, attention_unums: (n, 22); counters: (12, n, 22). Filled; rows of bad lines are undefined.
        outcomes: (n,) OK or what is wrong; places: (n,) the byte where it is wrong.

    Returns:
        How many lines are good.
    """
    good = 0
    for frame in range(len(starts)):
        stop = stops[frame]
        position = starts[frame] + 6
        value, after = _number(buffer, _blank(buffer, position, stop), stop)
        cycles[frame] = -1
        if after < 0 or not 0 <= value < 2147483648.0:
            outcomes[frame] = BAD_NUMBER
            places[frame] = position
            continue
        cycles[frame] = np.int32(value)
        position = _expect(buffer, after, stop, 40)
        position = _expect(buffer, position, stop, 40)
        position = _expect(buffer, position, stop, 98)
        position = _expect(buffer, position, stop, 41)
        if position < 0:
            outcomes[frame] = BAD_STRUCTURE
            places[frame] = after
            continue
        bad = False
        for index in range(4):
            value, after = _number(buffer, _blank(buffer, position, stop), stop)
            if after < 0:
                bad = True
                break
            ball[index, frame] = value
            position = after
        if bad:
            outcomes[frame] = BAD_NUMBER
            places[frame] = position
            continue
        after = _expect(buffer, position, stop, 41)
        if after < 0:
            outcomes[frame] = BAD_STRUCTURE
            places[frame] = position
            continue
        position = after
        outcome = OK
        seen = 0
        while True:
            at = _blank(buffer, position, stop)
            if at >= stop:
                outcome = BAD_STRUCTURE
                break
            if buffer[at] == 41:
                position = at + 1
                break
            if buffer[at] != 40:
                outcome = BAD_STRUCTURE
                break
            # Monitor packets put (pm ..) and (tm ..) before the players; logs do not.
            if at + 1 < stop and buffer[at + 1] != 40:
                position = _skip_group(buffer, at + 1, stop)
                if position < 0:
                    outcome = BAD_STRUCTURE
                    position = at
                    break
                continue
            position, slot = _scan_player(
                buffer,
                at + 1,
                stop,
                frame,
                floats,
                types,
                states,
                qualities,
                attention_sides,
                attention_unums,
                counters,
            )
            if slot < 0:
                outcome = -slot
                break
            seen |= 1 << slot
        if outcome == OK and seen != (1 << 22) - 1:
            outcome = WRONG_PLAYERS
        if outcome == OK and _blank(buffer, position, stop) != stop:
            outcome = BAD_STRUCTURE
        outcomes[frame] = outcome
        places[frame] = position
        if outcome == OK:
            good += 1
    return good


# How the arguments of a command are read.
_TEXT = 0
_NUMBERS = 1

_WORDS = tuple(kind.name.lower().encode() for kind in CommandKind)
_WORD_LENGTHS = np.array([len(word) for word in _WORDS], np.int64)
_WORD_BYTES = np.zeros((len(_WORDS), max(map(len, _WORDS))), np.uint8)
for _index, _word in enumerate(_WORDS):
    _WORD_BYTES[_index, : len(_word)] = np.frombuffer(_word, np.uint8)
_LONGEST = _WORD_BYTES.shape[1]


def _numbers_of(fewest: int, most: int, *kinds: CommandKind) -> list[tuple[int, int, int]]:
    return [(int(kind), fewest, most) for kind in kinds]


# (kind, fewest numbers, most numbers) of the player commands whose arguments are numbers (player_command_parser.ypp).
_FEWEST = np.zeros(len(_WORDS), np.int64)
_MOST = np.full(len(_WORDS), -1, np.int64)
for _kind, _fewest, _most in (
    *_numbers_of(1, 1, CommandKind.TURN, CommandKind.CATCH, CommandKind.TURN_NECK, CommandKind.COMPRESSION),
    *_numbers_of(1, 2, CommandKind.DASH),
    *_numbers_of(1, 1, CommandKind.TACKLE),
    *_numbers_of(2, 2, CommandKind.KICK, CommandKind.MOVE, CommandKind.CHANGE_FOCUS, CommandKind.LONG_KICK),
    *_numbers_of(2, 2, CommandKind.POINTTO),
):
    _FEWEST[_kind] = _fewest
    _MOST[_kind] = _most

_CHANGE_VIEW = int(CommandKind.CHANGE_VIEW)
_DASH = int(CommandKind.DASH)
_SAY = int(CommandKind.SAY)
_TACKLE = int(CommandKind.TACKLE)
_POINTTO = int(CommandKind.POINTTO)
_ILLEGAL = int(CommandKind.ILLEGAL)


@njit(cache=True)
def _kind_of(buffer: Bytes, start: int, stop: int) -> int:
    length = stop - start
    if length == 0 or length > _LONGEST:
        return _ILLEGAL
    for kind in range(1, len(_WORD_LENGTHS)):
        if _WORD_LENGTHS[kind] != length:
            continue
        same = True
        for index in range(length):
            if _WORD_BYTES[kind, index] != buffer[start + index]:
                same = False
                break
        if same:
            return kind
    return _ILLEGAL


_FLAGS = (b"on", b"off", b"true", b"false")
_WIDTHS = (b"narrow", b"normal", b"wide")
_QUALITIES = (b"high", b"low")


def _alphabet(words: tuple[bytes, ...]) -> NDArray[np.uint8]:
    """Words as rows of bytes, padded with zeros."""
    rows = np.zeros((len(words), max(map(len, words)) + 1), np.uint8)
    for row, word in zip(rows, words, strict=True):
        row[: len(word)] = np.frombuffer(word, np.uint8)
    return rows


_FLAG_BYTES, _WIDTH_BYTES, _QUALITY_BYTES = _alphabet(_FLAGS), _alphabet(_WIDTHS), _alphabet(_QUALITIES)


@njit(cache=True)
def _word_of(buffer: Bytes, position: int, stop: int, words: NDArray[np.uint8]) -> int:
    """The position behind the blanks and the one of ``words`` that stand here; -1 where none does."""
    position = _blank(buffer, position, stop)
    for row in range(len(words)):
        at = position
        index = 0
        while words[row, index] != 0 and at < stop and buffer[at] == words[row, index]:
            at += 1
            index += 1
        if words[row, index] == 0 and (at == stop or buffer[at] == 32 or buffer[at] == 9):
            return at
    return -1


@njit(cache=True)
def _close(buffer: Bytes, position: int, stop: int) -> int:
    """The closing parenthesis of the command we are in, quotes respected; -1 where it does not close."""
    depth = 1
    quoted = False
    while position < stop:
        byte = buffer[position]
        if byte == 34:
            quoted = not quoted
        elif not quoted:
            if byte == 40:
                depth += 1
            elif byte == 41:
                depth -= 1
                if depth == 0:
                    return position
        position += 1
    return -1


@njit(cache=True)
def _plain_numbers(
    buffer: Bytes, position: int, stop: int, row: int, first: int, most: int, args: Any
) -> tuple[int, int]:
    """Reads up to ``most`` finite numbers into args[first:, row]: (how many or -1 for a bad one, position behind)."""
    count = 0
    while True:
        position = _blank(buffer, position, stop)
        if position >= stop or not (
            _is_digit(buffer[position]) or buffer[position] == 45 or buffer[position] == 43 or buffer[position] == 46
        ):
            return count, position
        value, after = _number(buffer, position, stop)
        # The server's lexer knows neither nan nor a number glued to letters.
        if after < 0 or value != value or (after < stop and buffer[after] != 32 and buffer[after] != 9):
            return -1, position
        if count >= most:
            return -1, position
        args[first + count, row] = value
        count += 1
        position = after


@njit(cache=True)
def _legs(buffer: Bytes, position: int, stop: int, row: int, args: Any) -> int:
    """Reads ``(l P D)(r P D)`` of a two-leg dash: bit 1 left, bit 2 right; -1 where it is wrong."""
    legs = 0
    while True:
        position = _blank(buffer, position, stop)
        if position >= stop:
            return legs if legs > 0 else -1
        if buffer[position] != 40:
            return -1
        close = _close(buffer, position + 1, stop)
        if close < 0:
            return -1
        position = _blank(buffer, position + 1, close)
        start = position
        while position < close and 97 <= buffer[position] <= 122:
            position += 1
        length = position - start
        leg = 0
        if (length == 1 or length == 4) and buffer[start] == 108:
            leg = 1
        elif (length == 1 or length == 5) and buffer[start] == 114:
            leg = 2
        if leg == 0 or legs & leg:
            return -1
        count, after = _plain_numbers(buffer, position, close, row, 0 if leg == 1 else 2, 2, args)
        if count != 2 or _blank(buffer, after, close) != close:
            return -1
        legs |= leg
        position = close + 1


@njit(cache=True)
def _scan_command(
    buffer: Bytes,
    position: int,
    stop: int,
    of_player: bool,
    row: int,
    kinds: Any,
    legs: Any,
    valid: Any,
    args: Any,
    text_starts: Any,
    text_stops: Any,
) -> int:
    """Reads the command that begins at ``position``; the position behind it, ``stop`` where the rest is garbage."""
    text_starts[row] = text_stops[row] = position
    kinds[row] = _ILLEGAL
    valid[row] = False
    legs[row] = 0
    for index in range(4):
        args[index, row] = np.nan
    if buffer[position] != 40:
        text_stops[row] = stop
        return stop
    start = _blank(buffer, position + 1, stop)
    at = start
    while at < stop and (97 <= buffer[at] <= 122 or buffer[at] == 95):
        at += 1
    kind = _kind_of(buffer, start, at)
    begin = _blank(buffer, at, stop)
    close = _close(buffer, at, stop)
    # An unquoted say takes the rest of the datagram (the server's lexer: longest match).
    if kind == _SAY and of_player and begin < stop and buffer[begin] != 34:
        close = stop - 1
        while close > begin and buffer[close] != 41:
            close -= 1
    if close < 0:
        text_stops[row] = stop
        return stop
    kinds[row] = kind
    end = close
    while end > begin and (buffer[end - 1] == 32 or buffer[end - 1] == 9):
        end -= 1
    fine = kind != _ILLEGAL
    if kind == _SAY and end - begin >= 2 and buffer[begin] == 34 and buffer[end - 1] == 34:
        begin += 1
        end -= 1
    most = _MOST[kind]
    if of_player and most >= 0:
        if kind == _DASH and begin < end and buffer[begin] == 40:
            found = _legs(buffer, begin, end, row, args)
            fine = found > 0
            legs[row] = max(found, 0)
            begin = end
        elif kind == _POINTTO and begin < end and buffer[begin] == 111:
            fine = end - begin == 3
        else:
            count, after = _plain_numbers(buffer, begin, end, row, 0, most, args)
            last = after
            if kind == _TACKLE and count == 1 and after < end:
                last = _word_of(buffer, after, end, _FLAG_BYTES)
            fine = count >= _FEWEST[kind] and last == end
            if fine:
                begin = after
                if kind == _DASH and count == 1:
                    args[1, row] = 0.0
    elif of_player and kind == _CHANGE_VIEW:
        last = _word_of(buffer, begin, end, _WIDTH_BYTES)
        if 0 <= last < end:
            last = _word_of(buffer, last, end, _QUALITY_BYTES)
        fine = last == end
    if not fine:
        for index in range(4):
            args[index, row] = np.nan
    text_starts[row] = begin
    text_stops[row] = max(begin, end)
    valid[row] = fine
    return close + 1


# What a line of a command log is.
_LINE_OTHER = 0
_LINE_REFEREE = 1
_LINE_ODD = 2
_LINE_STRANGER = 3


@njit(cache=True)
def _stamp(buffer: Bytes, position: int, stop: int) -> tuple[int, int, int]:
    """Reads ``TIME,STOP<tab>`` or ``TIME<tab>``: time, stoppage (-1 if absent), position behind (-1 if neither)."""
    values = np.zeros(2, np.int64)
    values[1] = -1
    for index in range(2):
        first = position
        value = 0
        while position < stop and _is_digit(buffer[position]) and position - first < 10:
            value = value * 10 + (buffer[position] - 48)
            position += 1
        if position == first or value > 2147483647:
            return 0, 0, -1
        values[index] = value
        if index == 0 and position < stop and buffer[position] == 44:
            position += 1
            continue
        break
    if position < stop and buffer[position] == 9:
        return values[0], values[1], position + 1
    return 0, 0, -1


@njit(cache=True)
def _same(buffer: Bytes, start: int, stop: int, name: Bytes) -> bool:
    if len(name) == 0 or stop - start != len(name):
        return False
    for index in range(len(name)):
        if buffer[start + index] != name[index]:
            return False
    return True


@njit(cache=True)
def scan_commands(
    buffer: Bytes,
    starts: NDArray[np.int64],
    stops: NDArray[np.int64],
    left: Bytes,
    right: Bytes,
    cycles: NDArray[np.int32],
    stoppages: NDArray[np.int32],
    lines: NDArray[np.int32],
    orders: NDArray[np.int32],
    sides: NDArray[np.int8],
    unums: NDArray[np.uint8],
    kinds: NDArray[np.uint8],
    legs: NDArray[np.uint8],
    valid: NDArray[np.bool_],
    args: NDArray[np.float32],
    text_starts: NDArray[np.int64],
    text_stops: NDArray[np.int64],
    line_classes: NDArray[np.uint8],
    line_stamps: NDArray[np.int32],
) -> int:
    """Reads the lines of a command log.

    Args:
        buffer: the log; starts, stops: (n_lines,) its lines.
        left, right: team names; a line whose sender is neither is marked as a stranger's and not read.
        cycles .. text_stops: filled, one value a command; args is (4, capacity). The capacity must be at least the
            number of "(" plus the number of lines.
        line_classes: (n_lines,) 0 read or of no interest, 1 referee, 2 odd, 3 from a stranger.
        line_stamps: (n_lines, 2) time and stoppage; stoppage -1 where the log has none.

    Returns:
        How many commands were read.
    """
    row = 0
    last_cycle = np.full((3, 12), -1, np.int64)
    last_stoppage = np.full((3, 12), -2, np.int64)
    last_order = np.zeros((3, 12), np.int64)
    for line in range(len(starts)):
        stop = stops[line]
        if stop > starts[line] and buffer[stop - 1] == 13:
            stop -= 1
        line_classes[line] = _LINE_OTHER
        line_stamps[line, 0] = -1
        line_stamps[line, 1] = -1
        if _blank(buffer, starts[line], stop) == stop:
            continue
        cycle, stoppage, position = _stamp(buffer, starts[line], stop)
        if position < 0:
            line_classes[line] = _LINE_ODD
            continue
        line_stamps[line, 0] = cycle
        line_stamps[line, 1] = stoppage
        if position < stop and buffer[position] == 40:
            line_classes[line] = _LINE_REFEREE
            continue
        # "Recv "
        if not (
            position + 5 < stop
            and buffer[position] == 82
            and buffer[position + 1] == 101
            and buffer[position + 2] == 99
            and buffer[position + 3] == 118
            and buffer[position + 4] == 32
        ):
            continue
        name_start = position + 5
        position = name_start
        while position < stop and buffer[position] != 32:
            position += 1
        colon = position - 1
        if colon <= name_start or buffer[colon] != 58:
            line_classes[line] = _LINE_ODD
            continue
        underscore = colon - 1
        while underscore > name_start and buffer[underscore] != 95:
            underscore -= 1
        unum = 0
        side = 0
        if buffer[underscore] == 95:
            number = 0
            numeric = True
            for at in range(underscore + 1, colon):
                if not _is_digit(buffer[at]) or number > 99:
                    numeric = False
                    break
                number = number * 10 + (buffer[at] - 48)
            if numeric and (colon == underscore + 1 or not 1 <= number <= 11):
                line_classes[line] = _LINE_ODD
                continue
            unum = number if numeric else 0
            if _same(buffer, name_start, underscore, left):
                side = 1
            elif _same(buffer, name_start, underscore, right):
                side = -1
            else:
                line_classes[line] = _LINE_STRANGER
                continue
        position += 1
        broken = False
        if last_cycle[side + 1, unum] != cycle or last_stoppage[side + 1, unum] != stoppage:
            last_cycle[side + 1, unum] = cycle
            last_stoppage[side + 1, unum] = stoppage
            last_order[side + 1, unum] = 0
        while True:
            position = _blank(buffer, position, stop)
            if position >= stop:
                break
            position = _scan_command(
                buffer, position, stop, unum > 0, row, kinds, legs, valid, args, text_starts, text_stops
            )
            # A syntax error ends the server's reading of the datagram.
            broken = broken or not valid[row]
            valid[row] = not broken
            cycles[row] = cycle
            stoppages[row] = stoppage
            lines[row] = line + 1
            orders[row] = last_order[side + 1, unum]
            last_order[side + 1, unum] += 1
            sides[row] = side
            unums[row] = unum
            row += 1
    return row
