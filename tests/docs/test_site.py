"""The site builds without a warning, and a page of it loads nothing from another server."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_the_site_builds_and_stands_alone(tmp_path: Path) -> None:
    pytest.importorskip("material", reason="the site needs the extra docs")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", tmp_path / "site"],
        cwd=ROOT, env=os.environ | {"NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    pages = {page.relative_to(tmp_path / "site").with_suffix("") for page in (tmp_path / "site").rglob("*.html")}
    sources = (*(ROOT / "docs").rglob("*.md"), *(ROOT / "docs").rglob("*.ipynb"))
    assert {page.relative_to(ROOT / "docs").with_suffix("") for page in sources} <= pages
    notebook = (tmp_path / "site" / "notebook.html").read_text()
    pictures = re.findall(r'src="?(notebook_files/[\w.]+)', notebook)
    assert len(pictures) > 5
    assert all((tmp_path / "site" / picture).is_file() for picture in pictures)
    assert (tmp_path / "site" / "search" / "search_index.json").is_file()
    loaded = re.compile(r"<(?:script|img|iframe)[^>]* src=\"?https?:|<link[^>]* rel=\"?(?:stylesheet|icon)[^>]*https?:")
    for page in (tmp_path / "site").rglob("*.html"):
        assert loaded.findall(page.read_text()) == [], page.name
