"""Replays: with a clone and its roll-outs, from a store, as a command; and in a real browser."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import teamclone as tc
from chromium import CHROMIUM, Page, browser
from pages import unpack_page
from teamclone.cli.app import app
from teamclone.errors import RunError, StoreError, UsageError
from teamclone.logs import find_matches, read_pair
from teamclone.replay.page import make_replay
from teamclone.training.config import load_config

SETTINGS = (
    *("model.hidden=[16]", "model.ensemble_size=1", "model.blocks=self,role,ball", "model.kick_blocks=self,ball"),
    *("model.target_points=2", "model.target_hidden=8", "model.parameter_hidden=16", "model.kick_hidden=8"),
    *("model.kick_attention=0", "train.epochs=1", "data.batch_size=256", "data.batches_per_epoch=20"),
    *("train.threads=1", "train.precision=fp32", "train.device=cpu"),
)
in_a_browser = pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")


def invoked(*arguments: object) -> str:
    """What a command prints, in this process."""
    return CliRunner().invoke(app, [str(one) for one in arguments], catch_exceptions=False).stdout


@pytest.fixture(scope="module")
def log(samples_dir: Path) -> Path:
    return min(samples_dir.glob("*.rcg.xz"))


@pytest.fixture(scope="module")
def folder(samples_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store, a dataset and a run of HELIOS_base."""
    made = tmp_path_factory.mktemp("replay")
    store = tc.create_store(made / "store")
    for path in sorted(samples_dir.glob("*.rcg.xz"))[:4]:
        store.add(tc.read_match(path))
    tc.build_dataset(tc.DatasetConfig(teams=("HELIOS_base",)), store=store, out=made / "dataset", jobs=1)
    tc.train(load_config("best", SETTINGS), tc.open_dataset(made / "dataset"), made / "run")
    return made


@pytest.fixture(scope="module")
def predicted(folder: Path, log: Path) -> Path:
    """A page with the predictions of both teams and with futures."""
    beside = make_replay(log, folder / "run" / "replay.html", run=folder / "run").path
    assert unpack_page(beside.read_text()).head["home"] == "report.html"
    size = ("--starts", 2, "--samples", 3, "--horizon", 12)
    invoked("rollout", folder / "run", log, *size, "--trajectories", "--out", folder / "rollouts")
    made = make_replay(
        log,
        folder / "predicted.html",
        run=folder / "run",
        teams=("HELIOS_base", "WEBase"),
        rollouts=folder / "rollouts" / "fans.json",
    )
    assert made.predicted == ("HELIOS_base", "WEBase")
    return made.path


def test_predictions_are_those_of_predict(folder: Path, log: Path, predicted: Path) -> None:
    page = unpack_page(predicted.read_text())
    table = tc.load(folder / "run").predict(log, team="HELIOS_base").to_arrow()
    at = table["frame"].to_numpy(), table["unum"].to_numpy().astype(int) - 1
    assert page.head["predictions"]["commands"] == ["dash", "turn", "kick", "tackle"]
    assert page.head["predictions"]["of"] == ["left", "right"]
    for name in ("dash", "turn", "kick", "tackle"):
        np.testing.assert_allclose(page.columns[f"p_{name}"][at], table[f"p_{name}"].to_numpy(), atol=0.0021)
    loss = table["log_loss"].to_numpy(zero_copy_only=False)
    np.testing.assert_allclose(page.columns["loss"][at], loss, atol=0.0051)
    done = [
        None if np.isnan(value) else page.head["predictions"]["commands"][int(value)]
        for value in page.columns["answered"][at]
    ]
    assert done == table["done"].to_pylist()
    likely = table["p_turn"].to_numpy() > 0.021
    moment = page.columns["turn_moment"][at]
    np.testing.assert_allclose(moment[likely], table["turn_moment"].to_numpy()[likely], atol=0.51)
    assert np.isnan(moment[table["p_turn"].to_numpy() < 0.019]).all()
    # Of the likeliest command alone there is a spread.
    spread = page.columns["turn_moment_spread"][at]
    likeliest = np.array(table["likeliest"].to_pylist())
    assert np.isnan(spread[likeliest != "turn"]).all()
    assert (spread[likeliest == "turn"] >= 0).all()
    # Nobody is predicted outside play_on.
    outside = page.columns["playmode"] != 3
    assert np.isnan(page.columns["loss"][outside]).all()


