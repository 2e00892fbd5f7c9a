"""How well a clone foresees the commands of a team: where it is sure and right, and what surprised it most."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset.layout import Split
from teamclone.errors import TeamcloneError
from teamclone.evaluation.match_columns import MatchColumns
from teamclone.evaluation.metrics import MOST_LOSS
from teamclone.events.definitions import CONTROL_M
from teamclone.rcss.players import N_TEAM
from teamclone.replay.predictions import DRAWS
from teamclone.scout import figures
from teamclone.scout.findings import Claim, Findings, Picture, Table, claim, claims
from teamclone.scout.measures import Figure, Look, Looks, Measure, Moment, ratio
from teamclone.scout.places import counted
from teamclone.scout.seen import Floats, Ints, Seen, see
from teamclone.scout.subject import Subject
from teamclone.store.of_team import TeamMatch
from teamclone.store.store import Store

if TYPE_CHECKING:
    import pyarrow as pa

    from teamclone.evaluation.prediction_table import PredictionTable
    from teamclone.models.clone import Clone

Texts = NDArray[np.object_]

SURE = 0.95
"""A clone is sure of a command to which it gives at least this probability."""
APART = 50
"""Two surprises are at least so many cycles apart."""
SURPRISES = 10
"""So many are kept of a match."""
SHOWN = 6
"""And so many shown of all."""
PHASES = ("without the ball", "with the ball at nobody", "with the ball")
"""By whose the ball is: ``Seen.has``, plus one."""
LOSS, RIGHT, SURE_RIGHT, COUNT = range(4)
"""Columns of sums over commands: log loss, foreseen, foreseen and sure, all."""
DOES = {
    **{"dash": "dashes", "turn": "turns", "kick": "kicks", "tackle": "tackles", "catch": "catches", "move": "moves"},
    "none": "does nothing",
}

_RIGHT = "of its commands, those to which the clone gives the greatest probability"
_LOSS = "mean of -ln of the probability that the clone gives to what is done"
_AT_BALL = f"within {CONTROL_M:g} m of the ball"
MEASURES = (
    Measure(key="predicted_right", name="commands foreseen", unit="share", about=_RIGHT),
    Measure(key="predicted_right_near", name="foreseen at the ball", unit="share", about=f"{_RIGHT}, {_AT_BALL}"),
    Measure(key="predicted_right_off", name="foreseen off the ball", unit="share", about=f"{_RIGHT}, farther from it"),
    Measure(key="predicted_loss", name="log loss", unit="nats", about=_LOSS),
    Measure(key="predicted_loss_near", name="log loss at the ball", unit="nats", about=f"{_LOSS}, {_AT_BALL}"),
    Measure(
        key="predicted_sure",
        name="sure and right",
        unit="share",
        about=f"of its commands, those to which the clone gives {SURE:.0%} or more",
    ),
)


def look_predicted(model: Clone, store: Store, match: TeamMatch, *, draws: int = 0) -> tuple[Look, PredictionTable]:
    """Return what a clone foresees of the commands of the team in a match, and its predictions; see `predict_match`.

    Raises:
        StoreError: the match cannot be read. DatasetError: its log lacks what the model needs.
    """
    from teamclone.evaluation.prediction_table import predict_match

    columns = MatchColumns.of_store(store, match.match_id)
    table = predict_match(model, columns, side=match.side, draws=draws)
    return look(see(store, match)[0], table.to_arrow()), table


class Foresight:
    """A clone that is held against matches of a team.

    Args:
        run: its run. checkpoint: which of its weights. most: in how many matches it is asked.

    Attributes:
        tables: its predictions, with the draws of a replay, by the match of which moments are shown.

    Raises:
        RunError: there is no such run or checkpoint, or it is of another format.
    """

    def __init__(self, run: Path | str, checkpoint: str, *, most: int) -> None:
        from teamclone.training.run import open_run

        self.run, self.checkpoint, self.most = open_run(run), checkpoint, most
        self.tables: dict[str, PredictionTable] = {}
        self.model = self.run.load_model(checkpoint).eval()

    def tell(
        self,
        store: Store,
        subject: Subject,
        matches: Sequence[TeamMatch],
        *,
        shown: Collection[str],
        on_progress: Callable[[int, int], None],
    ) -> Findings:
        """Return what the clone foresees in some of the matches of a team.

        These are the newest of those that it did not learn from; of those from which it learned if there are no others.

        Args:
            matches: the team's, the oldest first; those that ``subject`` lacks are left out.
            shown: ids of the matches whose moments are shown.
            on_progress: called with the matches done and their number.
        """
        there = {one.match_id for one in subject.played}
        matches = [one for one in matches if one.match_id in there]
        trained = self.run.learned_from(Split.TRAIN, Split.VALIDATION)
        new = [one for one in matches if trained is not None and one.match_id not in trained]
        chosen = (new or matches)[-self.most :]
        looks: list[Look] = []
        notes: list[str] = []
        for done, match in enumerate(chosen, start=1):
            try:
                in_replay = match.match_id in shown
                found, table = look_predicted(self.model, store, match, draws=DRAWS if in_replay else 0)
            except TeamcloneError as error:
                notes.append(f"Not predicted: {error}")
            else:
                looks.append(found)
                if in_replay:
                    self.tables[match.match_id] = table
            on_progress(done, len(chosen))
        if subject.team not in self.run.team.split(" + "):
            notes.append(f"The clone learned from {self.run.team}, so what it foresees of {subject.team} is a guess.")
        if looks:
            one = "match" if len(looks) == 1 else "matches"
            notes.append(f"The clone of {self.run.path.name} was asked in {len(looks)} {one} {_learned(new, trained)}.")
        kept = Looks(looks, MEASURES)
        kept.shown = frozenset(shown)
        return tell_predicted(kept, notes)


def _learned(new: Sequence[TeamMatch], trained: set[str] | None) -> str:
    if trained is None:
        return "of which nobody knows whether it learned from them, as its dataset is gone"
    return "that it did not learn from" if new else "that it learned from, too, so of others it foresees less"


def look(seen: Seen, table: pa.Table) -> Look:
    """Return what a table of predictions says of a match; commands that nobody knows are left out."""
    loss = table["log_loss"].to_numpy().astype(np.float64)
    known = ~np.isnan(loss)
    frame, player = (table[name].to_numpy().astype(np.int64)[known] for name in ("frame", "unum"))
    player -= 1
    done, likeliest = (np.array(table[name].to_pylist(), object)[known] for name in ("done", "likeliest"))
    names = [name for name in table.column_names if name.startswith("p_")]
    greatest = np.max([table[name].to_numpy()[known] for name in names], axis=0)
    loss = np.minimum(loss[known], MOST_LOSS)
    right = done == likeliest
    each = np.stack([loss, right, right & (greatest >= SURE), np.ones(len(loss))], 1).astype(np.float64)
    ball = seen.ball[frame]
    apart = np.linalg.norm(seen.places[frame, player] - ball, axis=1)
    off, at_ball = near = _summed(each, (apart <= CONTROL_M).astype(np.int64), 2)
    both = off + at_ball
    return Look(
        numbers={
            "predicted_right": (both[RIGHT], both[COUNT]),
            "predicted_right_near": (at_ball[RIGHT], at_ball[COUNT]),
            "predicted_right_off": (off[RIGHT], off[COUNT]),
            "predicted_loss": (both[LOSS], both[COUNT]),
            "predicted_loss_near": (at_ball[LOSS], at_ball[COUNT]),
            "predicted_sure": (both[SURE_RIGHT], both[COUNT]),
        },
        arrays={
            "zones": np.stack([counted(ball[:, 0], ball[:, 1], column) for column in each.T], -1),
            "numbers": _summed(each, player, N_TEAM),
            "near": near,
            "phases": _summed(each, seen.has[frame].astype(np.int64) + 1, len(PHASES)),
        },
        moments={"surprise": _surprises(seen, loss, frame, player, np.stack([done, likeliest]))},
    )


def _summed(each: Floats, index: Ints, n: int) -> Floats:
    """Return (n, columns) sums of rows (m, columns) by their index (m,)."""
    found: Floats = np.stack([np.bincount(index, weights=column, minlength=n) for column in each.T], 1)
    return found


def _surprises(seen: Seen, loss: Floats, frame: Ints, player: Ints, said: Texts) -> list[Moment]:
    """Return the commands of greatest log loss, APART cycles or more from each other.

    Args:
        said: (2, n) what was done, and what was likeliest.
    """
    done, likeliest = said
    world = seen.world
    cycles: list[int] = []
    made: list[Moment] = []
    for at in np.argsort(-loss, kind="stable"):
        cycle = int(world.cycle[frame[at]])
        if len(made) == SURPRISES:
            break
        if done[at] == likeliest[at] or any(abs(cycle - other) < APART for other in cycles):
            continue
        cycles.append(cycle)
        unum = int(player[at]) + 1
        made.append(
            Moment(
                match_id=seen.match_id,
                cycle=cycle,
                stoppage=int(world.stoppage[frame[at]]),
                unum=unum,
                text=f"{unum} {DOES[done[at]]}, expected was {likeliest[at]}",
                weight=float(loss[at]),
            )
        )
    return made


def tell_predicted(looks: Looks, notes: Sequence[str] = ()) -> Findings:
    """Return what a clone foresees of a team, and notes on how it was asked."""
    if not len(looks) or not looks.total("near")[:, COUNT].any():
        return Findings(notes=[*notes, "The clone could be held against no command, so it says nothing of this team."])
    zones = looks.total("zones")
    drawn = [
        (words, zones[..., column], zones[..., COUNT])
        for words, column in (("foreseen", RIGHT), ("sure and right", SURE_RIGHT))
    ]
    return Findings(
        claims=claims(
            claim(
                looks,
                "The clone foresees {predicted_right} of its commands; it is sure and right in {predicted_sure}.",
            ),
            claim(
                looks,
                f"At the ball, within {CONTROL_M:g} m, it foresees {{predicted_right_near}}, elsewhere "
                "{predicted_right_off}; its log loss there is {predicted_loss_near}, of all commands {predicted_loss}.",
            ),
            _by_phase(looks),
            _by_number(looks),
            _surprised(looks),
        ),
        pictures=[
            Picture(
                name="predicted",
                draw=lambda: figures.ratios_by_zone(drawn),
                alt="Where the clone foresees its commands, by zone of the ball",
                caption="Commands of all its players by where the ball is: how many the clone foresees, how many "
                "of these it is sure of; below, how many commands there were.",
            )
        ],
        tables=[_table(looks), _surprise_table(looks)],
        notes=notes,
    )


def _foreseen(looks: Looks, name: str, at: int) -> Figure:
    """Return how much is foreseen of one row of an array."""
    rows = looks.each(name)[:, at]
    return ratio(rows[:, RIGHT], rows[:, COUNT])


def _by_phase(looks: Looks) -> Claim | None:
    shares = {"without": _foreseen(looks, "phases", 0), "with": _foreseen(looks, "phases", 2)}
    if any(one.value is None for one in shares.values()):
        return None
    template = "While the team has the ball {with} of its commands are foreseen, while its opponent has it {without}."
    return Claim(template=template, figures=shares, units=dict.fromkeys(shares, "share"))


def _by_number(looks: Looks) -> Claim | None:
    """Say who is foreseen best and least."""
    shares = {unum: _foreseen(looks, "numbers", unum - 1) for unum in range(1, N_TEAM + 1)}
    known = {unum: one.value for unum, one in shares.items() if one.value is not None}
    order = sorted(known, key=lambda unum: known[unum])
    if len(order) < 2:
        return None
    chosen = {"least": shares[order[0]], "most": shares[order[-1]]}
    template = f"Easiest to foresee is {order[-1]} ({{most}}), hardest {order[0]} ({{least}})."
    return Claim(template=template, figures=chosen, units=dict.fromkeys(chosen, "share"))


def _surprised(looks: Looks) -> Claim | None:
    """Show what surprised the clone most."""
    moments = looks.moments("surprise", most=SHOWN)
    return (
        Claim(template=f"Most surprising to the clone: {moments[0].text}, cycle {moments[0].cycle}.", moments=moments)
        if moments
        else None
    )


def _surprise_table(looks: Looks) -> Table:
    found = [one for look in looks.looks for one in look.moments["surprise"]]
    return Table(
        name="surprises",
        caption=f"What surprised the clone most in each match, {APART} cycles or more apart",
        columns=("match", "cycle", "what", "log loss"),
        rows=[(one.match_id, one.cycle, one.text, one.weight) for one in sorted(found, key=lambda one: -one.weight)],
        folded=True,
    )


def _table(looks: Looks) -> Table:
    parts = {
        **dict(zip((f"farther than {CONTROL_M:g} m from the ball", _AT_BALL), looks.total("near"), strict=True)),
        **dict(zip(PHASES, looks.total("phases"), strict=True)),
        **{f"number {at + 1}": sums for at, sums in enumerate(looks.total("numbers"))},
    }
    return Table(
        name="predicted",
        caption="What the clone foresees",
        columns=("", "commands", "foreseen (share)", "sure and right (share)", "log loss"),
        rows=[
            (words, int(sums[COUNT]), *(float(sums[column] / sums[COUNT]) for column in (RIGHT, SURE_RIGHT, LOSS)))
            for words, sums in parts.items()
            if sums[COUNT]
        ],
        folded=True,
    )
