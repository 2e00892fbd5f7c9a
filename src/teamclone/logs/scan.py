"""Scanning kernels: bytes of a text log to arrays of numbers, compiled by Numba.

They allocate nothing and raise nothing: they mark what they cannot read, and the callers in `shows`, `rcg_text` and
`rcl` make problems of the marks.

Most of a log is short numbers and words of unforeseeable length, so a loop over bytes would cost a mispredicted branch
each. Where it matters eight bytes are taken as one 64-bit word (first byte lowest) and the questions "which byte is no
digit", "what number is this" are answered for all of them by arithmetic. A *mask* here has the highest bit of each byte
that is meant. Only `scan_shows` and `scan_commands` are called from Python; only they are cached on disk.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from teamclone.logs.columns import COUNTERS, PLAYERS
from teamclone.rcss.commands import CommandKind
from teamclone.rcss.players import N_PLAYERS, N_TEAM
from teamclone.system.compiling import cached_kernel, tell_when_compiled

Bytes = NDArray[np.uint8]

_POWERS = 10.0 ** np.arange(23)

PLAYER_FLOATS = tuple(column.name for column in PLAYERS if column.dtype == "float32")
"""The float columns of a player in their order in the array that scan_shows fills."""
_VIEW_WIDTH = PLAYER_FLOATS.index("view_width")
_FOCUS = PLAYER_FLOATS.index("focus_distance")
_STAMINA = PLAYER_FLOATS.index("stamina")
_CAPACITY = PLAYER_FLOATS.index("capacity")
N_COUNTERS = len(COUNTERS)

# Outcomes of a show line.
OK = 0
BAD_NUMBER = 1
BAD_STRUCTURE = 2
WRONG_PLAYERS = 3

# Kernels raise nothing (no Python test for division by zero) and allocate nothing: without Numba's runtime (nrt) no
# helper counts the references to its arrays, which took twice the time of the reading itself. Helpers are called from
# kernels alone and need no way in from Python or C, which halves the time to compile.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
_helper: Any = njit(**(_OPTIONS | {"no_cpython_wrapper": True}))
_kernel = cached_kernel(**_OPTIONS, nogil=True)

_int: Any = np.int64


@_helper
def _byte(buffer: Bytes, position: int) -> int:
    """Return the byte at a position that is not negative: spares Numba's test for indices that count from the end."""
    return buffer[np.uintp(position)]


@_helper
def _is_digit(byte: int) -> bool:
    return 48 <= byte <= 57


_ZERO = np.uint64(0)
_ONE = np.uint64(1)
_EIGHT = np.uint64(8)
_EVERY = np.uint64(0x0101010101010101)
_LOW_BITS = np.uint64(0x7F7F7F7F7F7F7F7F)
_HIGH_BITS = np.uint64(0x8080808080808080)


@_helper
def _word(buffer: Bytes, position: int) -> np.uint64:
    """Return eight bytes as one number, the first lowest; zeros behind the end of the buffer."""
    word = _ZERO
    if position + 8 <= len(buffer):
        for index in range(8):  # the compiler makes one load of it
            word |= np.uint64(_byte(buffer, position + index)) << np.uint64(8 * index)
    else:
        for index in range(len(buffer) - position):
            word |= np.uint64(_byte(buffer, position + index)) << np.uint64(8 * index)
    return word


@_helper
def _first(mask: np.uint64) -> int:
    """Return which byte a mask names first, 0 to 7; 8 for an empty mask."""
    if mask == _ZERO:
        return 8
    lowest = (mask & (~mask + _ONE)) >> np.uint64(7)  # 1 << 8 * index
    # The product moves the byte that holds the index to the top.
    return _int((lowest * np.uint64(0x0001020304050607)) >> np.uint64(56))


@_helper
def _below(n_bytes: int) -> np.uint64:
    """Return all bits of the first ``n_bytes`` bytes of a word."""
    if n_bytes >= 8:
        return ~_ZERO
    return (_ONE << np.uint64(8 * n_bytes)) - _ONE


