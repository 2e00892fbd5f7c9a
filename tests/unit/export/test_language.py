"""The translation of kernels that use all that can be translated: equal to Numba to the bit, with Numba's types."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numba import types
from tests.cpp import CHECKED, QUICK, compiled, run
from tests.unit.export import language

from teamclone.export.translate import Entry, Translation, translate
from teamclone.export.values import array_type, is_array, is_tuple

Made = tuple[np.ndarray, np.ndarray]
"""Floats and integers that a kernel makes."""
COLUMNS, ROWS = 40, 400
ARGUMENTS = (
    array_type(types.float64, 1),
    array_type(types.int64, 1),
    array_type(types.float32, 1),
    array_type(types.float64, 2),
    array_type(types.int64, 2),
)
ENTRIES = tuple(Entry(name=one.py_func.__name__, kernel=one, arguments=ARGUMENTS) for one in language.KERNELS)
FLOATS = (0.75, -2.5, 3.5, 0.0, -0.0, 1e-3, 60.0, -181.0, 2.5, 720.25, 1e17, -1e300, 1e300, np.inf, -np.inf, np.nan)
INTS = (3, 0, -1, 7, -5, 2, 12, 1 << 62, -(1 << 62), -(1 << 63), 5, -64)
SINGLES = (0.5, -1.25, 0.1, 3.0, -0.0, 7.7, -100.25, 1e-6)


def inputs() -> dict[str, np.ndarray]:
    """What each kernel is given."""
    return {
        "a": np.array(FLOATS),
        "i": np.array(INTS),
        "f": np.array(SINGLES, np.float32),
        "floats": np.zeros((ROWS, COLUMNS)),
        "ints": np.zeros((ROWS, COLUMNS), np.int64),
    }


@pytest.fixture(scope="module")
def header() -> str:
    return translate(ENTRIES, version="v1")


def made_by(kernel: Callable[..., None]) -> Made:
    """What a function makes of the inputs."""
    given = inputs()
    with np.errstate(all="ignore"):
        kernel(*given.values())
    return given["floats"], given["ints"]


@pytest.fixture(scope="module")
def expected() -> list[Made]:
    """What Numba makes of the inputs; NumPy of the one that Numba takes long to compile."""
    return [made_by(kernel.py_func if kernel is language.of_arrays else kernel) for kernel in language.KERNELS]


@pytest.mark.parametrize(("compiler", "flags"), [("g++", QUICK), ("clang++", QUICK), ("g++", CHECKED)])
def test_kernels_give_what_numba_gives(
    header: str, expected: list[Made], tmp_path: Path, compiler: str, flags: tuple[str, ...]
) -> None:
    program = compiled(tmp_path, header, "language", compiler=compiler, flags=flags)
    for name, cells in inputs().items():
        cells.tofile(tmp_path / name)
    run(program, str(tmp_path))
    for number, wanted in enumerate(expected):
        made = np.fromfile(tmp_path / f"floats_{number}"), np.fromfile(tmp_path / f"ints_{number}", np.int64)
        assert_same(ENTRIES[number].name, made, wanted)


def assert_same(name: str, made: Made, expected: Made) -> None:
    """Compare to the bit, but that a number that is none is like any other."""
    assert expected[0].any() or expected[1].any()
    for one, other in zip(made, expected, strict=True):
        cells = one.reshape(other.shape)
        same = (cells.view(np.int64) == other.view(np.int64)) | (np.isnan(cells) & np.isnan(other))
        assert same.all(), f"{name}: {[(*at, cells[tuple(at)], other[tuple(at)]) for at in np.argwhere(~same)[:5]]}"


@pytest.mark.slow
def test_numpy_and_numba_agree_where_one_stands_for_the_other() -> None:
    kernel = language.of_arrays
    assert_same("of_arrays", made_by(kernel.py_func), made_by(kernel))
    assert_types(ENTRIES[language.KERNELS.index(kernel)])


def plain(of: object) -> object:
    """A type without what layout and literals add to it."""
    of = types.unliteral(of)
    if is_array(of):
        return of.dtype, of.ndim
    return tuple(map(plain, of.types)) if is_tuple(of) else of


def assert_types(entry: Entry) -> None:
    """Compare the types of variables with Numba's, which has a variable for each assignment."""
    ours = Translation().function(entry.kernel, ARGUMENTS, None, None).variables
    inferred = entry.kernel.overloads[ARGUMENTS].type_annotation.typemap
    compared = set()
    for name, found in inferred.items():
        variable = name.partition(".")[0]
        if variable in ours:
            compared.add(variable)
            assert plain(found) == plain(ours[variable]), name
    assert compared == set(ours)


@pytest.mark.parametrize("entry", [one for one in ENTRIES if one.name != "of_arrays"], ids=lambda entry: entry.name)
def test_variables_have_the_types_that_numba_infers(entry: Entry, expected: list[Made]) -> None:
    assert_types(entry)
