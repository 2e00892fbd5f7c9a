"""The page of a match: its data are the match, nothing in it is markup, and it is small."""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import replace
from html.parser import HTMLParser
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from pages import Unpacked, unpack_page
from teamclone.errors import UsageError
from teamclone.logs import Match, find_matches, read_match, read_pair
from teamclone.logs.align import first_body_commands, follows, slot_of
from teamclone.logs.match import Columns
from teamclone.plots.style import theme_css
from teamclone.rcss.commands import CommandKind
from teamclone.replay import channels
from teamclone.replay.page import MOST_BYTES, SCRIPTS, joined, make_replay

HOSTILE = (
    "</script><script>alert(1)</script><img src=x onerror=alert(2)> {{ script }} \N{LINE SEPARATOR} & \" ' \x1b[2J"
)


@pytest.fixture(scope="module")
def match(samples_dir: Path) -> Match:
    return read_match(min(samples_dir.glob("*.rcg.xz")))


@pytest.fixture(scope="module")
def short(match: Match) -> Match:
    """Its first frames."""
    assert match.log is not None
    n = 200
    frames = {name: values[:n] for name, values in match.frames.items()}
    players = {name: values[:n] for name, values in match.players.items()}
    kept = match.log.commands["frame"] < n
    commands = {name: values[kept] for name, values in match.log.commands.items()}
    game = replace(match.game, frames=frames, players=players)
    return replace(match, game=game, log=replace(match.log, commands=commands))


@pytest.fixture(scope="module")
def page(match: Match, tmp_path_factory: pytest.TempPathFactory) -> Unpacked:
    path = make_replay(match, tmp_path_factory.mktemp("replay") / "match.html").path
    return unpack_page(path.read_text(encoding="utf-8"))


