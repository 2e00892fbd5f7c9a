"""From a run to its evaluation, its response times and its report."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pytest
import torch
from PIL import Image
from tests.synthetic import make_dataset
from typer.testing import CliRunner

from teamclone.cli.app import app
from teamclone.dataset.layout import Split
from teamclone.dataset.reader import open_dataset
from teamclone.errors import DatasetError, RunError
from teamclone.evaluation import latency, metrics
from teamclone.evaluation.evaluate import evaluate, load_evaluation
from teamclone.evaluation.predict import predict
from teamclone.models.clone import model_id
from teamclone.rcss.commands import CLONED_KINDS
from teamclone.report.page import make_report, number, pages_of, percent
from teamclone.training.checkpoint import save_weights
from teamclone.training.config import load_config
from teamclone.training.loop import train
from teamclone.training.run import Run, open_run

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SECTIONS = (
    "summary",
    "results",
    "commands",
    "parameters",
    "baselines",
    "calibration",
    "opponents",
    "training",
    "data",
    "response-times",
    "matches",
    "reproduce",
)


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small run on a made dataset of four matches, one a split."""
    folder = tmp_path_factory.mktemp("evaluation")
    make_dataset(folder / "ds", frames_per_match=120)
    settings = [
        "model.hidden=[24]",
        "data.batch_size=128",
        "data.batches_per_epoch=9",
        "data.validation_batches=4",
        "train.epochs=3",
        "train.threads=1",
        "train.precision=fp32",
        "train.device=cpu",
    ]
    train(load_config("small", settings), open_dataset(folder / "ds"), folder / "run")
    return folder / "run"


@pytest.fixture
def run(trained: Path, tmp_path: Path) -> Run:
    """A copy that a test may change."""
    shutil.copytree(trained, tmp_path / "run")
    return open_run(tmp_path / "run")


@pytest.fixture(scope="module")
def written(trained: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run with its report."""
    folder = tmp_path_factory.mktemp("report") / "run"
    shutil.copytree(trained, folder)
    make_report(open_run(folder), quick_predictions=60)
    return folder


class Page(HTMLParser):
    """What a page shows, what it names and what it would load."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.text: list[str] = []
        self.ids: list[str] = []
        self.loads: list[str] = []
        self.svgs = 0
        self.unlabelled = 0
        self._hidden = 0
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        if "id" in values:
            self.ids.append(str(values["id"]))
        if tag == "svg":
            self.svgs += 1
            self.unlabelled += not values.get("aria-label")
        self.loads += [
            str(values[key])
            for key in ("src", "href", "xlink:href", "data", "poster", "srcset", "action")
            if values.get(key) and not str(values[key]).startswith(("#", "data:"))
        ]
        self._hidden += tag in {"style", "script"}

    def handle_endtag(self, tag: str) -> None:
        self._hidden -= tag in {"style", "script"}

    def handle_data(self, data: str) -> None:
        if not self._hidden:
            self.text.append(data)


def page(folder: Path) -> Page:
    return Page((folder / "report.html").read_text(encoding="utf-8"))


def test_predictions_stand_beside_what_happened(trained: Path) -> None:
    run = open_run(trained)
    dataset, model = open_dataset(run.dataset_path), run.load_model()
    rows = dataset.split(Split.TEST)
    outcome = predict(model, dataset, rows, batch=100)
    with torch.inference_mode():
        probabilities, parameters = model.predict(dataset.state(rows))
    np.testing.assert_allclose(outcome.probabilities, probabilities.numpy(), atol=1e-5)
    np.testing.assert_allclose(outcome.parameters, parameters.numpy(), atol=1e-2)
    target = dataset.target(rows)
    np.testing.assert_array_equal(outcome.kind, target.kind.numpy())
    # A dash carries two parameters, a turn one, a kick two, a tackle one, each in its own column.
    np.testing.assert_array_equal(np.isfinite(outcome.issued).sum(1), np.array([2, 1, 2, 1])[outcome.kind])
    kicks = outcome.kind == 2
    np.testing.assert_array_equal(outcome.issued[kicks][:, 3:5], target.parameters.numpy()[kicks])
    frames, players = dataset.samples["frame"].numpy()[rows], dataset.samples["player"].numpy()[rows]
    np.testing.assert_array_equal(outcome.position, dataset.frames["position"].numpy()[frames, players])


def test_evaluation_counts_every_row_of_every_split(trained: Path) -> None:
    run = open_run(trained)
    dataset = open_dataset(run.dataset_path)
    seen = []
    evaluation = evaluate(run, on_progress=lambda done, total: seen.append((done, total)))
    assert list(evaluation["splits"]) == ["test", "unseen", "validation"]
    for name, section in evaluation["splits"].items():
        rows = dataset.split(Split[name.upper()])
        assert section["rows"] == len(rows) == np.sum(section["confusion"])
        outcome = predict(run.load_model(), dataset, rows)
        hits = (outcome.probabilities.argmax(1) == outcome.kind).mean()
        assert section["model"]["accuracy"]["value"] == pytest.approx(hits)
        assert section["model"]["cross_entropy"]["value"] == pytest.approx(
            metrics.log_loss(outcome.probabilities, outcome.kind).mean()
        )
    data = evaluation["data"]
    assert data["rows"] == len(dataset) == sum(sum(row.values()) for row in data["commands_by_split"].values())
    assert sum(data["turn_moments"]["counts"]) == data["turns"]
    assert seen[-1][0] == seen[-1][1]
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)


