"""Take the picture of a replay for the pages: `python docs/replay_picture.py PAGE.html [FRAGMENT]`. Needs Chromium."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

from chromium import browser  # noqa: E402

FRAGMENT = "#c=2490&p=r4"


def write(page: Path, fragment: str = FRAGMENT) -> None:
    """Open the page at a moment and save what is seen."""
    with tempfile.TemporaryDirectory() as profile, browser(Path(profile)) as opened:
        opened.open(page.resolve().as_uri() + fragment, width=1400, height=860)
        opened.wait_for("globalThis.replay && replay.pictures > 0 && !replay.dirty")
        (ROOT / "docs" / "images" / "replay.png").write_bytes(opened.screenshot())


if __name__ == "__main__":
    write(Path(sys.argv[1]), *sys.argv[2:3])
