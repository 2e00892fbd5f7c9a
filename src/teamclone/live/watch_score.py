"""What a team did, as the counters of the next frame show it, and how well it was expected.

The rules are those by which the dataset of the run was cleaned, the sums those of `evaluation.metrics`. So the score of
a match that was watched is that which `evaluate` gives its log.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset.clean import clean_match
from teamclone.dynamics.inverse.columns import recovered_commands
from teamclone.errors import UsageError
from teamclone.evaluation import baselines as rules
from teamclone.evaluation import metrics
from teamclone.evaluation.metrics import Sums
from teamclone.evaluation.predictions import Predictions, issued_parameters
from teamclone.live.watch_frames import Seen
from teamclone.live.watch_predict import Expected
from teamclone.logs.columns import COMMANDS, INTERVALS
from teamclone.logs.match import empty_columns
from teamclone.rcss.commands import kind_places, parameters_of
from teamclone.world.channels import CHANNEL

MOMENTS = 10
"""Most surprising moments that are kept."""
MODEL = "model"
"""Name of the clone among those that are scored."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Done:
    """Commands that became known, n of them in the order of frames and players, beside what was expected.

    Attributes:
        frame: (n,) index of the frame that each acts on. player: (n,) 0..10.
        value: (n, 2) the arguments. interval: (n, 2, 2) ends of their 90 % intervals less the arguments, see `Target`.
        outcome: the same commands as `Predictions`; how likely their parameters were is not computed.
    """

    frame: NDArray[np.int64]
    player: NDArray[np.int64]
    value: NDArray[np.float32]
    interval: NDArray[np.float32]
    outcome: Predictions

    def __len__(self) -> int:
        return len(self.frame)


def done_on(seen: Seen, expected: Expected, first: int, stop: int, *, context: int = 1) -> Done:
    """Return the commands on frames from ``first`` to before ``stop``, where the clone was asked.

    The frame ``stop`` must have been seen: its counters tell. Numbers of commands are recovered from what they did, see
    `dynamics.inverse`.

    Args:
        context: how many frames before ``first`` are looked at, too, at least one: they tell of the team's habits,
            which make some numbers likelier than others.
    """
    begin, subject = max(first - context, 0), expected.subject
    frames, players = seen.window(begin, stop + 1)
    try:
        commands, _ = recovered_commands(frames, players, types=subject.types, params=subject.params)
    except UsageError:  # a player of a type that the server did not describe
        commands = empty_columns((*COMMANDS, *INTERVALS), 0)
    cleaned = clean_match(
        frames,
        players,
        commands,
        subject.params,
        side=subject.side,
        n_types=subject.n_types,
        repertoire=expected.commands,
        **subject.cleaning,
    )
    samples = cleaned.samples
    inside, player = cleaned.kept[samples["frame"]], samples["player"].astype(np.int64)
    frame = begin + inside
    known = (frame >= first) & np.isfinite(expected.probabilities[frame, player, 0])
    frame, player, inside = frame[known], player[known], inside[known]
    kind, arguments = samples["kind"][known].astype(np.int64), samples["parameters"][known]
    interval = samples["interval"][known].astype(np.float32)
    issued = issued_parameters(kind, arguments, np.isfinite(interval).all(axis=2), expected.commands)
    world = subject.view(frames, players)
    me = world.players[inside, player]
    return Done(
        frame=frame,
        player=player,
        value=arguments,
        interval=interval,
        outcome=Predictions(
            probabilities=expected.probabilities[frame, player],
            parameters=expected.parameters[frame, player],
            parameter_log_loss=np.full(len(frame), np.nan, np.float32),
            kind=kind,
            issued=issued,
            last=kind_places(expected.commands)[me[:, CHANNEL["last_command"]].astype(np.int64)],
            match=np.zeros(len(frame), np.int64),
            position=me[:, :2],
            mode=world.mode[inside].astype(np.int64),
            commands=expected.commands,
        ),
    )


class Moment(NamedTuple):
    """A command that the clone did not expect: ``loss`` is -ln of its probability, nats."""

    loss: float
    frame: int
    player: int
    kind: int
    likeliest: int
    probability: float


class Score:
    """The running score of a clone and of the baselines.

    Attributes:
        rows: commands that were scored. sums: of the clone and, where they are known, of the baselines, by name.
    """

    def __init__(self, baselines: rules.Baselines | None) -> None:
        self._baselines = baselines
        self.rows = 0
        self.sums: dict[str, Sums] = {}
        self._moments: list[Moment] = []

    def add(self, done: Done) -> None:
        """Take in commands that became known."""
        if not len(done):
            return
        self.rows += len(done)
        answers = {MODEL: done.outcome}
        if self._baselines is not None:
            answers |= {name: self._baselines.answer(name, done.outcome) for name in rules.NAMES}
        for name, answer in answers.items():
            sums = metrics.measure(answer, edges=np.zeros(0))[1].total()
            self.sums[name] = Sums(*map(np.add, self.sums[name], sums)) if name in self.sums else sums
        losses = metrics.log_loss(done.outcome.probabilities, done.outcome.kind)
        likeliest = done.outcome.probabilities.argmax(axis=1)
        for row in np.argsort(-losses, kind="stable")[:MOMENTS]:
            kind = int(done.outcome.kind[row])
            moment = Moment(
                float(losses[row]),
                int(done.frame[row]),
                int(done.player[row]),
                kind,
                int(likeliest[row]),
                float(done.outcome.probabilities[row, kind]),
            )
            if len(self._moments) < MOMENTS:
                heapq.heappush(self._moments, moment)
            else:
                heapq.heappushpop(self._moments, moment)

    @property
    def moments(self) -> list[Moment]:
        """The most surprising commands so far, the most surprising first."""
        return sorted(self._moments, reverse=True)

    def figures(self) -> dict[str, dict[str, float]]:
        """Return accuracy, cross-entropy and Brier score of the clone and the baselines so far."""
        made = {}
        for name, sums in self.sums.items():
            scores = metrics.scores(sums)
            made[name] = {key: float(getattr(scores, key)) for key in ("accuracy", "cross_entropy", "brier")}
        return made


def parameter_errors(done: Done) -> dict[str, dict[str, Any]]:
    """Return the mean error of each parameter over the commands that carried it, and how many these were."""
    sums = metrics.measure(done.outcome)[1].total()
    means = metrics.ratio(sums.parameter_error, sums.parameter_count)
    return {
        parameter.name: {"rows": int(sums.parameter_count[index]), "mean": float(means[index])}
        for index, parameter in enumerate(parameters_of(done.outcome.commands))
    }


def calibration_error(done: Done) -> float:
    """Return the expected calibration error, see `metrics.Scores`; its bins are cut by all commands together."""
    return float(metrics.scores(metrics.measure(done.outcome)[1].total()).ece)