@_helper
def _not_zero(word: np.uint64) -> np.uint64:
    """Return the mask of the bytes that are not zero."""
    return (((word & _LOW_BITS) + _LOW_BITS) | word) & _HIGH_BITS


@_helper
def _find(buffer: Bytes, position: int, stop: int, byte: int) -> int:
    """Return where ``byte`` stands first from ``position`` on; ``stop`` where it does not."""
    pattern = np.uint64(byte) * _EVERY
    while position < stop:
        found = _first(~_not_zero(_word(buffer, position) ^ pattern) & _HIGH_BITS)
        position += found
        if found < 8:
            return min(position, stop)
    return stop


@_helper
def _eight_digits(digits: np.uint64) -> int:
    """Return the number of eight decimal digits, one a byte, the first lowest: pairs, then fours, then all."""
    pairs = digits * np.uint64(10) + (digits >> _EIGHT)
    ends = np.uint64(0x000000FF000000FF)
    fours = (pairs & ends) * np.uint64(0x000F424000000064)
    return _int((fours + ((pairs >> np.uint64(16)) & ends) * np.uint64(0x0000271000000001)) >> np.uint64(32))


@_helper
def _number(buffer: Bytes, start: int, stop: int) -> tuple[float, int]:
    """Return the number at ``start`` and the position behind it; -1 for the position where there is none.

    The value is the double nearest to the text wherever the text has fewer than 16 digits. ``buffer[stop]``, where
    it exists, is no digit. nan and inf, which C++ streams print for broken values, are read as NaN.
    """
    if start >= stop or start + 10 > len(buffer):
        return _any_number(buffer, start, stop)
    negative = _byte(buffer, start) == 45
    position = start + _int(negative)
    word = _word(buffer, position)
    digits = word ^ (np.uint64(48) * _EVERY)
    # A byte of 10 or more gets its highest bit from the sum, one of 128 or more has it.
    others = (((digits & _LOW_BITS) + np.uint64(0x76) * _EVERY) | digits) & _HIGH_BITS
    ends = others & _not_zero(word ^ (np.uint64(46) * _EVERY))
    whole = _first(others)
    length = _first(ends)
    pointed = _int(whole < length)
    n_digits = length - pointed
    behind = _byte(buffer, position + length)
    # One test for all that is unusual: no digit before or behind the point, a second point, a foreign end.
    usual = (
        ((whole & 7) != 0)
        & (n_digits - whole >= pointed)
        & ((behind == 32) | (behind == 41))
        & (others & (others - _ONE) & _below(length) == _ZERO)
    )
    if not usual:
        return _any_number(buffer, start, stop)
    before = _below(whole)
    digits = (digits & before) | ((digits >> _EIGHT) & ~before)
    mantissa = _eight_digits(digits << np.uint64(64 - 8 * n_digits))
    value = float(mantissa) / _POWERS[np.uintp(n_digits - whole)]
    return (-value if negative else value), position + length


@_helper
def _whole_number(buffer: Bytes, start: int, stop: int) -> tuple[int, int]:
    """Return the number at ``start`` without its decimals, and the position behind it.

    The position is -1 where there is no number that an int32 holds.
    """
    if start < stop and start + 8 < len(buffer):
        digits = _word(buffer, start) ^ (np.uint64(48) * _EVERY)
        length = _first((((digits & _LOW_BITS) + np.uint64(0x76) * _EVERY) | digits) & _HIGH_BITS)
        behind = _byte(buffer, start + length)
        if (length > 0) & ((behind == 32) | (behind == 41)):
            return _eight_digits(digits << np.uint64(64 - 8 * length)), start + length
    value, after = _any_number(buffer, start, stop)
    if not abs(value) < 2147483648.0:
        return 0, -1
    return _int(value), after


_NAN = np.uint64(int.from_bytes(b"nan", "little"))
_INF = np.uint64(int.from_bytes(b"inf", "little"))


