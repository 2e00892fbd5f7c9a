"""Coverage-guided fuzzing of every log reader: a log, a clear error, nothing else; no hang, bounded memory.

    python tests/faults/fuzz_readers.py FOLDER --minutes 30

FOLDER keeps the corpus between runs; it is seeded with the first frames of the logs in tests/data/fixtures. An input
that crashes a reader is written there as crash-*; keep it as a test in tests/unit/logs/test_bad_input.py once mended.
Needs atheris (`pip install atheris`), which has wheels for Linux.
"""

from __future__ import annotations

import argparse
import gzip
import io
import sys
from pathlib import Path

import atheris

# Numba compiles the scanner's bytecode and must get it as it was written.
with atheris.instrument_imports(include=["teamclone.logs"], exclude=["teamclone.logs.scan"]):
    from teamclone.logs import read_match

from teamclone.errors import LogError

FIXTURES = Path(__file__).resolve().parents[1] / "data" / "fixtures"
LONGEST = 60_000
"""Bytes of a seed: the header and a few frames."""


def seeds(folder: Path) -> None:
    """The beginning of every fixture, game and command log, plain and packed."""
    for path in sorted(FIXTURES.glob("*/*.gz")):
        try:
            data = gzip.decompress(path.read_bytes())
        except EOFError:
            continue
        begin = data[:LONGEST]
        (folder / f"seed-{path.parent.name}-{path.stem[-24:]}").write_bytes(begin)
    (folder / "seed-packed").write_bytes(gzip.compress(begin[:2000], mtime=0))


def read_one(data: bytes) -> None:
    """Any exception but LogError, any warning that a user would see, any crash is a finding."""
    try:
        match = read_match(io.BytesIO(data))
    except LogError:
        return
    frames = len(match.frames["cycle"])
    for values in match.players.values():
        assert values.shape == (frames, 22)
    assert ((match.commands["frame"] >= -1) & (match.commands["frame"] < max(frames, 1))).all()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--minutes", type=float, default=30)
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    seeds(options.folder)
    limits = (f"-max_total_time={int(options.minutes * 60)}", "-rss_limit_mb=4096", "-timeout=10")
    atheris.Setup(
        [sys.argv[0], str(options.folder), *limits, f"-max_len={LONGEST}", f"-artifact_prefix={options.folder}/"],
        read_one,
    )
    atheris.Fuzz()


if __name__ == "__main__":
    main()