class Elements(HTMLParser):
    """The elements of a page with their attributes, and the text of scripts and styles."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.found: list[tuple[str, dict[str, str | None]]] = []
        self.texts: dict[str, list[str]] = {"script": [], "style": []}
        self._in = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found.append((tag, dict(attrs)))
        self._in = tag
        if tag in self.texts:
            self.texts[tag].append("")

    def handle_endtag(self, tag: str) -> None:
        self._in = ""

    def handle_data(self, data: str) -> None:
        if self._in in self.texts:
            self.texts[self._in][-1] += data


@pytest.mark.parametrize("name", [*channels.FRAMES, *channels.PLAYERS])
def test_a_channel_is_that_of_the_match(match: Match, page: Unpacked, name: str) -> None:
    values = match.players[name] if name in channels.PLAYERS else match.frames[name]
    if np.isnan(values.astype(float)).all():
        assert name not in page.columns
        return
    np.testing.assert_allclose(page.columns[name], values, atol=0.5001 * page.step(name), rtol=0)


def test_positions_are_known_to_a_centimetre(page: Unpacked) -> None:
    assert {page.step(name) for name in ("x", "y", "ball_x", "ball_y")} == {0.01}


def test_commands_are_those_that_took_the_slot(match: Match, page: Unpacked) -> None:
    commands = match.commands
    first = first_body_commands(commands, match.frames["playmode"])
    at = commands["frame"][first], slot_of(commands["side"][first], commands["unum"][first])
    np.testing.assert_array_equal(page.columns["kind"][at], commands["kind"][first])
    assert np.count_nonzero(page.columns["kind"]) == len(first)
    turns = commands["kind"][first] == CommandKind.TURN
    moments = np.clip(commands["arg0"][first][turns], -180, 180)
    np.testing.assert_allclose(page.columns["argument0"][at][turns], moments, atol=0.0501)
    assert page.columns["refused"].mean() < 0.01


def test_messages_are_there(match: Match, page: Unpacked) -> None:
    steps, slots, texts = page.head["says"]
    said = np.flatnonzero((match.commands["kind"] == CommandKind.SAY) & (match.commands["frame"] >= 0))
    said = said[(match.commands["unum"][said] > 0) & match.commands["valid"][said]]
    assert len(texts) == len(said) > 1000
    assert sorted(texts) == sorted(match.command_text(int(at)) for at in said)
    assert sorted(np.cumsum(steps)) == sorted(match.commands["frame"][said])
    assert set(slots) <= set(range(22))


def tiled(match: Match, times: int) -> Match:
    """The match so many times in a row, on one clock."""
    frames = {name: np.tile(values, times) for name, values in match.frames.items()}
    length = int(match.frames["cycle"][-1])
    frames["cycle"] = frames["cycle"] + length * np.repeat(np.arange(times, dtype=np.int32), len(match.frames["cycle"]))
    players = {name: np.tile(values, (times, 1)) for name, values in match.players.items()}
    assert match.log is not None
    commands: Columns = {name: np.tile(values, times) for name, values in match.log.commands.items()}
    part = np.repeat(np.arange(times), len(match.log.commands["frame"]))
    commands["frame"] = np.where(commands["frame"] < 0, -1, commands["frame"] + part * len(match.frames["cycle"]))
    game = replace(match.game, frames=frames, players=players)
    return replace(match, game=game, log=replace(match.log, commands=commands))


def test_a_full_match_is_small(match: Match, tmp_path: Path) -> None:
    """Deflate sees no further back than 32 kB, so repeating a match is no help to it."""
    made = make_replay(tiled(match, 3), tmp_path / "match.html")
    assert made.frames >= 6000
    assert made.size == made.path.stat().st_size < 2_000_000 < MOST_BYTES
    assert made.notes == ()


def test_messages_give_way_to_the_size(short: Match, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    full = make_replay(short, tmp_path / "full.html")
    monkeypatch.setattr("teamclone.replay.page.MOST_BYTES", full.size - 1)
    made = make_replay(short, tmp_path / "small.html")
    assert made.size < full.size
    assert ["left out" in note for note in made.notes] == [True]
    assert unpack_page(made.path.read_text()).head["says"] == [[], [], []]


def test_hostile_words_are_only_data(short: Match, tmp_path: Path) -> None:
    assert short.log is not None
    left, right = replace(short.left, name=HOSTILE), replace(short.right, name="'><svg onload=alert(3)>")
    words = HOSTILE.encode()
    log = replace(
        short.log,
        text=words,
        commands=short.log.commands
        | {
            "text_start": np.zeros_like(short.log.commands["text_start"]),
            "text_stop": np.full_like(short.log.commands["text_stop"], len(words)),
        },
    )
    odd = replace(short, game=replace(short.game, left=left, right=right), log=log)
    html = make_replay(odd, tmp_path / "odd.html").path.read_text(encoding="utf-8")
    found = unpack_page(html).head
    assert (found["left"], found["right"]) == (left.name, right.name)
    assert set(found["says"][2]) == {words.decode()}
    plain = make_replay(short, tmp_path / "plain.html").path.read_text(encoding="utf-8")
    for text in ("alert(", "onerror", "onload=alert", "\x1b"):
        assert text not in html
    assert [tag for tag, _ in Elements(html).found] == [tag for tag, _ in Elements(plain).found]


def test_the_policy_allows_the_own_script_alone(short: Match, tmp_path: Path) -> None:
    html = make_replay(short, tmp_path / "match.html").path.read_text(encoding="utf-8")
    page = Elements(html)
    [policy] = [of["content"] for tag, of in page.found if of.get("http-equiv") == "Content-Security-Policy"]
    rules = dict(rule.strip().split(" ", 1) for rule in str(policy).split(";"))
    assert rules["default-src"] == "'none'"
    assert "unsafe" not in str(policy)
    [data, script] = page.texts["script"]
    assert re.fullmatch(r"[A-Za-z0-9+/=]+", data)
    for name, text in (("script-src", script), ("style-src", page.texts["style"][0])):
        digest = base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
        assert rules[name] == f"'sha256-{digest}'"
    # The policy comes before all that it governs, and nothing needs what it forbids.
    assert [tag for tag, _ in page.found].index("meta") < [tag for tag, _ in page.found].index("style")
    for tag, of in page.found:
        assert not [name for name in of if name.startswith("on") or name == "style"], tag
        assert not [
            value
            for name, value in of.items()
            if name in ("src", "href", "action") and value not in ("data:,", "report.html")
        ]


def test_the_script_gives_no_text_to_the_parser() -> None:
    assets = resources.files("teamclone.replay").joinpath("assets")
    for name in SCRIPTS:
        text = assets.joinpath(name).read_text("utf-8")
        assert not re.findall(
            r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\b|new Function|fetch\(", text
        )


def test_modules_can_be_one_script() -> None:
    """Each imports from those before it what they export, and no two have a name in common."""
    assets = resources.files("teamclone.replay").joinpath("assets")
    assert sorted(path.name for path in assets.iterdir() if path.name.endswith(".js")) == sorted(SCRIPTS)
    exported: dict[str, set[str]] = {}
    seen: set[str] = set()
    for name in SCRIPTS:
        text = assets.joinpath(name).read_text("utf-8")
        for names, source in re.findall(r"^import \{([^}]*)\} from \"\./([\w.]+)\";$", text, re.MULTILINE):
            assert {one.strip() for one in names.split(",")} <= exported[source], f"{name}: from {source}"
        own = re.findall(r"^(?:export )?(?:async )?(?:const|let|function|class) (\w+)", text, re.MULTILINE)
        assert not set(own) & seen, name
        seen |= set(own)
        exported[name] = set(re.findall(r"^export (?:async )?(?:const|let|function|class) (\w+)", text, re.MULTILINE))
    script = joined({name: assets.joinpath(name).read_text("utf-8") for name in SCRIPTS})
    assert not re.findall(r"^(import|export) ", script, re.MULTILINE)
    assert "</script" not in script


def luminance(colour: str) -> float:
    """Relative luminance of #rrggbb, as WCAG 2 defines it."""
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("night", [False, True])
def test_colours_stand_out(night: bool) -> None:
    """Words by 4.5 to 1, signs by 3 to 1; the teams differ without their hue, too."""
    style = resources.files("teamclone.replay").joinpath("assets/page.css").read_text("utf-8") + theme_css()
    found = dict(re.findall(r"--([\w-]+): (?:light-dark\()?(#\w{6})", style))
    if night:
        found |= dict(re.findall(r"--([\w-]+): light-dark\(#\w{6}, (#\w{6})\)", style))

    def contrast(one: str, other: str) -> float:
        low, high = sorted((luminance(found[one]), luminance(found[other])))
        return (high + 0.05) / (low + 0.05)

    words = [(name, paper) for name in ("ink", "muted", "low", "model", "accent") for paper in ("paper", "panel")]
    words += [("left-ink", "left"), ("right-ink", "right"), ("left-edge", "panel"), ("right-edge", "panel")]
    assert {pair: contrast(*pair) for pair in words if contrast(*pair) < 4.5} == {}
    signs = [(name, "grass") for name in ("left-edge", "right-edge", "ink", "model", "low")]
    assert {pair: contrast(*pair) for pair in signs if contrast(*pair) < 3} == {}
    assert contrast("left", "right") > 1.8
    assert contrast("left-ink", "right-ink") > 10