@_helper
def _any_number(buffer: Bytes, start: int, stop: int) -> tuple[float, int]:
    """Read any number that C++ streams print, byte by byte, of any length; else see `_number`."""
    position = start
    negative = False
    if position < stop and (_byte(buffer, position) == 45 or _byte(buffer, position) == 43):
        negative = _byte(buffer, position) == 45
        position += 1
    mantissa = 0
    decimals = 0
    significant = 0  # digits without leading zeros; 18 fit an int64
    first = position
    while position < stop and _is_digit(_byte(buffer, position)):
        if significant < 18:
            mantissa = mantissa * 10 + (_byte(buffer, position) - 48)
            significant += mantissa > 0
        else:
            decimals -= 1
        position += 1
    empty = position == first
    if position < stop and _byte(buffer, position) == 46:
        position += 1
        if position >= stop or not _is_digit(_byte(buffer, position)):
            return np.nan, -1
        empty = False
        while position < stop and _is_digit(_byte(buffer, position)):
            if significant < 18:
                mantissa = mantissa * 10 + (_byte(buffer, position) - 48)
                significant += mantissa > 0
                decimals += 1
            position += 1
    if empty:
        word = _word(buffer, position) & _below(3)
        if position + 3 <= stop and word in (_NAN, _INF):
            return np.nan, position + 3
        return np.nan, -1
    exponent = 0
    if position < stop and (_byte(buffer, position) == 101 or _byte(buffer, position) == 69):
        position += 1
        down = False
        if position < stop and (_byte(buffer, position) == 45 or _byte(buffer, position) == 43):
            down = _byte(buffer, position) == 45
            position += 1
        if position >= stop or not _is_digit(_byte(buffer, position)):
            return np.nan, -1
        while position < stop and _is_digit(_byte(buffer, position)):
            if exponent < 1000:
                exponent = exponent * 10 + (_byte(buffer, position) - 48)
            position += 1
        if down:
            exponent = -exponent
    scale = exponent - decimals
    value = float(mantissa)
    while scale > 22:
        value *= _POWERS[22]
        scale -= 22
    while scale < -22:
        value /= _POWERS[22]
        scale += 22
    value = value * _POWERS[scale] if scale >= 0 else value / _POWERS[-scale]
    return (-value if negative else value), position


@_helper
def _hexadecimal(buffer: Bytes, start: int, stop: int) -> tuple[int, int]:
    """Return ``0x..`` or a plain decimal at ``start`` and the position behind it; -1 where there is none."""
    position = start
    value = 0
    if position + 1 < stop and _byte(buffer, position) == 48 and _byte(buffer, position + 1) == 120:
        position += 2
        first = position
        while position < stop:
            byte = _byte(buffer, position)
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
    while position < stop and _is_digit(_byte(buffer, position)):
        value = (value * 10 + (_byte(buffer, position) - 48)) & 0xFFFFFFFF
        position += 1
    return value, (position if position > first else -1)


@_helper
def _is_blank(byte: int) -> bool:
    return byte == 32 or 9 <= byte <= 13


@_helper
def _blank(buffer: Bytes, position: int, stop: int) -> int:
    while position < stop and _is_blank(_byte(buffer, position)):
        position += 1
    return position


@_helper
def _expect(buffer: Bytes, position: int, stop: int, byte: int) -> int:
    """Return the position behind blanks and ``byte``; -1 where something else stands."""
    if position < 0:
        return -1
    position = _blank(buffer, position, stop)
    if position < stop and _byte(buffer, position) == byte:
        return position + 1
    return -1


@_helper
def _skip_group(buffer: Bytes, position: int, stop: int) -> int:
    """Return the position behind the closing parenthesis of the group we are in; -1 where it does not close."""
    depth = 1
    while position < stop:
        if _byte(buffer, position) == 40:
            depth += 1
        elif _byte(buffer, position) == 41:
            depth -= 1
            if depth == 0:
                return position + 1
        position += 1
    return -1


