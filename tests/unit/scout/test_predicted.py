"""What a clone foresees of a team: sums by hand, surprises, and what is said when it foresees nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from made_match import PARAMS, MadeMatch
from teamclone.errors import DatasetError
from teamclone.evaluation.metrics import MOST_LOSS
from teamclone.scout import predicted
from teamclone.scout.measures import Look, Looks
from teamclone.scout.predicted import COUNT, LOSS, RIGHT, SURE_RIGHT, look, tell_predicted
from teamclone.scout.seen import Seen

FRAMES = 200
SHOWN = {"d", "e", "bad"}


def seen() -> Seen:
    """The ball in the middle; 7 stands 2 m from it, all others far away."""
    match = MadeMatch(FRAMES)
    match.stand(6, 2.0, 0.0)
    return Seen.of(match.frames, match.players, match.events(), side=1, params=PARAMS, match_id="made")


def table(*rows: tuple[int, int, str | None, float]) -> pa.Table:
    """Predictions: frame, number, what was done, and the probability of a dash; the rest is a turn's."""
    frame, unum, done, dash = (list(column) for column in zip(*rows, strict=True))
    given = [np.nan if what is None else p if what == "dash" else 1 - p for what, p in zip(done, dash, strict=True)]
    with np.errstate(divide="ignore"):
        loss = -np.log(given)
    return pa.table(
        {
            "frame": pa.array(frame, pa.int32()),
            "unum": pa.array(unum, pa.uint8()),
            "p_dash": pa.array(dash, pa.float32()),
            "p_turn": pa.array([1 - one for one in dash], pa.float32()),
            "likeliest": pa.array(["dash" if one >= 0.5 else "turn" for one in dash]).dictionary_encode(),
            "done": pa.array(done).dictionary_encode(),
            "log_loss": pa.array(loss, mask=np.isnan(loss)),
        }
    )


def test_sums_by_hand() -> None:
    made = look(
        seen(),
        table((0, 7, "dash", 0.96), (1, 7, "turn", 0.75), (2, 2, "dash", 0.6), (3, 2, None, 0.9), (4, 2, "turn", 0.01)),
    )
    assert made.numbers["predicted_right"] == (3, 4)
    assert made.numbers["predicted_right_near"] == (1, 2)
    assert made.numbers["predicted_right_off"] == (2, 2)
    assert made.numbers["predicted_sure"] == (2, 4)
    assert made.numbers["predicted_loss"] == (pytest.approx(-np.log([0.96, 0.25, 0.6, 0.99]).sum(), rel=1e-6), 4)
    assert made.numbers["predicted_loss_near"][0] == pytest.approx(-np.log([0.96, 0.25]).sum(), rel=1e-6)
    numbers = made.arrays["numbers"]
    assert numbers[6, [RIGHT, SURE_RIGHT, COUNT]].tolist() == [1, 1, 2]
    assert numbers[1, [RIGHT, SURE_RIGHT, COUNT]].tolist() == [2, 1, 2]
    for name in ("zones", "near", "phases"):
        assert made.arrays[name][..., COUNT].sum() == 4
    assert made.arrays["phases"][1, COUNT] == 4


def test_what_the_clone_holds_for_impossible_does_not_make_means_infinite() -> None:
    made = look(seen(), table((0, 7, "turn", 1.0), (1, 7, "dash", 1.0)))
    assert made.arrays["numbers"][6, LOSS] == MOST_LOSS


def test_surprises_are_apart_and_wrong() -> None:
    rows = [(at, 7, "turn", 0.9 + at * 1e-4) for at in range(0, FRAMES, 10)]
    made = look(seen(), table(*rows, (5, 3, "dash", 0.51), (199, 4, "turn", 0.999)))
    found = made.moments["surprise"]
    cycles = [one.cycle for one in found]
    assert cycles[0] == 299
    assert found[0].text == "4 turns, expected was dash"
    assert len(cycles) == 4
    assert np.diff(sorted(cycles)).min() >= predicted.APART
    assert [one.weight for one in found] == sorted((one.weight for one in found), reverse=True)


