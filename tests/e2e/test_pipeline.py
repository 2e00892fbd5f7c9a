"""From the bundled logs to the report through the installed command, as `make demo` does, on a shorter schedule."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from command import called, teamclone

SHORT = ("--set", "train.epochs=3", "--set", "data.batches_per_epoch=30")


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory, samples_dir: Path) -> Path:
    """A folder in which the whole pipeline ran."""
    folder = tmp_path_factory.mktemp("pipeline")
    teamclone("ingest", samples_dir, "--store", folder / "store")
    dataset = ("dataset", "--store", folder / "store", "--team", "HELIOS_base", "--unseen", "YuShan2024")
    report = teamclone(*dataset, "--out", folder / "dataset", "--json")
    (folder / "cleaning.json").write_text(report.stdout)
    teamclone("train", folder / "dataset", "--preset", "small", "--out", folder / "run", *SHORT)
    teamclone("bench", folder / "run", "-n", 200)
    (folder / "evaluation.json").write_text(teamclone("evaluate", folder / "run", "--json").stdout)
    teamclone("report", folder / "run")
    return folder


def read(path: Path) -> Any:
    return json.loads(path.read_text())


def test_the_store_holds_the_six_matches(work: Path) -> None:
    rows = called("sql", "select count(*) n, sum(n_frames) f from matches", "--store", work / "store", "--json")
    assert json.loads(rows.stdout) == [{"n": 6, "f": 14275}]


def test_a_second_ingest_does_nothing(work: Path, samples_dir: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in (work / "store" / "matches").rglob("*")}
    again = json.loads(called("ingest", samples_dir, "--store", work / "store", "--json").stdout)
    assert again["matches"] == {"added": 0, "replaced": 0, "unchanged": 6}
    assert {path: path.stat().st_mtime_ns for path in (work / "store" / "matches").rglob("*")} == before


def test_the_dataset_splits_by_whole_match(work: Path) -> None:
    report = read(work / "cleaning.json")
    assert {match["split"] for match in report["matches"]} == {"train", "validation", "test", "unseen"}
    for match in report["matches"]:
        assert (match["split"] == "unseen") == (match["opponent"] == "YuShan2024")
    by_split: dict[str, int] = {}
    for match in report["matches"]:
        by_split[match["split"]] = by_split.get(match["split"], 0) + sum(match["rows"].values())
    assert by_split == {split: sum(rows.values()) for split, rows in report["rows"].items()}
    assert sum(by_split.values()) == report["rules"][-1]["after"]
    # Counted apart from teamclone, by the rules of docs/reference/commands/dataset.md, on these matches.
    received = next(rule["before"] for rule in report["rules"] if rule["name"] == "executed by the server")
    assert report["rules"][-1]["after"] / received > 0.999


def test_executed_is_what_sql_over_the_counters_says(work: Path) -> None:
    """The same number from the other side: rises of the dash counters of field players between play_on frames."""
    query = """
        with own as (
            select p.match_id, p.frame, p.unum, p.count_dash, p.state, f.playmode
            from player_states p join matches m using (match_id) join frames f using (match_id, frame)
            where (m.left_name = 'HELIOS_base' and p.side = 1) or (m.right_name = 'HELIOS_base' and p.side = -1)
        ), pairs as (
            select *, lead(count_dash) over (partition by match_id, unum order by frame) as next_dash from own
        )
        select count(*) as n from pairs where playmode = 3 and (state & 8) = 0 and next_dash > count_dash
    """
    rows = called("sql", query, "--store", work / "store", "--json").stdout
    counted = json.loads(rows)[0]["n"]
    dashes = sum(rows["dash"] for rows in read(work / "cleaning.json")["rows"].values())
    assert abs(counted - dashes) <= 0.001 * counted


def test_the_clone_is_better_than_always_dashing(work: Path) -> None:
    test = read(work / "evaluation.json")["splits"]["test"]
    majority = test["baselines"]["majority"]
    assert test["model"]["accuracy"]["value"] > majority["accuracy"]["value"] + 0.03
    assert test["model"]["cross_entropy"]["value"] < majority["cross_entropy"]["value"]


def test_the_figures_follow_from_the_confusion_matrix(work: Path) -> None:
    for split in read(work / "evaluation.json")["splits"].values():
        matrix = split["confusion"]
        right = sum(matrix[kind][kind] for kind in range(4))
        assert split["model"]["accuracy"]["value"] == pytest.approx(right / split["rows"])
        for kind, row in enumerate(split["commands"].values()):
            assert row["support"] == sum(matrix[kind])
            assert row["predicted"] == sum(line[kind] for line in matrix)


def test_the_report_shows_the_evaluation(work: Path) -> None:
    page = (work / "run" / "report.html").read_text()
    accuracy = read(work / "evaluation.json")["splits"]["test"]["model"]["accuracy"]["value"]
    assert f"{100 * accuracy:.1f}" in page
    assert not re.search(r"""(?:src|href)=["']https?://""", page)


def test_the_paper_row_split_is_there_for_comparison(work: Path) -> None:
    out = work / "rows"
    options = ("--team", "HELIOS_base", "--unseen", "YuShan2024", "--split", "rows", "--json")
    report = json.loads(called("dataset", "--store", work / "store", "--out", out, *options).stdout)
    rows = {split: sum(kinds.values()) for split, kinds in report["rows"].items()}
    seen = rows["train"] + rows["validation"] + rows["test"]
    # Rounded within each of the six matches.
    assert abs(rows["train"] - 0.95 * seen) <= 3
    assert {match["split"] for match in report["matches"]} == {"rows", "unseen"}


def test_training_goes_on_where_it_stopped(work: Path) -> None:
    assert len((work / "run" / "metrics.jsonl").read_text().splitlines()) == 3
    resumed = called("train", work / "dataset", "--out", work / "run", "--resume", "--set", "train.epochs=4", "--json")
    assert json.loads(resumed.stdout)["epochs"] == 4