@_helper
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
    """Read ``((l 1) 0 0x9 ...)`` behind its first parenthesis: (position behind it or of the error, slot or -code)."""
    begin = position
    position = _expect(buffer, position, stop, 40)
    if position < 0 or position + 1 >= stop:
        return begin, -BAD_STRUCTURE
    side = _byte(buffer, position)
    if side != 108 and side != 114:
        return begin, -BAD_STRUCTURE
    number, position = _number(buffer, _blank(buffer, position + 1, stop), stop)
    if position < 0 or not 1 <= number <= N_TEAM:
        return begin, -BAD_STRUCTURE
    slot = int(number) - 1 + (N_TEAM if side == 114 else 0)
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
        if _byte(buffer, at) == 40 or _byte(buffer, at) == 41:
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
    while position < stop and _byte(buffer, position) == 40:
        position += 1
        tag = _byte(buffer, position) if position < stop else 0
        second = _byte(buffer, position + 1) if position + 1 < stop else 0
        if tag == 118:  # v: view
            at = _blank(buffer, position + 1, stop)
            qualities[frame, slot] = 1 if at < stop and _byte(buffer, at) == 104 else 0
            value, after = _number(buffer, _blank(buffer, at + 1, stop), stop)
            if after < 0:
                return at, -BAD_NUMBER
            floats[_VIEW_WIDTH, frame, slot] = value
            position = after
        elif tag == 102 and second == 112:  # fp: focus point
            position += 2
            for index in range(_FOCUS, _FOCUS + 2):
                value, after = _number(buffer, _blank(buffer, position, stop), stop)
                if after < 0:
                    return position, -BAD_NUMBER
                floats[index, frame, slot] = value
                position = after
        elif tag == 115:  # s: stamina, effort, recovery and, from version 5, capacity
            position += 1
            for index in range(_STAMINA, _CAPACITY + 1):
                at = _blank(buffer, position, stop)
                if index == _CAPACITY and at < stop and _byte(buffer, at) == 41:
                    break
                value, after = _number(buffer, at, stop)
                if after < 0:
                    return at, -BAD_NUMBER
                floats[index, frame, slot] = value
                position = after
        elif tag == 102:  # f: the player listened to
            at = _blank(buffer, position + 1, stop)
            if at < stop:
                attention_sides[frame, slot] = 1 if _byte(buffer, at) == 108 else -1
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
                if at < stop and _byte(buffer, at) == 41:
                    break
                value, after = _whole_number(buffer, at, stop)
                if after < 0:
                    return at, -BAD_NUMBER
                if index < N_COUNTERS:
                    counters[index, frame, slot] = value
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


@_kernel
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
    """Read n lines ``(show ...)`` of log versions 4 to 6, or of monitors since version 3.

    Args:
        buffer: the log.
        starts, stops: (n,) where each line begins and ends.
        cycles: (n,); ball: (4, n); floats: (15, n, 22) in the order of PLAYER_FLOATS; types, states, qualities,
            attention_sides, attention_unums: (n, 22); counters: (12, n, 22). Filled; rows of bad lines are undefined.
        outcomes: (n,) OK or the code of an error; places: (n,) the byte of the error.

    Returns:
        Number of good lines.
    """
    good = 0
    for frame in range(len(starts)):
        for slot in range(floats.shape[2]):
            for plane in range(len(floats)):
                floats[plane, frame, slot] = np.nan
            for plane in range(len(counters)):
                counters[plane, frame, slot] = -1
            qualities[frame, slot] = 255
            attention_sides[frame, slot] = 0
            attention_unums[frame, slot] = 0
        stop = stops[frame]
        position = starts[frame] + 6
        value, after = _number(buffer, _blank(buffer, position, stop), stop)
        cycles[frame] = -1
        if after < 0 or not 0 <= value < 2147483648.0:
            outcomes[frame] = BAD_NUMBER
            places[frame] = position
            continue
        cycles[frame] = np.int32(value)
        # Monitors get (pm ..) and (tm ..) in front of the ball; logs have neither.
        position = _blank(buffer, after, stop)
        while position + 1 < stop and _byte(buffer, position) == 40 and 97 <= _byte(buffer, position + 1) <= 122:
            position = _skip_group(buffer, position + 1, stop)
            if position < 0:
                break
            position = _blank(buffer, position, stop)
        position = _expect(buffer, position, stop, 40)
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
            if _byte(buffer, at) == 41:
                position = at + 1
                break
            if _byte(buffer, at) != 40:
                outcome = BAD_STRUCTURE
                break
            # A group of an unknown kind.
            if at + 1 < stop and _byte(buffer, at + 1) != 40:
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
        if outcome == OK and seen != (1 << N_PLAYERS) - 1:
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
_LONGEST = max(map(len, _WORDS))
_WORD_PIECES = np.array(
    [[int.from_bytes(word[at : at + 8], "little") for at in range(0, _LONGEST, 8)] for word in _WORDS], np.uint64
)
"""The commands' words, eight bytes a number."""
_KEY_FACTOR = np.uint64(0x7AF027BC08D6AF57)


