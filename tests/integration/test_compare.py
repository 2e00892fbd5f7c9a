"""The command `compare`, from two stores to its page."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import teamclone as tc
from compared import TEAM, made_store, samples, variant
from teamclone.cli.app import app
from teamclone.comparison import compare
from teamclone.comparison.compare import FORMAT
from teamclone.comparison.profile import STATISTICS
from teamclone.errors import UsageError
from teamclone.evaluation import bootstrap
from teamclone.logs import Match

HOSTILE = "<script>alert(1)</script>$x"
"""A name of an opponent, which is anybody's."""


@pytest.fixture(scope="module", autouse=True)
def quick() -> Iterator[None]:
    """Fewer draws: what they are good for, `tests/unit/comparison` asks."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bootstrap, "N_RESAMPLES", 50)
        patch.setattr(compare, "DRAWS", 40)
        patch.setattr(compare, "HISTOGRAM_RESAMPLES", 10)
        yield


@pytest.fixture(scope="module")
def matches(samples_dir: Path) -> dict[str, Match]:
    found = samples(samples_dir, "WEBase", "YuShan2024")
    return {"WEBase": found[0], "YuShan2024": found[2]}


@pytest.fixture(scope="module")
def folder(matches: dict[str, Match], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An original, a clone that stands three metres beside it, and one as the original is."""
    made = tmp_path_factory.mktemp("compare")
    one, two = matches["WEBase"], matches["YuShan2024"]
    original = [variant(one, i) for i in (0, 2, 4, 6)] + [variant(two, i, opponent=HOSTILE) for i in (0, 2)]
    made_store(made / "original", [*original, variant(two, 5)])
    for name, shift in (("shifted", 3.0), ("alike", 0.0)):
        clone = [variant(one, i, shift=shift) for i in (1, 3)]
        made_store(made / name, [*clone, *(variant(two, i, shift=shift, opponent=HOSTILE) for i in (1, 3))])
    return made


def invoked(*arguments: object, code: int = 0) -> str:
    result = CliRunner().invoke(app, [str(one) for one in arguments], catch_exceptions=False)
    assert result.exit_code == code, result.output
    return result.stdout


@pytest.fixture(scope="module")
def document(folder: Path) -> dict[str, Any]:
    invoked("compare", folder / "original", folder / "shifted", "--team", TEAM, "--out", folder / "out")
    found: dict[str, Any] = json.loads((folder / "out" / "compare.json").read_text())
    return found


def row(document: dict[str, Any], statistic: str, *, group: int = 0) -> dict[str, Any]:
    return next(one for one in document["groups"][group]["statistics"] if one["statistic"] == statistic)


def test_the_document_has_every_statistic_and_group(document: dict[str, Any]) -> None:
    assert document["format"] == FORMAT
    assert [(one["opponent"], one["matches"], one["half"]) for one in document["groups"]] == [
        (None, {"original": 6, "clone": 4}, 3),
        (HOSTILE, {"original": 2, "clone": 2}, None),
        ("WEBase", {"original": 4, "clone": 2}, 2),
    ]
    names = [one.name for one in STATISTICS]
    assert all([one["statistic"] for one in group["statistics"]] == names for group in document["groups"])
    assert len(document["matches"]) == 10
    (left_out,) = document["left_out"]
    assert (left_out["opponent"], left_out["reason"]) == ("YuShan2024", "its opponent is not compared")


def test_a_shift_is_seen_where_it_is(folder: Path, document: dict[str, Any]) -> None:
    alike = tc.compare(tc.open_store(folder / "original"), tc.open_store(folder / "alike"), team=TEAM).document
    for group in (0, 2):
        far, near = (row(one, "positions", group=group) for one in (document, alike))
        assert far["own"] == near["own"]
        assert far["distance"] > near["distance"]
    # What does not look at places across the pitch is the same for both.
    assert row(document, "kicks")["clone"] == row(alike, "kicks")["clone"]
    assert row(document, "speeds")["distance"] == pytest.approx(row(alike, "speeds")["distance"], abs=0.01)


def test_equal_seeds_give_equal_numbers(folder: Path, document: dict[str, Any]) -> None:
    stores = tc.open_store(folder / "original"), tc.open_store(folder / "shifted")
    assert json.loads(json.dumps(tc.compare(*stores, team=TEAM, seed=0).document)) == document


def test_the_page_has_a_picture_a_statistic_and_obeys_no_name(folder: Path, document: dict[str, Any]) -> None:
    page = (folder / "out" / "compare.html").read_text()
    assert "<script" not in page
    assert HOSTILE.replace("<", "&lt;").replace(">", "&gt;") in page
    for one in STATISTICS:
        assert page.count(f'id="of-{one.name}"') == 1
    assert page.count("<svg") == len(STATISTICS) + 3
    assert not re.search(r'(?:href|src)="(?!#|data:)', page)
    ids = re.findall(r'\bid="([^"]+)"', page)
    assert len(ids) == len(set(ids))


def test_one_opponent_as_json(folder: Path, tmp_path: Path) -> None:
    arguments = ("compare", folder / "original", folder / "shifted", "--team", TEAM, "--opponent", "WEBase")
    found = json.loads(invoked(*arguments, "--out", tmp_path, "--json"))
    assert [one["opponent"] for one in found["groups"]] == ["WEBase"]


def test_a_damaged_match_does_not_stop_the_others(folder: Path, matches: dict[str, Match], tmp_path: Path) -> None:
    store = made_store(tmp_path / "store", [variant(matches["WEBase"], i, shift=1.0) for i in (1, 3, 5)])
    broken = store.match_ids()[0]
    (tmp_path / "store" / "matches" / broken / "player_states.parquet").write_bytes(b"nothing")
    arguments = ("compare", folder / "original", tmp_path / "store", "--team", TEAM, "--out", tmp_path / "out")
    invoked(*arguments, code=1)
    found = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert found["groups"][0]["matches"] == {"original": 4, "clone": 2}
    assert broken in found["failed"][0]


def test_what_cannot_be_compared_is_refused_with_the_reason(
    folder: Path, matches: dict[str, Match], tmp_path: Path
) -> None:
    original, shifted = tc.open_store(folder / "original"), tc.open_store(folder / "shifted")
    few = made_store(tmp_path / "few", [variant(matches["WEBase"], i) for i in (1, 3, 5)])
    other = made_store(tmp_path / "other", [variant(matches["WEBase"], 1, opponent="Nobody2D")])
    for stores, options, text in (
        ((original, shifted), {"team": "HELIOS_bas"}, "no matches of 'HELIOS_bas'; did you mean HELIOS_base"),
        ((original, shifted), {"team": TEAM, "opponents": ["Webase"]}, "no opponent 'Webase' is in both stores"),
        ((original, original), {"team": TEAM}, "is in both stores"),
        ((original, other), {"team": TEAM}, "the same opponent in both stores"),
        ((few, shifted), {"team": TEAM}, "at least 4 matches of the original and 2 of the clone, got WEBase: 3 and 2"),
        ((original, shifted), {"team": TEAM, "clone_team": "Clone"}, "no matches of 'Clone'"),
    ):
        with pytest.raises(UsageError, match=re.escape(text)):
            tc.compare(*stores, **options)  # type: ignore[arg-type]