def test_baselines_know_only_training_rows(trained: Path) -> None:
    run = open_run(trained)
    dataset = open_dataset(run.dataset_path)
    counts = np.bincount(dataset.samples["kind"].numpy()[dataset.split(Split.TRAIN)], minlength=4) + 1
    section = evaluate(run)["splits"]["test"]
    given = np.array([section["commands"][kind.name.lower()]["support"] for kind in CLONED_KINDS])
    expected = -(given @ np.log(counts / counts.sum())) / given.sum()
    assert section["baselines"]["majority"]["cross_entropy"]["value"] == pytest.approx(expected, rel=1e-5)
    assert section["baselines"]["majority"]["accuracy"]["value"] == pytest.approx(given[counts.argmax()] / given.sum())


def test_report_has_every_section_and_figure(written: Path) -> None:
    made = page(written)
    assert [name for name in made.ids if name in SECTIONS] == list(SECTIONS)
    assert len(made.ids) == len(set(made.ids))
    assert made.svgs == 8
    assert made.unlabelled == 0
    html = (written / "report.html").read_text(encoding="utf-8")
    for figure in (4, 5, 6, 7, 8, 9):
        assert f"Fig. {figure} of the paper" in html
    assert "Table IV" in html


def test_report_loads_nothing(written: Path) -> None:
    assert page(written).loads == []
    html = (written / "report.html").read_text(encoding="utf-8")
    assert not re.search(r"url\((?!#|['\"]?data:)|@import|fetch\(|XMLHttpRequest|import\(", html)
    # The names of SVG's own namespaces are the only addresses.
    assert set(re.findall(r"https?://[^\s\"'<>]+", html)) <= {
        "http://www.w3.org/2000/svg",
        "http://www.w3.org/1999/xlink",
    }


def test_report_shows_the_numbers_of_the_evaluation(written: Path) -> None:
    evaluation = load_evaluation(written / "evaluation.json")
    bench = latency.load_bench(written / "bench.json")
    text = " ".join("".join(page(written).text).split())
    text = text.replace("\N{NO-BREAK SPACE}", " ")

    def shown(value: str) -> None:
        assert " ".join(value.split()) in text, value

    for section in evaluation["splits"].values():
        shown(percent(section["model"]["accuracy"]["value"]))
        for name in ("cross_entropy", "brier", "macro_f1", "paper_mae"):
            shown(number(section["model"][name]["value"]))
    test = evaluation["splits"]["test"]
    for row in test["confusion"]:
        for cell in row:
            shown(f"{cell:,}")
    for row in test["commands"].values():
        for field in ("precision", "recall"):
            shown(percent(row[field]["value"]))
        for field in ("share", "paper_recall", "paper_specificity"):
            shown(percent(row[field]["value"], 2))
    for row in test["parameters"].values():
        shown(number(row["mean"]["value"], 1))
        shown(number(row["median"], 1))
        shown(number(row["constant"]["mean"], 1))
    for row in test["baselines"].values():
        shown(percent(row["accuracy"]["value"]))
        shown(number(row["cross_entropy"]["value"]))
    shown(f"{number(bench['single']['mean_us'] / 1000)} ms")
    shown(f"{evaluation['data']['rows']:,} commands of Made")
    for match in evaluation["dataset"]["matches"]:
        shown(match["match_id"])
    # The paper's, published and corrected.
    for value in (percent(0.845), percent(0.8455, 2), "0.353", percent(0.0621, 2), percent(0.7634, 2)):
        shown(value)