def _key_of(first: Any, length: Any) -> Any:
    """Return a number under 256, another one for each command, from its first eight letters and its length."""
    return ((first ^ length) * _KEY_FACTOR) >> np.uint64(56)


_key = _helper(_key_of)
_KEYS = _key_of(_WORD_PIECES[:, 0], np.array([len(word) for word in _WORDS], np.uint64))
if len(np.unique(_KEYS)) < len(_WORDS):
    raise AssertionError("two commands have one key: choose another _KEY_FACTOR")
_KIND_BY_KEY = np.zeros(256, np.uint8)
_KIND_BY_KEY[_KEYS] = np.arange(len(_WORDS))


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


@_helper
def _kind_of(buffer: Bytes, start: int, stop: int) -> int:
    length = stop - start
    if length == 0 or length > _LONGEST:
        return _ILLEGAL
    key = _key(_word(buffer, start) & _below(length), np.uint64(length))
    kind = _int(_KIND_BY_KEY[np.uintp(key)])
    for piece in range(_WORD_PIECES.shape[1]):
        here = _below(length - 8 * piece) & _word(buffer, start + 8 * piece) if length > 8 * piece else _ZERO
        if here != _WORD_PIECES[kind, piece]:
            return _ILLEGAL
    return kind


_SAYABLE = np.zeros(256, np.bool_)
"""Whether the server's lexer takes a byte in a quoted message (player_command_tok.lpp)."""
_SAYABLE[np.frombuffer(b"0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz ().+*/?<>_-", np.uint8)] = True

_FLAGS = (b"on", b"off", b"true", b"false")
_WIDTHS = (b"narrow", b"normal", b"wide")
_QUALITIES = (b"high", b"low")


def _alphabet(words: tuple[bytes, ...]) -> NDArray[np.uint8]:
    """Return words as rows of bytes, padded with zeros."""
    rows = np.zeros((len(words), max(map(len, words)) + 1), np.uint8)
    for row, word in zip(rows, words, strict=True):
        row[: len(word)] = np.frombuffer(word, np.uint8)
    return rows


_FLAG_BYTES, _WIDTH_BYTES, _QUALITY_BYTES = _alphabet(_FLAGS), _alphabet(_WIDTHS), _alphabet(_QUALITIES)


@_helper
def _word_of(buffer: Bytes, position: int, stop: int, words: NDArray[np.uint8]) -> int:
    """Return the position behind the blanks and the one of ``words`` that stand here; -1 where none does."""
    position = _blank(buffer, position, stop)
    for row in range(len(words)):
        at = position
        index = 0
        while words[row, index] != 0 and at < stop and _byte(buffer, at) == words[row, index]:
            at += 1
            index += 1
        if words[row, index] == 0 and (at == stop or _byte(buffer, at) == 32 or _byte(buffer, at) == 9):
            return at
    return -1


@_helper
def _close(buffer: Bytes, position: int, stop: int) -> int:
    """Return the closing parenthesis of the command we are in, quotes respected; -1 where it does not close."""
    depth = 1
    quoted = False
    while position < stop:
        word = _word(buffer, position)
        # Parentheses are 40 and 41: alike but for the lowest bit.
        plain = _not_zero((word | _EVERY) ^ (np.uint64(41) * _EVERY)) & _not_zero(word ^ (np.uint64(34) * _EVERY))
        found = _first(~plain & _HIGH_BITS)
        position += found
        if found == 8:
            continue
        if position >= stop:
            return -1
        byte = _byte(buffer, position)
        if byte == 34:
            quoted = not quoted
        elif not quoted:
            if byte == 40:
                depth += 1
            else:
                depth -= 1
                if depth == 0:
                    return position
        position += 1
    return -1