def test_it_tells_of_shown_matches_and_lists_all_surprises() -> None:
    one = look(seen(), table(*((at, 2 + at % 10, "dash" if at % 3 else "turn", 0.97) for at in range(FRAMES))))
    looks = Looks([one, one], predicted.MEASURES)
    findings = tell_predicted(looks, ["Asked in 2 matches."])
    assert findings.notes == ["Asked in 2 matches."]
    assert findings.claims[0].text.startswith("The clone foresees 66 %")
    assert findings.claims[-1].text.startswith("Most surprising to the clone: ")
    assert len(findings.claims[-1].moments) == predicted.SHOWN
    surprises = next(table for table in findings.tables if table.name == "surprises")
    assert len(surprises.rows) == 2 * len(one.moments["surprise"])
    for picture in findings.pictures:
        picture.draw()
    looks.shown = frozenset({"another"})
    assert not any("surprising" in claim.text for claim in tell_predicted(looks).claims)


def test_without_a_command_nothing_is_said() -> None:
    for looks in ([], [look(seen(), table((0, 7, None, 0.9)))]):
        findings = tell_predicted(Looks(looks, predicted.MEASURES), ["why"])
        assert not findings.claims
        assert findings.notes[0] == "why"
        assert "no command" in findings.notes[1]


class _Asked:
    """Stands for a store, a run and a subject: only what `Foresight.tell` asks of them."""

    def __init__(self, **values: Any) -> None:
        self.__dict__.update(values)


def foresight(monkeypatch: pytest.MonkeyPatch, trained: set[str] | None, asked: list[str], team: str) -> Any:
    def foresees(model: object, store: object, match: Any, *, draws: int) -> tuple[Look, str]:
        assert bool(draws) == (match.match_id in SHOWN)
        asked.append(match.match_id)
        if match.match_id == "bad":
            raise DatasetError("match bad: its log has no stamina, which the model needs")
        return look(seen(), table((0, 7, "dash", 0.96))), f"predictions of {match.match_id}"

    monkeypatch.setattr(predicted, "look_predicted", foresees)
    run = _Asked(team=team, path=_Asked(name="run"), learned_from=lambda *splits: trained)
    made = object.__new__(predicted.Foresight)
    made.run, made.model, made.most, made.tables = run, None, 2, {}
    return made


@pytest.mark.parametrize(
    ("trained", "asked", "said"),
    [
        ({"b", "d"}, ["c", "e"], "that it did not learn from"),
        ({"a", "b", "c", "d", "e"}, ["d", "e"], "that it learned from, too"),
        (None, ["d", "e"], "nobody knows whether it learned from them"),
    ],
)
def test_which_matches_it_is_asked_in(
    monkeypatch: pytest.MonkeyPatch, trained: set[str] | None, asked: list[str], said: str
) -> None:
    did: list[str] = []
    made = foresight(monkeypatch, trained, did, "Other + Made")
    matches = [_Asked(match_id=name) for name in "abcdef"]
    subject = _Asked(team="Made", played=[_Asked(match_id=name) for name in "abcde"])
    steps: list[tuple[int, int]] = []
    findings = made.tell(None, subject, matches, shown=SHOWN, on_progress=lambda *step: steps.append(step))
    assert did == asked
    assert made.tables == {name: f"predictions of {name}" for name in SHOWN.intersection(asked)}
    assert steps == [(1, 2), (2, 2)]
    assert len(findings.notes) == 1
    assert said in findings.notes[0]


def test_a_clone_of_another_team_and_a_bad_match_are_noted(monkeypatch: pytest.MonkeyPatch) -> None:
    made = foresight(monkeypatch, set(), [], "Another")
    matches = [_Asked(match_id=name) for name in ("good", "bad")]
    subject = _Asked(team="Made", played=matches)
    findings = made.tell(None, subject, matches, shown=SHOWN, on_progress=lambda done, total: None)
    assert findings.claims
    assert not made.tables
    assert "its log has no stamina" in findings.notes[0]
    assert findings.notes[1] == "The clone learned from Another, so what it foresees of Made is a guess."