def test_report_keeps_what_is_fresh_and_renews_what_is_stale(run: Run) -> None:
    make_report(run, quick_predictions=20)
    first, bench = load_evaluation(run.path / "evaluation.json"), latency.load_bench(run.path / "bench.json")
    marked = first | {"created": "2001-02-03T00:00:00+00:00"}
    (run.path / "evaluation.json").write_text(json.dumps(marked), encoding="utf-8")
    make_report(run, quick_predictions=20)
    assert load_evaluation(run.path / "evaluation.json")["created"].startswith("2001")
    assert latency.load_bench(run.path / "bench.json")["created"] == bench["created"]
    assert "2001-02-03" in (run.path / "report.html").read_text(encoding="utf-8")

    other = run.load_model()
    with torch.no_grad():
        other.head.command.bias.add_(0.5)
    save_weights(run.checkpoint_path("best-loss"), other, epoch=3)
    make_report(run, quick_predictions=20)
    renewed = load_evaluation(run.path / "evaluation.json")
    assert not renewed["created"].startswith("2001")
    assert renewed["run"]["model_id"] == model_id(other) != first["run"]["model_id"]

    (run.path / "evaluation.json").write_text("{ damaged", encoding="utf-8")
    assert make_report(run, out=run.path / "elsewhere.html").is_file()
    assert load_evaluation(run.path / "evaluation.json")["run"]["model_id"] == model_id(other)


def test_it_links_to_the_pages_beside_the_run(run: Run, tmp_path: Path) -> None:
    assert pages_of(run, run.path, "replay") == []
    for name in ("replay.html", "replay <b>.html", "other.html"):
        (run.path / name).write_text("", encoding="utf-8")
    assert ("replay.html", "./replay.html") in pages_of(run, run.path, "replay")
    elsewhere = make_report(run, out=tmp_path / "pages" / "x.html", quick_predictions=0)
    links = re.findall(r'<a href="([^"]*)">(replay[^<]*)</a>', elsewhere.read_text(encoding="utf-8"))
    assert [name for _, name in links] == ["replay &lt;b&gt;.html", "replay.html"]
    for address, _ in links:
        assert (elsewhere.parent / unquote(address)).is_file()
    assert "scout.html</a>" not in elsewhere.read_text(encoding="utf-8")
    (run.path / "scout.html").write_text("", encoding="utf-8")
    beside = make_report(run, quick_predictions=0)
    assert '<a href="./scout.html">scout.html</a>' in beside.read_text(encoding="utf-8")


def test_command_line(run: Run, tmp_path: Path) -> None:
    runner = CliRunner()
    done = runner.invoke(app, ["evaluate", str(run.path)], catch_exceptions=False)
    assert done.exit_code == 0
    saved = json.loads((run.path / "evaluation.json").read_text(encoding="utf-8"))
    assert f"{saved['splits']['test']['model']['accuracy']['value']:.3f}" in done.stdout
    assert f"{saved['splits']['unseen']['baselines']['markov']['cross_entropy']['value']:.3f}" in done.stdout
    assert "persistence" in done.stdout
    assert "dash direction" in done.stdout

    done = runner.invoke(app, ["evaluate", str(run.path), "--json", "--checkpoint", "last"], catch_exceptions=False)
    printed = json.loads(done.stdout)
    assert printed == json.loads((run.path / "evaluation.json").read_text(encoding="utf-8"))
    assert printed["run"]["checkpoint"] == "last"

    done = runner.invoke(app, ["bench", str(run.path), "-n", "40", "--json"], catch_exceptions=False)
    assert json.loads(done.stdout)["single"]["n"] == 40
    done = runner.invoke(app, ["report", str(run.path), "--out", str(tmp_path / "x.html")], catch_exceptions=False)
    assert done.stdout.strip() == str(tmp_path / "x.html")
    assert load_evaluation(run.path / "evaluation.json")["run"]["checkpoint"] == "last"