def test_futures_are_those_of_the_roll_outs(folder: Path, log: Path, predicted: Path) -> None:
    fans = unpack_page(predicted.read_text()).head["fans"]["of"]
    written = json.loads((folder / "rollouts" / "fans.json").read_text())["fans"]
    cycle = tc.read_match(log).frames["cycle"]
    assert sorted(int(cycle[fan["frame"]]) for fan in fans) == sorted(fan["cycle"] for fan in written)
    for fan in fans:
        [same] = [one for one in written if one["cycle"] == cycle[fan["frame"]]]
        assert fan["ahead"] == list(range(same["ahead"] + 1))
        assert [body["slot"] for body in fan["bodies"]] == [*range(1, 11), 22]
        for body, other in zip(fan["bodies"], same["bodies"], strict=True):
            np.testing.assert_allclose(np.reshape(body["paths"], (3, -1, 2)) * 0.1, other["samples"], atol=1e-6)


def test_trajectories_give_the_same_futures(folder: Path, log: Path, predicted: Path) -> None:
    made = make_replay(log, folder / "page.html", rollouts=folder / "rollouts" / "trajectories.parquet")
    fans = unpack_page(made.path.read_text()).head["fans"]["of"]
    known = {fan["frame"]: fan for fan in unpack_page(predicted.read_text()).head["fans"]["of"]}
    assert {fan["frame"] for fan in fans} == set(known)
    for fan in fans:
        paths = {body["slot"]: body["paths"] for body in fan["bodies"]}
        reach = 2 * len(known[fan["frame"]]["ahead"])
        for body in known[fan["frame"]]["bodies"]:
            if body["slot"] in paths:
                np.testing.assert_allclose([path[:reach] for path in paths[body["slot"]]], body["paths"], atol=1)
        assert len(paths) >= 8


def test_futures_of_another_match_are_refused(folder: Path, predicted: Path, samples_dir: Path, tmp_path: Path) -> None:
    other = sorted(samples_dir.glob("*.rcg.xz"))[1]
    for name in ("fans.json", "trajectories.parquet"):
        with pytest.raises(RunError, match=r"found none; run `teamclone rollout` on it"):
            make_replay(other, tmp_path / "page.html", rollouts=folder / "rollouts" / name)
    (tmp_path / "odd.parquet").write_bytes(b"PAR1 and more")
    with pytest.raises(RunError, match=r"expected trajectories\.parquet"):
        make_replay(other, tmp_path / "page.html", rollouts=tmp_path / "odd.parquet")
    with pytest.raises(RunError, match=r"(fans|rollouts)\.json"):
        make_replay(other, tmp_path / "page.html", rollouts=tmp_path / "fans.json")


def test_a_store_gives_the_same_page(folder: Path, log: Path, tmp_path: Path) -> None:
    match_id = tc.read_match(log).match_id
    store = tc.open_store(folder / "store")
    from_store = tc.make_replay(match_id, tmp_path / "a.html", store=store)
    from_log = tc.make_replay(log, tmp_path / "b.html")
    one, other = (unpack_page(made.path.read_text()) for made in (from_store, from_log))
    assert one.head["says"] == other.head["says"]
    assert one.head["events"] == other.head["events"]
    assert set(one.columns) == set(other.columns)
    for name, values in one.columns.items():
        np.testing.assert_array_equal(values, other.columns[name], err_msg=name)


