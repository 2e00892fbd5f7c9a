"""The generated parts of the reference are what the code gives, and the generator sees all of it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import generate
import pytest

PAGES = generate.pages()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_page_is_what_the_code_gives(page: Path) -> None:
    assert page.read_text(encoding="utf-8") == PAGES[page], "write it anew: python docs/generate.py"


def test_every_page_with_a_block_is_written() -> None:
    marked = {page for page in generate.DOCS.rglob("*.md") if "<!-- generated: " in page.read_text(encoding="utf-8")}
    assert {page.resolve() for page in marked} <= {page.resolve() for page in PAGES} | {
        (generate.DOCS / "howto" / "development.md").resolve()  # explains the markers
    }


def test_options_are_read_from_the_commands() -> None:
    page = PAGES[generate.REFERENCE / "commands" / "play.md"]
    assert "teamclone play [SCHEDULE] [OPTIONS]" in page
    assert "| `--matches`, `-n` | whole number, at least 1 | `1` | Matches of --left and --right. |" in page
    assert "| `--set` | `KEY=VALUE`, repeatable |" in page
    assert "| `--out` | path | required |" in page
    assert "| `--test` | number, 0 to 0.9 | `0.15` |" in PAGES[generate.REFERENCE / "commands" / "dataset.md"]


def test_a_page_without_its_block_is_refused(tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text("no block\n")
    with pytest.raises(ValueError, match="expected one block"):
        generate._filled(tmp_path / "page.md", options="table")


def test_a_docstring_becomes_markdown() -> None:
    def sample(names: Sequence[str], *, n_rows: int = 3) -> dict[str, tuple[int, ...]]:
        """Count the rows
        of each name.

        Args:
            names: what to count,
                in order.
            n_rows: at most so many; `None` is not allowed.

        Raises:
            ValueError: there is no name.
        """
        raise NotImplementedError

    text = generate._described("teamclone.sample", sample, level=3)
    assert "```python\nteamclone.sample(names: Sequence[str], *, n_rows: int = 3)" in text
    assert "\n\nCount the rows of each name.\n\n" in text
    assert "- `names`: what to count, in order.\n- `n_rows`: at most so many; `None` is not allowed." in text
    assert "**Raises**\n\n- `ValueError`: there is no name." in text


def test_a_long_signature_has_a_line_for_each_parameter() -> None:
    def sample(a: dict[str, tuple[int, int]], b: dict[str, tuple[int, int]], c: dict[str, int], d: int = 0) -> None:
        """Do nothing."""

    assert generate._signature("teamclone.sample", sample) == (
        "teamclone.sample(\n    a: dict[str, tuple[int, int]],\n    b: dict[str, tuple[int, int]],\n"
        "    c: dict[str, int],\n    d: int = 0,\n) -> None"
    )


def test_settings_have_choices_bounds_and_defaults() -> None:
    page = PAGES[generate.REFERENCE / "settings.md"]
    assert '| `train.optimiser` | `adam`, `rmsprop`, `adagrad`, `muon` | `"adam"` |' in page
    assert "| `model.dropout` | number, at least 0, at most 0.9 | `0.0` |" in page
    assert "| `model.hidden` | list: whole number, at least 1, at most 16384 | `[512, 256, 128]` |" in page
    assert "| `data.repeat` | switch | `false` |" in page