def test_another_dataset_is_evaluated_whole_and_kept_apart(run: Run, tmp_path: Path) -> None:
    make_dataset(tmp_path / "other", frames_per_match=30, seed=5)
    CliRunner().invoke(app, ["evaluate", str(run.path), "--data", str(tmp_path / "other")], catch_exceptions=False)
    assert not (run.path / "evaluation.json").exists()
    evaluation = load_evaluation(run.path / "evaluation-other.json")
    assert sorted(evaluation["splits"]) == ["test", "train", "unseen", "validation"]
    assert evaluation["dataset"]["own"] is False
    # The made datasets share their match ids: the one that was trained on is named.
    assert evaluation["dataset"]["trained_on_before"] == [f"{0:016x}"]


def test_a_run_whose_dataset_is_gone_can_be_evaluated_on_another(run: Run, tmp_path: Path) -> None:
    environment = run.path / "environment.json"
    text = environment.read_text(encoding="utf-8")
    environment.write_text(text.replace(str(run.dataset_path), str(tmp_path / "gone")), encoding="utf-8")
    moved = open_run(run.path)
    with pytest.raises(DatasetError, match="--data"):
        evaluate(moved)
    other = make_dataset(tmp_path / "other", frames_per_match=30, seed=5)
    assert evaluate(moved, dataset=other)["dataset"]["baselines_counted_on"] == str(other.resolve())


def test_mistakes_are_told_in_one_line(run: Run, tmp_path: Path) -> None:
    with pytest.raises(RunError, match="best-loss"):
        evaluate(run, checkpoint="bestloss")
    for text, what in (("[]", "not an evaluation"), ('{"format": 99}', "format 99"), ("{", "not an evaluation")):
        (tmp_path / "evaluation.json").write_text(text, encoding="utf-8")
        with pytest.raises(RunError, match=what):
            load_evaluation(tmp_path / "evaluation.json")
    with pytest.raises(RunError, match="teamclone bench"):
        latency.load_bench(tmp_path / "bench.json")


def test_response_times_add_up(trained: Path) -> None:
    run = open_run(trained)
    threads = torch.get_num_threads()
    bench = latency.measure_latency(run.load_model(), open_dataset(run.dataset_path), n=300)
    assert torch.get_num_threads() == threads
    single = bench["single"]
    assert 0 < single["p50_us"] <= single["p99_us"] <= single["max_us"]
    assert sum(bench["histogram"]["counts"]) + bench["histogram"]["slower"] == single["n"] == 300
    assert bench["team"]["states_per_second"] == pytest.approx(22e6 / bench["team"]["mean_us"])


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine")
@pytest.mark.parametrize(("scheme", "width"), [("light", 1200), ("dark", 1200), ("light", 520)])
def test_report_in_a_browser(written: Path, tmp_path: Path, scheme: str, width: int) -> None:
    """It is drawn in both themes, its script runs, and nothing sticks out at the side."""
    html = (written / "report.html").read_text(encoding="utf-8")
    probe = """<script>
    const root = document.documentElement;
    root.dataset.overflow = Math.max(0, root.scrollWidth - root.clientWidth);
    root.dataset.here = document.querySelector("nav a.here").hash;
    root.dataset.loads = performance.getEntriesByType("resource").length;
    </script>"""
    (tmp_path / "page.html").write_text(html.replace("</body>", probe + "</body>"), encoding="utf-8")
    command = [
        str(CHROMIUM),
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        "--disable-background-networking",
        "--disable-sync",
        f"--user-data-dir={tmp_path / 'profile'}",
        f"--blink-settings=preferredColorScheme={1 if scheme == 'light' else 0}",
        f"--window-size={width},900",
    ]
    address = (tmp_path / "page.html").as_uri()
    dom = subprocess.run(
        [*command, "--dump-dom", address], capture_output=True, text=True, timeout=60, check=True
    ).stdout
    assert 'data-overflow="0"' in dom
    assert 'data-here="#summary"' in dom
    assert 'data-loads="0"' in dom
    shot = tmp_path / "page.png"
    subprocess.run([*command, f"--screenshot={shot}", address], capture_output=True, timeout=60, check=True)
    pixels = np.asarray(Image.open(shot).convert("RGB")).astype(int)
    paper = {"light": (255, 255, 255), "dark": (19, 22, 26)}[scheme]
    assert tuple(pixels[5, 5]) == paper
    ink = np.abs(pixels - paper).sum(axis=2)
    assert ink.max() > 400, "text stands out from the paper"