# As plain integers these would be part of a type, and the helper compiled for each of them.
_FIRST_NUMBER = _int(0)
_LEG_NUMBERS = _int(2)


@_helper
def _as_read(buffer: Bytes, start: int, stop: int, value: float) -> float:
    """Return a number as the server reads it: one without a point or exponent is an int of 32 bits, which wraps."""
    if -2147483648.0 <= value <= 2147483647.0:
        return value
    for position in range(start, stop):
        byte = _byte(buffer, position)
        if byte == 46 or byte == 69 or byte == 101:
            return value
    # What no long holds is cut to the nearest one that does.
    if value >= 9223372036854775807.0:
        return -1.0
    if value <= -9223372036854775808.0:
        return 0.0
    low = _int(value) & _int(0xFFFFFFFF)
    return float(low - _int(0x100000000) if low >= _int(0x80000000) else low)


@_helper
def _plain_numbers(
    buffer: Bytes, position: int, stop: int, row: int, first: int, most: int, args: Any
) -> tuple[int, int]:
    """Read up to ``most`` finite numbers into args[first:, row].

    Returns how many, -1 for a bad one, and the position behind.
    """
    count = 0
    while True:
        position = _blank(buffer, position, stop)
        if position >= stop or not (
            _is_digit(_byte(buffer, position))
            or _byte(buffer, position) == 45
            or _byte(buffer, position) == 43
            or _byte(buffer, position) == 46
        ):
            return count, position
        value, after = _number(buffer, position, stop)
        # The server's lexer knows neither nan nor a number glued to letters.
        if after < 0 or value != value or (after < stop and _byte(buffer, after) != 32 and _byte(buffer, after) != 9):
            return -1, position
        if count >= most:
            return -1, position
        args[first + count, row] = _as_read(buffer, position, after, value)
        count += 1
        position = after


@_helper
def _legs(buffer: Bytes, position: int, stop: int, row: int, args: Any) -> int:
    """Read ``(l P D)(r P D)`` of a two-leg dash: bit 1 left, bit 2 right; -1 where it is wrong."""
    legs = _int(0)
    while True:
        position = _blank(buffer, position, stop)
        if position >= stop:
            return legs if legs > 0 else -1
        if _byte(buffer, position) != 40:
            return -1
        close = _close(buffer, position + 1, stop)
        if close < 0:
            return -1
        position = _blank(buffer, position + 1, close)
        start = position
        while position < close and 97 <= _byte(buffer, position) <= 122:
            position += 1
        length = position - start
        leg = 0
        if (length == 1 or length == 4) and _byte(buffer, start) == 108:
            leg = 1
        elif (length == 1 or length == 5) and _byte(buffer, start) == 114:
            leg = 2
        if leg == 0 or legs & leg:
            return -1
        count, after = _plain_numbers(buffer, position, close, row, 2 * (leg - 1), _LEG_NUMBERS, args)
        if count != 2 or _blank(buffer, after, close) != close:
            return -1
        legs |= leg
        position = close + 1


