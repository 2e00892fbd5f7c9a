"""How large a replay of a full match is, how fast it opens, and how many frames a second it shows in a real browser.

    python benchmarks/replay.py MATCHES [--run RUN] [--seconds N]

MATCHES is a folder of logs; the longest match is taken, and repeated until it has 6000 cycles. Opening is the time from
the navigation to the first picture of the pitch; frames a second are those of requestAnimationFrame in which the pitch
was drawn, while the match plays; the longest gap between them and the time of one drawing are printed beside. Needs
Chromium, which draws on the processor here: a graphics card is faster.
"""

from __future__ import annotations

import argparse
import statistics
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from chromium import CHROMIUM, Page, browser
from teamclone.cli.common import print_table
from teamclone.logs import Match, find_matches, read_pair
from teamclone.replay.page import make_replay

CYCLES = 6000
SPEEDS = (0.1, 1, 4, 16)
WINDOWS = {"desk": (1440, 900), "phone": (390, 844)}

MEASURE = """
(async () => {
  const { clock } = replay;
  clock.seek(%d); clock.setSpeed(%f); clock.play(1);
  await new Promise((done) => setTimeout(done, 300));
  const pictures = replay.pictures, start = performance.now();
  let last = start, gap = 0;
  await new Promise((done) => {
    const next = (now) => {
      gap = Math.max(gap, now - last); last = now;
      if (now - start < %f) requestAnimationFrame(next); else done();
    };
    requestAnimationFrame(next);
  });
  const rate = (replay.pictures - pictures) / (performance.now() - start) * 1000;
  clock.pause();
  const begin = performance.now();
  for (let i = 0; i < 100; i++) replay.draw(performance.now());
  return [rate, gap, (performance.now() - begin) / 100];
})()
"""


def full(match: Match) -> Match:
    """The match, repeated on one clock until it has so many cycles."""
    n, length = len(match.frames["cycle"]), int(match.frames["cycle"][-1])
    times = -(-CYCLES // length)
    frames = {name: np.tile(values, times) for name, values in match.frames.items()}
    frames["cycle"] = frames["cycle"] + length * np.repeat(np.arange(times, dtype=np.int32), n)
    players = {name: np.tile(values, (times, 1)) for name, values in match.players.items()}
    game, log = replace(match.game, frames=frames, players=players), match.log
    if log is not None:
        commands = {name: np.tile(values, times) for name, values in log.commands.items()}
        part = np.repeat(np.arange(times), len(log.commands["frame"]))
        commands["frame"] = np.where(commands["frame"] < 0, -1, commands["frame"] + part * n).astype(np.int32)
        commands["cycle"] = (commands["cycle"] + part * length).astype(np.int32)
        log = replace(log, commands=commands)
    return replace(match, game=game, log=log)


def opening(page: Page, address: str, width: int, height: int) -> float:
    """Milliseconds from the navigation to the first picture."""
    page.open("about:blank")
    page.open(address, width=width, height=height)
    page.wait_for("globalThis.replay && replay.pictures > 0")
    return float(page.evaluate("replay.firstPicture"))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("matches", type=Path)
    parser.add_argument("--run", type=Path, help="show its predictions, too")
    parser.add_argument("--seconds", type=float, default=5.0, help="of playing, for each rate")
    options = parser.parse_args()
    if CHROMIUM is None:
        sys.exit("benchmarks/replay.py needs Chromium: apt-get install chromium")
    pairs = [pair for pair in find_matches([options.matches]) if pair.rcg is not None]
    match = full(max(map(read_pair, pairs[:8]), key=lambda one: len(one.frames["cycle"])))
    with tempfile.TemporaryDirectory() as folder:
        made = make_replay(match, Path(folder) / "match.html", run=options.run)
        predicted = ", ".join(made.predicted) or "none"
        print(f"{match}: {made.size / 1e6:.2f} MB, {made.frames:,} frames, predicted: {predicted}")
        rows = []
        with browser(Path(folder) / "profile") as page:
            for name, (width, height) in WINDOWS.items():
                times = [opening(page, made.path.as_uri(), width, height) for _ in range(5)]
                for speed in SPEEDS:
                    script = MEASURE % (made.frames // 3, speed, 1000 * options.seconds)
                    rate, gap, drawing = page.evaluate(script)
                    rows.append(
                        (
                            name,
                            f"{statistics.median(times):.0f} ms",
                            f"{speed:g}",
                            f"{rate:.1f}",
                            f"{gap:.0f} ms",
                            f"{drawing:.1f} ms",
                        )
                    )
            if page.problems:
                sys.exit(f"the page complained: {page.problems}")
        print_table(
            ["window", "opens in", "speed", "frames/s", "longest gap", "one drawing"], rows, numeric=range(1, 6)
        )


if __name__ == "__main__":
    main()