def test_distributions_are_judged_by_their_likelihood(tmp_path: Path) -> None:
    data = open_dataset(make_dataset(tmp_path / "ds", frames_per_match=40))
    widths = ("hidden", "target_hidden", "parameter_hidden", "kick_hidden")
    small = [*(f"model.{name}=[16]" for name in widths), "train.epochs=1"]
    machine = ["train.threads=1", "train.device=cpu", "train.precision=fp32"]
    run = train(load_config("best", [*small, *machine, "data.batch_size=100"]), data, tmp_path / "run")
    html = make_report(run, quick_predictions=0).read_text()
    section = load_evaluation(run.path / "evaluation.json")["splits"]["test"]
    rows, model = data.split(Split.TEST), run.load_model()
    with torch.no_grad():
        likelihood = model.answer(data.state(rows)).log_likelihood(data.target(rows)).numpy()
    for kind, name in enumerate(kind.name.lower() for kind in CLONED_KINDS):
        loss = section["commands"][name]["parameter_log_loss"]["value"]
        assert loss == pytest.approx(-likelihood[data.target(rows).kind.numpy() == kind].mean(), rel=1e-4)
        assert f"<td>{number(loss, 2)}</td>" in html
    assert "<h3>Distributions</h3>" in html
    assert "negative log-likelihood, nats" in html
    assert "zero is expected of its parameters" not in html
    printed = CliRunner().invoke(app, ["evaluate", str(run.path)], catch_exceptions=False).stdout
    assert "log loss of its parameters, nats" in printed


def test_points_have_no_likelihood(written: Path) -> None:
    splits = load_evaluation(written / "evaluation.json")["splits"]
    nothing = {"value": None, "low": None, "high": None}
    assert all(row["parameter_log_loss"] == nothing for split in splits.values() for row in split["commands"].values())
    assert "Distributions" not in (written / "report.html").read_text()


def test_a_clone_of_several_teams(tmp_path: Path) -> None:
    """Entries 1 and 2 are one match, seen from both teams."""
    splits = np.repeat([Split.TRAIN, Split.TEST, Split.TEST, Split.VALIDATION], 20 * 10)
    document = make_dataset(tmp_path / "ds", frames_per_match=20, **{"samples/split": splits}) / "dataset.json"
    meta = json.loads(document.read_text())
    ids, teams = ("m0", "m1", "m1", "m2"), ("Red", "Red", "Blue", "Blue")
    for entry, match_id, team in zip(meta["matches"], ids, teams, strict=True):
        entry |= {"match_id": match_id, "team": team, "opponent": "Blue" if team == "Red" else "Red"}
    meta |= {"team": "Red + Blue", "teams": ["Red", "Blue"]}
    document.write_text(json.dumps(meta))
    config = load_config("small", ["model.hidden=[8]", "train.epochs=1", "train.threads=1", "train.device=cpu"])
    run = train(config, open_dataset(tmp_path / "ds"), tmp_path / "run")
    html = make_report(run, quick_predictions=0).read_text()
    evaluation = load_evaluation(run.path / "evaluation.json")
    test = evaluation["splits"]["test"]
    assert [(row["match_id"], row["rows"]) for row in test["matches"]] == [("m1", 400)]
    assert test["model"]["accuracy"]["low"] is None
    assert [(row["opponent"], row["matches"], row["rows"]) for row in test["opponents"]] in (
        [("Red", 1, 200), ("Blue", 1, 200)],
        [("Blue", 1, 200), ("Red", 1, 200)],
    )
    assert evaluation["data"]["matches"] == 3
    assert "In one match it never saw, the clone names the next command of a Red + Blue player" in html
    assert "--team Red --team Blue" in html
    assert '<th class="text">team</th>' in html
    other = open_dataset(make_dataset(tmp_path / "other", frames_per_match=10))
    document = other.path / "dataset.json"
    renamed = [entry | {"match_id": "m0"} for entry in json.loads(document.read_text())["matches"]]
    document.write_text(json.dumps(other.meta | {"matches": renamed}))
    assert evaluate(run, dataset=other.path)["dataset"]["trained_on_before"] == ["m0"]
