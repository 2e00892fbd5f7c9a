"""The notebook runs, and shows what it showed when it was committed."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat", reason="the notebook needs the extra dev")

ROOT = Path(__file__).resolve().parents[2]
NOTEBOOK = ROOT / "docs" / "notebook.ipynb"


def shown(notebook: object) -> list[tuple[str, list[str], list[str]]]:
    """The code of every cell that has output, its texts, and the kinds of what it shows. What training gives varies."""
    found = []
    for cell in notebook.cells:  # type: ignore[attr-defined]
        outputs = cell.get("outputs", [])
        kinds = [kind for one in outputs for kind in one.get("data", {"text": one.get("text")})]
        texts = [one.get("text") or one.get("data", {}).get("text/plain") or "" for one in outputs]
        varies = "varies" in cell.metadata.get("tags", [])
        found.append((cell.source, [] if varies else texts, sorted(set(kinds))))
    return found


@pytest.mark.slow
def test_the_notebook_shows_what_it_did(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "docs" / "notebook.py", tmp_path / "notebook.ipynb"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    again = nbformat.read(tmp_path / "notebook.ipynb", as_version=4)
    assert shown(again) == shown(nbformat.read(NOTEBOOK, as_version=4)), "write it anew: make notebook"


def test_the_notebook_was_run_from_top_to_bottom_and_is_small() -> None:
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    outputs = [one for cell in code for one in cell.outputs]
    assert sum("image/png" in one.get("data", {}) for one in outputs) > 5
    assert not [one for one in outputs if one.output_type == "error" or one.get("name") == "stderr"]
    assert NOTEBOOK.stat().st_size < 1_000_000
