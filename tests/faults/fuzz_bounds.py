"""Fuzzing for time and memory: reading logs of repeated pieces must cost no more than in proportion to their size.

    python tests/faults/fuzz_bounds.py --minutes 30

An input that costs more is written to the current folder as costly-*; keep its pieces in tests/hostile.py, or the whole
in tests/unit/logs/test_bounds.py, once mended.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from hostile import KINDS, check_cost, made


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30, help="of processor time")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    n, n_costly, end = 0, 0, time.process_time() + 60 * options.minutes
    while time.process_time() < end:
        for name, kind in KINDS.items():
            data = made(kind, rng, n_bytes=int(10 ** rng.uniform(3, 5.7)))
            n += 1
            try:
                check_cost(data)
            except Exception as error:
                n_costly += 1
                path = Path(f"costly-{n_costly}")
                path.write_bytes(data)
                print(f"{path}: {name}: {type(error).__name__}: {str(error)[:300]}")
    print(f"{n} logs, {n_costly} too costly")
    return int(n_costly > 0)


if __name__ == "__main__":
    sys.exit(main())
