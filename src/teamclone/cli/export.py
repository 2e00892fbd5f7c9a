"""`teamclone export`."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from teamclone.cli.common import print_json, print_table
from teamclone.errors import RunError, UsageError

if TYPE_CHECKING:
    from teamclone.export.contract import Comparison


def export(
    run: Annotated[Path | None, typer.Argument(help="Run folder made by `teamclone train`.")] = None,
    to: Annotated[str, typer.Option(help="What for: cpp, one C++17 header and a file of weights.")] = "cpp",
    out: Annotated[Path | None, typer.Option(help="Folder to write to; an export in it is replaced.")] = None,
    checkpoint: Annotated[str, typer.Option(help="Which weights.")] = "best-loss",
    check: Annotated[
        Path | None, typer.Option(help="Run the states of an export again, compiled where there is a compiler.")
    ] = None,
    compiler: Annotated[str | None, typer.Option(help="Compiler for the check; g++ or clang++ by default.")] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the result as JSON.")] = False,
) -> None:
    """Write a clone as a C++ header, or check one that was written."""
    from teamclone.export.contract import check_export, write_export
    from teamclone.training.run import open_run

    if to != "cpp":
        raise UsageError(f"--to: expected cpp, got {to!r}")
    if (run is None) == (check is None) or (run is None) != (out is None):
        raise UsageError("give a run and --out FOLDER, or --check FOLDER")
    if run is not None and out is not None:
        contract = write_export(open_run(run), out, checkpoint=checkpoint)
        if as_json:
            print_json({key: contract[key] for key in ("model_id", "team", "checkpoint", "commands", "files")})
            return
        print(f"Wrote {out}: {', '.join(contract['files'])}, contract.json, check.cpp")
        print(f"Check it with: teamclone export --check {out}")
        return
    assert check is not None
    _check(check, check_export(check, compiler=compiler), as_json=as_json)


def _check(folder: Path, found: dict[str, Comparison | None], *, as_json: bool) -> None:
    """Print comparisons; exit with 1 where answers differ."""
    if as_json:
        print_json({name: one and {**dataclasses.asdict(one), "close": one.close} for name, one in found.items()})
    else:
        rows = [
            (
                {"python": "kernels in Python", "cpp": "compiled header"}[name],
                f"{one.n}",
                f"{one.probability:.1e}",
                f"{one.number:.1e}",
                f"{one.apart}",
                *("" if math.isnan(time) else f"{time:,.0f} µs" for time in one.median_us),
            )
            for name, one in found.items()
            if one is not None
        ]
        heads = [
            "compared with PyTorch",
            "states",
            "probability",
            "number",
            "other numbers",
            "off the ball",
            "at the ball",
        ]
        print_table(heads, rows, numeric=range(1, 7))
        if found["cpp"] is None:
            print("The header was not compiled: there is no g++ and no clang++ here.")
    if any(one is not None and not one.close for one in found.values()):
        raise RunError(f"{folder}: the answers are not those of the contract")
