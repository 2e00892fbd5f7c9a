"""The file of a network's weights: what is written is read, what is damaged is named."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.unit.engine.network.test_answer import MODELS, varied

from teamclone.engine.network import spec as of
from teamclone.engine.network.network import Network
from teamclone.engine.network.weights import FORMAT, read_weights, write_weights
from teamclone.errors import RunError
from teamclone.models.clone import model_id
from teamclone.models.packing import pack


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("weights") / "weights.bin"
    write_weights(path, pack(varied(MODELS["one target, no role"])))
    return path


@pytest.mark.parametrize("name", ["paper", "two points", "two"])
def test_a_network_is_read_as_it_was_written(name: str, tmp_path: Path) -> None:
    model = varied(MODELS[name])
    weights = pack(model)
    write_weights(tmp_path / "weights.bin", weights)
    read = read_weights(tmp_path / "weights.bin")
    assert read.model_id == model_id(model)
    assert read.commands == model.config.commands
    np.testing.assert_array_equal(read.spec, weights.spec)
    np.testing.assert_array_equal(read.values, weights.values)
    inputs = np.linspace(-1, 1, len(model.inputs.names))[None]
    np.testing.assert_array_equal(Network(read).answers(inputs), Network(weights).answers(inputs))


def test_the_bytes_are_as_documented(written: Path) -> None:
    data = written.read_bytes()
    magic, number, crc, name, *lengths = struct.unpack_from("<8sII16s4q", data)
    assert (magic, number, crc) == (b"TCLONENN", FORMAT, zlib.crc32(data[16:]))
    weights = read_weights(written)
    assert name.decode() == weights.model_id
    at = 64
    for part, code, size in (("spec", "q", 8), ("inputs", "q", 8), ("values", "f", 4), ("order", "B", 1)):
        length = lengths.pop(0)
        assert struct.unpack_from(f"<{length}{code}", data, at) == tuple(getattr(weights, part)), part
        at += length * size
    assert len(data) == at


def test_every_cut_and_every_changed_byte_is_noticed(written: Path, tmp_path: Path) -> None:
    data = written.read_bytes()
    path = tmp_path / "weights.bin"
    places = {*range(64), *range(64, len(data), 997), len(data) - 1}
    for place in sorted(places):
        changed = bytearray(data)
        changed[place] ^= 0x10
        for damaged in (data[:place], bytes(changed)):
            path.write_bytes(damaged)
            with pytest.raises(RunError, match=r"weights\.bin: "):
                read_weights(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "no weights of a network: it does not begin with TCLONENN"),
        (b"PK\x03\x04" + b"\0" * 100, "no weights of a network"),
        (struct.pack("<8sII", b"TCLONENN", 7, 0) + b"\0" * 32, f"weights of format 7, expected {FORMAT}"),
        (struct.pack("<8sII", b"TCLONENN", FORMAT, 1) + b"\0" * 32, "damaged: it ends after 48 bytes"),
        (
            struct.pack("<8sII", b"TCLONENN", FORMAT, 1) + b"\0" * 48,
            "damaged: its checksum is not that of its 64 bytes",
        ),
    ],
)
def test_other_files_are_refused(content: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "weights.bin"
    path.write_bytes(content)
    with pytest.raises(RunError, match=message):
        read_weights(path)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(RunError, match=r"weights\.bin: cannot read the weights of a network \(No such file"):
        read_weights(tmp_path / "weights.bin")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda spec: spec[:10], "10 integers describe the network"),
        (lambda spec: spec[:-1], "its table of layers is not where it should be"),
        (lambda spec: _with(spec, of.N_VALUES, 5), "it holds .* weights, its description has 5"),
        (lambda spec: _with(spec, int(spec[of.COMMAND]) + of.WEIGHTS, 10**9), "a layer lies outside of its weights"),
        (lambda spec: _with(spec, int(spec[of.COMMAND]) + of.OUTS, -1), "a layer lies outside of its weights"),
    ],
)
def test_a_description_that_does_not_fit_is_refused(change, message: str, written: Path, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    """Whoever wrote it: its checksum is right."""
    weights = read_weights(written)
    path = tmp_path / "weights.bin"
    spec = change(weights.spec)
    inputs, values = weights.inputs, weights.values
    counts = struct.pack("<16s4q", b"x", len(spec), len(inputs), len(values), 0)
    body = counts + spec.tobytes() + inputs.tobytes() + values.tobytes()
    path.write_bytes(struct.pack("<8sII", b"TCLONENN", FORMAT, zlib.crc32(body)) + body)
    with pytest.raises(RunError, match=message):
        read_weights(path)


def _with(spec: of.Ints, place: int, value: int) -> of.Ints:
    changed = spec.copy()
    changed[place] = value
    return changed


def test_writing_keeps_the_old_file_until_the_new_one_is_whole(written: Path, tmp_path: Path) -> None:
    path = tmp_path / "weights.bin"
    path.write_bytes(b"old")
    weights = read_weights(written)
    with pytest.raises(UnicodeEncodeError):
        write_weights(path, replace(weights, model_id="\u00e9"))
    assert path.read_bytes() == b"old"