def test_the_command(folder: Path, log: Path, tmp_path: Path) -> None:
    out, replay = tmp_path / "pages" / "match.html", tmp_path / "match.replay"
    answer = json.loads(invoked("replay", log, "--run", folder / "run", "--out", out, "--jasmin", replay, "--json"))
    assert answer["path"] == str(out)
    assert answer["predicted"] == ["HELIOS_base"]
    assert answer["size"] == out.stat().st_size
    assert answer["events"]["kick"] > 50
    assert unpack_page(out.read_text()).head["home"] is None
    assert replay.read_text().startswith("RPL 2D 1\n")
    match_id = tc.read_match(log).match_id
    assert invoked("replay", match_id, "--store", folder / "store", "--out", out).strip() == str(out)
    with pytest.raises(StoreError, match="no match 'ffff"):
        invoked("replay", "ffff", "--store", folder / "store", "--out", out)
    with pytest.raises(UsageError, match="no team 'Nobody'"):
        invoked("replay", log, "--run", folder / "run", "--team", "Nobody", "--out", out)


def test_without_a_run_it_needs_no_pytorch(fixtures_dir: Path, tmp_path: Path) -> None:
    log = min((fixtures_dir / "onesided").glob("*.rcg*"))
    code = (
        "import sys; sys.modules['torch'] = sys.modules['matplotlib'] = sys.modules['jinja2'] = None; "
        "from teamclone.cli import main; sys.argv[0] = 'teamclone'; main()"
    )
    command = [sys.executable, "-c", code, "replay", str(log), "--out", str(tmp_path / "page.html")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr == "teamclone: No team on the right.\n"
    assert done.stdout == f"{tmp_path / 'page.html'}\n"


def test_a_clone_of_another_team_is_named_and_the_match_shown(folder: Path, fixtures_dir: Path, tmp_path: Path) -> None:
    match = tc.read_match(min((fixtures_dir / "v6").glob("*.rcg*")))
    other = replace(
        match, game=replace(match.game, left=replace(match.left, name="Red"), right=replace(match.right, name="Blue"))
    )
    made = make_replay(other, tmp_path / "page.html", run=folder / "run")
    assert made.predicted == ()
    assert "learned from HELIOS_base, and Red and Blue play here" in made.notes[0]
    assert unpack_page(made.path.read_text()).head["predictions"] is None


def test_a_log_without_what_the_clone_needs_is_shown_all_the_same(
    folder: Path, fixtures_dir: Path, tmp_path: Path
) -> None:
    made = make_replay(min((fixtures_dir / "native-v2").glob("*.rcg*")), tmp_path / "page.html", run=folder / "run")
    assert made.predicted == ()
    assert any("No predictions for HELIOS_base" in note and "vx" in note for note in made.notes)


def test_a_store_takes_ids_not_matches(folder: Path, log: Path, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="leave out the store"):
        make_replay(tc.read_match(log), tmp_path / "page.html", store=tc.open_store(folder / "store"))


# In a browser.


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    with browser(tmp_path_factory.mktemp("chromium")) as opened:
        yield opened


def opened(page: Page, path: Path, fragment: str = "", **window: object) -> None:
    """Open a replay and wait for its first picture."""
    page.problems.clear()
    page.requests.clear()
    page.open("about:blank")
    page.open(path.as_uri() + fragment, **window)  # type: ignore[arg-type]
    page.wait_for("globalThis.replay && replay.pictures > 0")


def cycle(page: Page) -> int:
    return int(page.evaluate("replay.match.cycle(replay.clock.frame)"))


def box_of(page: Page, name: str) -> list[float]:
    """Left, top, width and height of an element."""
    return list(page.evaluate(f"(({{x, y, width, height}}) => [x, y, width, height])({name}.getBoundingClientRect())"))


def ink(page: Page) -> float:
    """The share of the pitch's pixels that are unlike its grass."""
    return float(
        page.evaluate(
            "(() => { const c = document.getElementById('pitch'); const d = c.getContext('2d')"
            ".getImageData(0, 0, c.width, c.height).data; let n = 0;"
            "for (let i = 0; i < d.length; i += 4) n += Math.abs(d[i] - d[0]) + Math.abs(d[i + 2] - d[2]) > 60;"
            "return n / (d.length / 4); })()"
        )
    )


@pytest.mark.browser
@in_a_browser
@pytest.mark.parametrize(("width", "dark"), [(1400, False), (1400, True), (390, False)])
def test_it_opens_without_a_word(page: Page, predicted: Path, width: int, dark: bool) -> None:
    opened(page, predicted, "#c=200&p=l7", width=width, height=844, dark=dark)
    assert page.problems == []
    assert page.requests == [predicted.as_uri() + "#c=200&p=l7"][:1] or {
        address.partition("#")[0] for address in page.requests
    } <= {predicted.as_uri(), "about:blank", "data:,"}
    assert cycle(page) == 200
    assert page.evaluate("replay.view.chosen") == 6
    assert 0.005 < ink(page) < 0.5
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    paper = "rgb(19, 22, 26)" if dark else "rgb(255, 255, 255)"
    assert page.evaluate("getComputedStyle(document.body).backgroundColor") == paper
    assert "Cycle" in page.evaluate("document.getElementById('detail').getAttribute('aria-label')")


@pytest.mark.browser
@in_a_browser
def test_it_plays_both_ways_and_seeks(page: Page, predicted: Path) -> None:
    opened(page, predicted, "#c=100")
    page.press(" ")
    page.wait_for("replay.clock.now > replay.match.frameOf(100) + 3")
    assert page.evaluate("document.getElementById('play').getAttribute('aria-label')") == "Pause"
    page.press(" ")
    page.press("ArrowUp")
    assert page.evaluate("replay.clock.speed") == 2
    page.press("r")
    page.wait_for("replay.clock.now < replay.match.frameOf(100)")
    page.press("r")
    before = page.evaluate("replay.clock.frame")
    page.press("ArrowRight")
    page.press("ArrowRight", shift=True)
    assert page.evaluate("replay.clock.frame") == pytest.approx(before + 11, abs=1)
    page.press("End")
    assert page.evaluate("replay.clock.frame === replay.match.frames - 1")
    page.press(" ")  # at the end it begins anew
    page.wait_for("replay.clock.now > 0 && replay.clock.now < 100")
    page.press(" ")
    box = box_of(page, "overview")
    page.click(box[0] + 0.5 * box[2], box[1] + box[3] / 2)
    assert page.evaluate("replay.clock.now / replay.clock.last") == pytest.approx(0.5, abs=0.01)
    page.click(box[0] + 0.5 * box[2], box[1] + box[3] / 2, to=(box[0] + 0.25 * box[2], box[1] + 5))
    assert page.evaluate("replay.clock.now / replay.clock.last") == pytest.approx(0.25, abs=0.01)
    assert page.problems == []


@pytest.mark.browser
@in_a_browser
def test_keys_jump_to_what_happened(page: Page, predicted: Path) -> None:
    head = unpack_page(predicted.read_text()).head
    columns = unpack_page(predicted.read_text()).columns
    opened(page, predicted, "#c=1")
    for key, kind in (("g", "goal"), ("h", "shot"), ("k", "kick"), ("t", "interception"), ("p", "set play")):
        page.press("Home")
        frames = [event[0] for event in head["events"] if event[1] == kind and event[0] > 0]
        page.press(key)
        assert page.evaluate("replay.clock.frame") == frames[0], kind
        page.press(key)
        later = [frame for frame in frames if frame > frames[0]]
        assert page.evaluate("replay.clock.frame") == later[0], kind
        page.press(key, shift=True)
        assert page.evaluate("replay.clock.frame") == frames[0], kind
    page.press("Home")
    page.press("s")
    page.wait_for("!replay.dirty")
    frame = page.evaluate("replay.clock.frame")
    greatest = np.nanmax(columns["loss"][frame])
    assert greatest > np.nanquantile(columns["loss"], 0.99)
    # The list has it, marked as the present one, with its player.
    assert page.evaluate("document.querySelector('#list [aria-current]').textContent").startswith(str(cycle(page)))
    page.evaluate("document.querySelector('#list [aria-current] button').click()")
    page.wait_for("!replay.dirty")
    chosen = page.evaluate("replay.view.chosen")
    assert columns["loss"][frame, chosen] == pytest.approx(greatest)
    verdict = page.evaluate("document.querySelector('.verdict').textContent")
    assert verdict.startswith("Did ")
    assert "nats" in verdict or "As the clone expected" in verdict
    assert page.problems == []


@pytest.mark.browser
@in_a_browser
def test_filters_search_and_the_address(page: Page, predicted: Path) -> None:
    opened(page, predicted, "#c=1")
    rows = "document.querySelectorAll('#list li').length"
    everything = page.evaluate(rows)
    page.evaluate("[...document.querySelectorAll('#filters button')].find((b) => b.textContent === 'tackle').click()")
    assert page.evaluate(rows) < everything
    page.press("/")
    page.call("Input.insertText", text="goal")
    shown = page.evaluate("[...document.querySelectorAll('#list li')].map((row) => row.textContent)")
    assert shown
    assert [text for text in shown if "goal" not in text.lower()] == []
    page.evaluate("replay.clock.setSpeed(4); replay.choose(17); replay.clock.seek(replay.match.frameOf(300))")
    link = page.wait_for("location.hash.includes('c=300') && location.hash")
    assert {"p=r7", "s=4", "q=goal"} <= set(link.lstrip("#").split("&"))
    assert "tackle" not in link
    opened(page, predicted, link)
    assert cycle(page) == 300
    assert (page.evaluate("replay.view.chosen"), page.evaluate("replay.clock.speed")) == (17, 4)
    assert page.evaluate("document.getElementById('search').value") == "goal"
    page.evaluate("location.hash = '#c=310&p=l2'")
    page.wait_for("replay.view.chosen === 1")
    assert cycle(page) == 310


@pytest.mark.browser
@in_a_browser
def test_a_player_is_chosen_by_a_click_and_followed(page: Page, predicted: Path) -> None:
    opened(page, predicted, "#c=150")
    slot = 19
    left, top, *_ = box_of(page, "pitch")
    x, y = page.evaluate(f"replay.camera.toPixels(replay.match.place({slot}, replay.clock.now))")
    page.click(left + x, top + y)
    assert page.evaluate("replay.view.chosen") == slot
    page.press("f")
    page.press("f")
    assert page.evaluate("replay.camera.follow") == "player"
    page.wait_for("replay.camera.zoom >= 3")
    page.press("Escape")
    assert page.evaluate("[replay.view.chosen, replay.camera.zoom, replay.camera.follow]") == [None, 1, "none"]
    page.press("1")
    page.press("1")
    assert page.evaluate("replay.view.chosen") == 21
    page.press("?")
    assert page.evaluate("document.getElementById('keys').open")
    assert page.evaluate("document.querySelectorAll('#key-list dt').length") > 25


@pytest.mark.browser
@in_a_browser
def test_the_list_keeps_its_place_for_the_keyboard(page: Page, predicted: Path) -> None:
    opened(page, predicted, "#c=1")
    row = "[...document.querySelectorAll('#list li')].find((one) => /goal/.test(one.textContent))"
    page.evaluate(f"{row}.firstElementChild.focus()")
    for press in ("keyDown", "keyUp"):
        page.call("Input.dispatchKeyEvent", type=press, key="Enter", code="Enter", windowsVirtualKeyCode=13, text="\r")
    page.wait_for("replay.clock.now > 0 && replay.view.chosen !== null && !replay.dirty")
    assert "goal" in page.evaluate("document.activeElement.textContent")
    page.evaluate("replay.choose(null)")
    page.wait_for("!replay.dirty")
    page.evaluate("document.querySelector('#facts button').focus()")
    page.evaluate("document.activeElement.click()")
    page.wait_for("document.activeElement.id === 'player'")
    assert page.evaluate("document.getElementById('player').value") == "0"
    assert page.problems == []


@pytest.mark.browser
@in_a_browser
def test_fingers_choose_and_zoom(page: Page, predicted: Path) -> None:
    opened(page, predicted, "#c=150", width=390, height=844)
    left, top, *_ = box_of(page, "pitch")
    x, y = page.evaluate("replay.camera.toPixels(replay.match.place(0, replay.clock.now))")

    def touch(kind: str, *points: tuple[float, float]) -> None:
        page.call(
            "Input.dispatchTouchEvent",
            type=kind,
            touchPoints=[{"x": left + x, "y": top + y, "id": index} for index, (x, y) in enumerate(points)],
        )

    touch("touchStart", (x, y))
    touch("touchEnd")
    assert page.evaluate("replay.view.chosen") == 0
    touch("touchStart", (150, 100))
    touch("touchStart", (150, 100), (200, 100))
    for spread in range(10, 60, 10):
        touch("touchMove", (150 - spread, 100), (200 + spread, 100))
    touch("touchEnd")
    assert page.evaluate("replay.camera.zoom") == pytest.approx(3, abs=0.3)
    assert page.problems == []


@pytest.mark.browser
@in_a_browser
def test_pictures_and_clips(page: Page, predicted: Path) -> None:
    opened(page, predicted, "#c=150")
    size = page.evaluate(
        "replay.capture.png().then((blob) => blob.arrayBuffer()).then((b) => [...new Uint8Array(b.slice(0, 24))])"
    )
    assert bytes(size[:8]) == b"\x89PNG\r\n\x1a\n"
    assert int.from_bytes(bytes(size[16:20]), "big") > 600
    page.press("c")
    page.wait_for("replay.clock.now > replay.match.frameOf(150) + 8 && replay.pictures > 10")
    page.press("c")
    page.wait_for("Boolean(replay.capture.lastClip)")
    clip = page.evaluate(
        "replay.capture.lastClip.arrayBuffer().then((b) => [b.byteLength, ...new Uint8Array(b.slice(0, 4))])"
    )
    assert clip[0] > 5_000
    assert bytes(clip[1:]) == b"\x1aE\xdf\xa3", "the first bytes of WebM"
    assert page.problems == []


@pytest.mark.browser
@in_a_browser
def test_every_odd_match_opens(page: Page, fixtures_dir: Path, tmp_path: Path) -> None:
    for pair in find_matches([fixtures_dir]):
        if pair.rcg is None:
            continue
        made = make_replay(read_pair(pair), tmp_path / "page.html")
        opened(page, made.path)
        for key in ("End", "Home", "k", "a", "v", "o", "1", "f", "f"):
            page.press(key)
        page.wait_for("!replay.dirty")
        assert page.problems == [], pair.rcg
        assert page.evaluate("document.getElementById('loading').textContent") == "", pair.rcg
        assert ink(page) > 0.003, pair.rcg


@pytest.mark.browser
@in_a_browser
def test_hostile_words_are_shown_as_they_are(page: Page, samples_dir: Path, tmp_path: Path) -> None:
    match = tc.read_match(min(samples_dir.glob("*.rcg.xz")))
    name = "<img src=x onerror='globalThis.owned = 1'></script><script>globalThis.owned = 1</script>"
    odd = replace(match, game=replace(match.game, left=replace(match.left, name=name)))
    opened(page, make_replay(odd, tmp_path / "page.html").path)
    for key in ("g", "k", "1"):
        page.press(key)
    assert page.evaluate("document.getElementById('left-name').textContent") == name
    assert page.evaluate("globalThis.owned") is None
    assert page.evaluate("document.images.length") == 0
    assert page.problems == []
    # And the policy holds: even a script that got in would not run.
    page.evaluate(
        "document.body.append(Object.assign(document.createElement('script'), {text: 'globalThis.owned = 1'}))"
    )
    assert page.evaluate("globalThis.owned") is None
    assert any("Content Security Policy" in problem for problem in page.problems)