@_helper
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
    texts: Any,
) -> int:
    """Read the command at ``position``; the position behind it, ``stop`` where the rest is garbage."""
    texts[0, row] = texts[1, row] = position
    kinds[row] = _ILLEGAL
    valid[row] = False
    legs[row] = 0
    for index in range(4):
        args[index, row] = np.nan
    if _byte(buffer, position) != 40:
        texts[1, row] = stop
        return stop
    start = _blank(buffer, position + 1, stop)
    at = start
    while at < stop and (97 <= _byte(buffer, at) <= 122 or _byte(buffer, at) == 95):
        at += 1
    kind = _kind_of(buffer, start, at)
    begin = _blank(buffer, at, stop)
    close = _close(buffer, at, stop)
    # An unquoted say takes the rest of the datagram (the server's lexer: longest match).
    if kind == _SAY and of_player and begin < stop and _byte(buffer, begin) != 34:
        close = stop - 1
        while close >= begin and _byte(buffer, close) != 41:
            close -= 1
        if close < begin:
            close = -1
    if close < 0:
        texts[1, row] = stop
        return stop
    kinds[row] = kind
    end = close
    while end > begin and (_byte(buffer, end - 1) == 32 or _byte(buffer, end - 1) == 9):
        end -= 1
    fine = kind != _ILLEGAL
    if kind == _SAY and end - begin >= 2 and _byte(buffer, begin) == 34 and _byte(buffer, end - 1) == 34:
        begin += 1
        end -= 1
        for place in range(begin, end if of_player else begin):
            fine = fine and _SAYABLE[np.uintp(_byte(buffer, place))]
    most = _MOST[kind]
    if of_player and most >= 0:
        if kind == _DASH and begin < end and _byte(buffer, begin) == 40:
            found = _legs(buffer, begin, end, row, args)
            fine = found > 0
            legs[row] = max(found, 0)
            begin = end
        elif kind == _POINTTO and begin < end and _byte(buffer, begin) == 111:
            fine = end - begin == 3
        else:
            count, after = _plain_numbers(buffer, begin, end, row, _FIRST_NUMBER, most, args)
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
    texts[0, row] = begin
    texts[1, row] = max(begin, end)
    valid[row] = fine
    return close + 1


# What a line of a command log is.
_LINE_OTHER = 0
_LINE_REFEREE = 1
LINE_ODD = 2
LINE_STRANGER = 3

_RECEIVED = np.uint64(int.from_bytes(b"Recv ", "little"))


@_helper
def _count(buffer: Bytes, start: int, stop: int) -> tuple[int, int]:
    """Return a plain number under 2^31 and the position behind it; -1 for the position where there is none."""
    position = start
    value = 0
    while position < stop and _is_digit(_byte(buffer, position)) and position - start < 10:
        value = value * 10 + (_byte(buffer, position) - 48)
        position += 1
    if position == start or value > 2147483647:
        return 0, -1
    return value, position


@_helper
def _stamp(buffer: Bytes, position: int, stop: int) -> tuple[int, int, int]:
    """Read ``TIME,STOP<tab>`` or ``TIME<tab>``: time, stoppage (-1 if absent), position behind (-1 if neither)."""
    stoppage = -1
    cycle, position = _count(buffer, position, stop)
    if 0 <= position < stop and _byte(buffer, position) == 44:
        stoppage, position = _count(buffer, position + 1, stop)
    if 0 <= position < stop and _byte(buffer, position) == 9:
        return cycle, stoppage, position + 1
    return 0, 0, -1


@_helper
def _same(buffer: Bytes, start: int, stop: int, name: Bytes) -> bool:
    if len(name) == 0 or stop - start != len(name):
        return False
    for index in range(len(name)):
        if _byte(buffer, start + index) != name[index]:
            return False
    return True


@_helper
def _goes_on(buffer: Bytes, start: int, stop: int) -> bool:
    """Whether a line belongs to the message before it: a client may send line breaks, which the server logs as such."""
    start = _blank(buffer, start, stop)
    return start < stop and _byte(buffer, start) == 40


