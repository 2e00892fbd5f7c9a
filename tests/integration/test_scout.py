"""The command `scout`, from a store to its page and the replays that it points into."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

import teamclone as tc
from chromium import CHROMIUM, browser
from command import called
from compared import TEAM, made_store, samples, variant
from pages import unpack_page
from teamclone.errors import UsageError
from teamclone.evaluation import bootstrap
from teamclone.logs import Match
from teamclone.scout import significance
from teamclone.scout.scout import FORMAT
from teamclone.scout.sections import SECTIONS

HOSTILE = "<script>alert(1)</script>$x{goals}"
"""A name of an opponent, which is anybody's."""


@pytest.fixture(scope="module", autouse=True)
def quick() -> Iterator[None]:
    """Fewer draws: what they are good for, `tests/unit/scout` asks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bootstrap, "N_RESAMPLES", 50)
        patch.setattr(significance, "PERMUTATIONS", 200)
        yield


@pytest.fixture(scope="module")
def matches(samples_dir: Path) -> list[Match]:
    return samples(samples_dir, "Cyrus2DBase", "YuShan2024")


@pytest.fixture(scope="module")
def folder(matches: list[Match], tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("scout")
    one, other, third, _ = matches
    made_store(made / "store", [one, other, variant(third, 0, opponent=HOSTILE)])
    called("scout", made / "store", "--team", TEAM, "--out", made / "out" / "page.html", "--jobs", 1)
    return made


@pytest.fixture(scope="module")
def document(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((folder / "out" / "page.json").read_text())
    return found


@pytest.fixture(scope="module")
def page(folder: Path) -> str:
    return (folder / "out" / "page.html").read_text()


def test_the_document_has_every_measure_of_both_teams(document: dict[str, Any]) -> None:
    assert document["format"] == FORMAT
    assert document["team"] == TEAM
    assert [one["key"] for one in document["measures"]] == [one.key for of in SECTIONS for one in of.MEASURES]
    assert len({one["key"] for one in document["measures"]}) == len(document["measures"])
    by_key = {one["key"]: one for one in document["measures"]}
    assert by_key["goals"]["team"]["value"] == pytest.approx(by_key["goals_against"]["opponents"]["value"])
    assert by_key["possession"]["team"]["value"] + by_key["possession"]["opponents"]["value"] == pytest.approx(1)


def test_every_section_says_something(document: dict[str, Any]) -> None:
    for section in document["sections"]:
        assert section["claims"] or section["notes"], section["key"]
        for one in section["claims"]:
            assert not re.search(r"\{\w+\}", one["text"].replace(HOSTILE, "")), one["text"]
            assert "nan" not in one["text"].split(), one["text"]


def test_the_page_obeys_no_name(page: str, document: dict[str, Any]) -> None:
    assert HOSTILE in document["opponents"]
    assert "<script" not in page
    assert HOSTILE.replace("<", "&lt;").replace(">", "&gt;") in page
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_links_lead_to_replays_of_that_moment(folder: Path, page: str, document: dict[str, Any]) -> None:
    links = {unquote(one) for one in re.findall(r'href="([^"#]+)#', page)}
    assert links
    moments = {at["match_id"] for of in document["sections"] for one in of["claims"] for at in one["moments"]}
    assert links == {f"page-replays/{name}.html" for name in moments}
    for one in links:
        assert unpack_page((folder / "out" / one).read_text()).head["home"] == "../page.html"


@pytest.mark.skipif(CHROMIUM is None, reason="needs chromium")
def test_a_browser_opens_it_and_follows_a_link(folder: Path, tmp_path: Path) -> None:
    with browser(tmp_path) as opened:
        for dark in (False, True):
            opened.open((folder / "out" / "page.html").as_uri(), dark=dark)
            opened.wait_for("document.querySelectorAll('figure svg').length >= 5")
        address = opened.evaluate("document.querySelector('.see a').href")
        found = re.search(r"#c=(\d+)", address)
        assert found is not None
        opened.open(address)
        opened.wait_for("globalThis.replay && replay.pictures > 0")
        assert opened.evaluate("document.getElementById('cycle').value") == found[1]
        assert opened.evaluate("document.getElementById('home').getAttribute('href')") == "../page.html"
        assert not opened.problems


def test_the_score_of_each_match_is_the_log_s(matches: list[Match], document: dict[str, Any]) -> None:
    found = {one["match_id"]: one["score"] for one in document["matches"]}
    for match in matches[:2]:
        own, other = (match.left, match.right) if match.left.name == TEAM else (match.right, match.left)
        assert found[match.match_id] == [own.score, other.score]


def test_tables_as_csv_and_numbers_as_json(folder: Path, tmp_path: Path) -> None:
    arguments = ("scout", folder / "store", "--team", TEAM, "--opponent", "Cyrus2DBase", "--replays", 0, "--jobs", 1)
    found = json.loads(called(*arguments, "--out", tmp_path / "a.html", "--csv", tmp_path / "csv", "--json").stdout)
    assert found["opponents"] == {"Cyrus2DBase": 2}
    assert [one["reason"] for one in found["left_out"]] == ["its opponent was not asked for"]
    assert not (tmp_path / "a-replays").exists()
    with (tmp_path / "csv" / "measures.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["key"] for row in rows] == [one["key"] for one in found["measures"]]
    names = {f"{of['key']}-{one['name']}.csv" for of in found["sections"] for one in of["tables"]}
    assert {path.name for path in (tmp_path / "csv").iterdir()} == names | {"measures.csv"}


def test_one_match_says_that_it_is_one(folder: Path, tmp_path: Path) -> None:
    arguments = ("scout", folder / "store", "--team", TEAM, "--opponent", HOSTILE, "--replays", 0, "--jobs", 1)
    text = called(*arguments, "--out", tmp_path / "a.html").stdout
    assert "One match alone cannot tell a habit from chance" in text
    assert " to " not in text.splitlines()[1]
    assert "One match only" in (tmp_path / "a.html").read_text()


def test_what_changed_needs_two_sets(folder: Path, tmp_path: Path, matches: list[Match]) -> None:
    earlier = made_store(tmp_path / "earlier", [variant(matches[0], at) for at in (0, 2, 4)])
    arguments = ("scout", folder / "store", "--team", TEAM, "--opponent", "Cyrus2DBase", "--replays", 0, "--jobs", 1)
    found = json.loads(
        called(
            *arguments,
            "--earlier",
            earlier.location,
            "--against",
            "Cyrus2DBase",
            "--out",
            tmp_path / "a.html",
            "--json",
        ).stdout
    )
    (changed,) = [one for one in found["sections"] if one["key"] == "changes"]
    assert changed["notes"][0].startswith("3 matches before and 2 since.")
    assert len(changed["tables"][0]["rows"]) > 20


def test_a_damaged_match_does_not_stop_the_others(matches: list[Match], tmp_path: Path) -> None:
    store = made_store(tmp_path / "store", [variant(matches[0], at) for at in (1, 3)])
    broken = store.match_ids()[0]
    (tmp_path / "store" / "matches" / broken / "player_states.parquet").write_bytes(b"nothing")
    out = tmp_path / "a.html"
    called("scout", store.location, "--team", TEAM, "--replays", 0, "--out", out, "--jobs", 1, code=1)
    found = json.loads(out.with_suffix(".json").read_text())
    assert len(found["matches"]) == 1
    assert broken in found["failed"][0]


def test_what_cannot_be_scouted_is_refused_with_the_reason(folder: Path, tmp_path: Path, matches: list[Match]) -> None:
    store = tc.open_store(folder / "store")
    itself = made_store(tmp_path / "itself", [variant(matches[0], 0, opponent=TEAM)])
    for of, options, text in (
        (store, {"team": "HELIOS_bas"}, "no matches of 'HELIOS_bas'; did you mean HELIOS_base"),
        (store, {"team": TEAM, "opponents": ["Cyrus"]}, "no match of 'HELIOS_base' against 'Cyrus'"),
        (store, {"team": TEAM, "against": "Nobody2D"}, "no matches of 'Nobody2D'"),
        (store, {"team": TEAM, "since": "2030"}, "no match of 'HELIOS_base' since 2030"),
        (itself, {"team": TEAM}, "the team plays against itself"),
    ):
        with pytest.raises(UsageError, match=re.escape(text)):
            tc.scout_team(of, **options)  # type: ignore[arg-type]
