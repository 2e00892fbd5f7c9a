"""Files that get their name when all of them is there."""

from __future__ import annotations

from pathlib import Path

import pytest

from teamclone.system.files import write_atomic


def test_a_file_is_replaced_in_one_step(tmp_path: Path) -> None:
    path = tmp_path / "document.json"
    for content in (b"one", b"two"):
        write_atomic(path, content)
        assert path.read_bytes() == content
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("dangling", [False, True])
def test_nothing_is_written_through_a_link(tmp_path: Path, dangling: bool) -> None:
    """In a folder that may be somebody else's the name of the unfinished file may be a link to one's own files."""
    mine = tmp_path / "mine"
    if not dangling:
        mine.write_bytes(b"precious")
    path = tmp_path / "document.json"
    (tmp_path / ".document.json.part").symlink_to(mine)
    write_atomic(path, b"new")
    assert path.read_bytes() == b"new"
    assert mine.read_bytes() == b"precious" if not dangling else not mine.exists()