@_kernel
def scan_commands(
    buffer: Bytes,
    starts: NDArray[np.int64],
    stops: NDArray[np.int64],
    left: Bytes,
    right: Bytes,
    integers: NDArray[np.int32],
    sides: NDArray[np.int8],
    unums: NDArray[np.uint8],
    kinds: NDArray[np.uint8],
    legs: NDArray[np.uint8],
    valid: NDArray[np.bool_],
    args: NDArray[np.float32],
    texts: NDArray[np.int64],
    line_classes: NDArray[np.uint8],
    line_stamps: NDArray[np.int32],
    last: NDArray[np.int64],
) -> int:
    """Read the lines of a command log.

    Args:
        buffer: the log; starts, stops: (n_lines,) its lines. A message may go on in lines that have no stamp.
        left, right: team names; a line whose sender is neither is marked as a stranger's and not read.
        integers .. texts: filled, one value a command; integers is (4, capacity): time, stoppage, line, order; args
            (4, capacity); texts (2, capacity): where the text begins and ends. The capacity must be at least the
            number of "(" plus the number of messages.
        line_classes: (n_lines,) 0 read or of no interest, 1 referee, 2 odd, 3 from a stranger.
        line_stamps: (n_lines, 2) time and stoppage; stoppage -1 where the log has none.
        last: (3, 12, 3) room for the last time, stoppage and order of each side and number.

    Returns:
        Number of commands read.
    """
    row = _int(0)  # as a literal 0 it would have each helper compiled twice
    for index in range(12):
        for side in range(3):
            last[side, index, 0] = -1
    behind = _int(0)  # the line behind the message that was read last
    for line in range(len(starts)):
        stop = stops[line]
        if stop > starts[line] and _byte(buffer, stop - 1) == 13:
            stop -= 1
        line_classes[line] = _LINE_OTHER
        line_stamps[line, 0] = -1
        line_stamps[line, 1] = -1
        if line < behind:
            continue
        if _blank(buffer, starts[line], stop) == stop:
            continue
        cycle, stoppage, position = _stamp(buffer, starts[line], stop)
        if position < 0:
            line_classes[line] = LINE_ODD
            continue
        line_stamps[line, 0] = cycle
        line_stamps[line, 1] = stoppage
        if position < stop and _byte(buffer, position) == 40:
            line_classes[line] = _LINE_REFEREE
            continue
        if position + 5 >= stop or _word(buffer, position) & _below(5) != _RECEIVED:
            continue
        name_start = position + 5
        position = _find(buffer, name_start, stop, 32)
        colon = position - 1
        if colon <= name_start or _byte(buffer, colon) != 58:
            line_classes[line] = LINE_ODD
            continue
        underscore = colon - 1
        while underscore > name_start and _byte(buffer, underscore) != 95:
            underscore -= 1
        unum = 0
        side = 0
        if _byte(buffer, underscore) == 95:
            number = 0
            numeric = True
            for at in range(underscore + 1, colon):
                if not _is_digit(_byte(buffer, at)) or number > 99:
                    numeric = False
                    break
                number = number * 10 + (_byte(buffer, at) - 48)
            if numeric and (colon == underscore + 1 or not 1 <= number <= N_TEAM):
                line_classes[line] = LINE_ODD
                continue
            unum = number if numeric else 0
            if _same(buffer, name_start, underscore, left):
                side = 1
            elif _same(buffer, name_start, underscore, right):
                side = -1
            else:
                line_classes[line] = LINE_STRANGER
                continue
        position += 1
        broken = False
        behind = line + 1
        while behind < len(starts) and _goes_on(buffer, starts[behind], stops[behind]):
            stop = stops[behind]
            behind += 1
        if last[side + 1, unum, 0] != cycle or last[side + 1, unum, 1] != stoppage:
            last[side + 1, unum, 0] = cycle
            last[side + 1, unum, 1] = stoppage
            last[side + 1, unum, 2] = 0
        while True:
            position = _blank(buffer, position, stop)
            if position >= stop:
                break
            position = _scan_command(buffer, position, stop, unum > 0, row, kinds, legs, valid, args, texts)
            # A syntax error ends the server's reading of the datagram.
            broken = broken or not valid[row]
            valid[row] = not broken
            integers[0, row] = cycle
            integers[1, row] = stoppage
            integers[2, row] = line + 1
            integers[3, row] = last[side + 1, unum, 2]
            last[side + 1, unum, 2] += 1
            sides[row] = side
            unums[row] = unum
            row += 1
    return row


tell_when_compiled(
    {
        kernel: f"compiling the reader of {what} logs, once (some seconds)"
        for kernel, what in ((scan_shows, "game"), (scan_commands, "command"))
    }
)