def test_every_odd_match_has_a_page(fixtures_dir: Path, tmp_path: Path) -> None:
    pairs = [pair for pair in find_matches([fixtures_dir]) if pair.rcg is not None]
    assert len(pairs) > 15
    notes = {}
    for pair in pairs:
        match = read_pair(pair)
        made = make_replay(match, tmp_path / "page.html")
        found = unpack_page(made.path.read_text(encoding="utf-8"))
        assert found.head["frames"] == made.frames == len(match.frames["cycle"])
        assert (found.head["left"], found.head["right"]) == (match.left.name, match.right.name)
        np.testing.assert_allclose(found.columns["ball_x"], match.frames["ball_x"], atol=0.0051)
        assert found.head["notes"] == list(made.notes)
        if "refused" in found.columns:
            assert not found.columns["refused"][~follows(match.frames)].any()
        notes[Path(str(pair.rcg)).parent.name] = made.notes
    assert "No team on the right." in notes["onesided"]
    assert "Logs of this version have no stamina." in notes["native-v1"]
    assert notes["v6"] == ()


def test_without_a_command_log_commands_are_worked_out(match: Match, page: Unpacked, tmp_path: Path) -> None:
    made = make_replay(replace(match, log=None, rcl_path=None), tmp_path / "page.html")
    assert made.notes == ("There is no command log: commands are those that the game log implies.",)
    found = unpack_page(made.path.read_text()).columns["kind"]
    logged = page.columns["kind"]
    both = (found != 0) & (logged != 0)
    assert (found == logged)[both].mean() > 0.99
    assert both.sum() > 0.9 * (logged != 0).sum()


def test_a_command_log_alone_has_nothing_to_show(match: Match, tmp_path: Path) -> None:
    nothing = {name: values[:0] for name, values in match.frames.items()}
    nobody = {name: values[:0] for name, values in match.players.items()}
    empty = replace(match, game=replace(match.game, frames=nothing, players=nobody))
    with pytest.raises(UsageError, match=r"expected frames to show.*\.rcg"):
        make_replay(empty, tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()
