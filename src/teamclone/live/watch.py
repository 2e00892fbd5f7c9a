"""``watch``: a clone beside a match that is being played, as a monitor of its server."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from threading import Event
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset.reader import Dataset, open_dataset
from teamclone.engine.clone import CompiledClone
from teamclone.errors import DatasetError, LiveError, UsageError, choose
from teamclone.evaluation import metrics
from teamclone.evaluation.evaluate import count_training
from teamclone.live.asking import load_kernels
from teamclone.live.watch_frames import Seen
from teamclone.live.watch_predict import Expected, Subject
from teamclone.live.watch_save import RcgWriter
from teamclone.live.watch_score import Done, Moment, Score, calibration_error, done_on, parameter_errors
from teamclone.models.packing import pack
from teamclone.protocol import monitor
from teamclone.protocol.monitor import Show
from teamclone.protocol.monitor_stream import Frame, Message, MonitorStream
from teamclone.protocol.udp import LOOPBACK
from teamclone.rcss.commands import CommandKind, parameters_of

if TYPE_CHECKING:
    from teamclone.training.run import Run

LIMIT_MS = 5.0
"""A prediction is late that takes longer: a player has decided by then."""
_POLL_S = 0.25
"""Seconds between two looks at the clock while nothing comes."""
_AT_ONCE = 50
"""Most frames that wait for their score while a server plays faster than we look."""
_CONTEXT = 20
"""Frames before those that are looked at, which tell of a team's habits."""

_WITH_BALL = (CommandKind.KICK, CommandKind.TACKLE)
"""Commands that are answered only where the ball may be reached."""

Happening = dict[str, Any]
"""What happened, JSON types only: ``event`` names it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WatchConfig:
    """What to watch.

    Attributes:
        host, port: of the server. A host other than this machine is another's word for what happens in the match.
        team, side: which team, by name or as ``left`` or ``right``; None for the team of the run.
        save: where to keep a game log of what was seen; None for nowhere.
        wait_s: how long to wait for a server that does not answer; None for ever. silence_s: how long for the next
            cycle, before the match counts as broken off.
        score_every: after how many frames a score is told.
    """

    host: str = LOOPBACK
    port: int = 6000
    team: str | None = None
    side: str | None = None
    save: Path | None = None
    wait_s: float | None = None
    silence_s: float = 30.0
    score_every: int = 100


def watch(
    run: Run,
    config: WatchConfig,
    *,
    checkpoint: str = "best-loss",
    on_event: Callable[[Happening], None],
    stop: Event | None = None,
) -> Happening:
    """Watch a match to its end, or until it is told to stop.

    Events are ``ready`` (the server is asked now), ``start`` (whom we watch), for each cycle ``prediction`` and, when
    the next one has come, ``done``, now and then ``score``, and ``end``, which is returned, too.

    Args:
        stop: set by whoever wants the watch to end after the cycle at hand, with all that is known. An interrupt ends
            it at once.

    Raises:
        LiveError: no server answers, it lets us not in, or the team does not play.
        RunError: the run or checkpoint cannot be read.
        UsageError: both a team and a side are named, or no such side.
    """
    if config.team is not None and config.side is not None:
        raise UsageError("name a team or a side, not both")
    if config.side not in (None, "left", "right"):
        raise UsageError(f"expected the side left or right, got {config.side!r}")
    watcher = _Watcher(run, config, checkpoint, on_event)
    stream = MonitorStream(config.port, host=config.host)
    try:
        return watcher.follow(stream, stop or Event())
    finally:
        stream.close()
        watcher.close()


class _Watcher:
    """What is known of the match so far."""

    def __init__(self, run: Run, config: WatchConfig, checkpoint: str, on_event: Callable[[Happening], None]) -> None:
        self._config, self._tell = config, on_event
        model = run.load_model(checkpoint).eval()
        model.need_log_view("a match that is watched")
        self._clone = CompiledClone(pack(model))
        self._parameters = parameters_of(self._clone.commands)
        self._reads: dict[str, Any] = {"history": model.inputs.history, "channels": model.inputs.channels}
        data = _dataset_of(run)
        options = {} if data is None else data.meta.get("options") or {}
        self._reads["cleaning"] = {"turn_zero": options.get("turn_zero", "keep")}
        self._teams = [run.team] if data is None else list(data.meta.get("teams", [data.meta["team"]]))
        self._score = Score(None if data is None else count_training(data))
        self._seen = Seen()
        self._expected: Expected | None = None
        self._scored = self._told = 0
        self._times_ms: list[float] = []
        self._writer: RcgWriter | None = None
        self._last: Show | None = None
        monitor.load_reader()
        load_kernels(self._clone, history=model.inputs.history)
        self._tell({"event": "ready", "teams": self._teams, "baselines": data is not None})

    def follow(self, stream: MonitorStream, stop: Event) -> Happening:
        """Take in all that comes until the match ends.

        Raises:
            KeyboardInterrupt: it was told to stop before anything came.
        """
        heard_at = time.monotonic()
        ended: str | None = None
        while ended is None:
            got = stream.next(_POLL_S)
            now = time.monotonic()
            if got is None:
                ended = self._silent(now - heard_at)
            elif isinstance(got, Message):
                if self._writer is not None:
                    self._writer.message(got.text)
            else:
                heard_at = now
                self._take(got, stream)
                ended = "time_over" if got.show.over else None
            if ended is None and stop.is_set():
                if self._last is None:
                    raise KeyboardInterrupt
                ended = "interrupted"
            waiting = len(self._seen) - 1 - self._scored
            if waiting > 0 and (stream.behind == 0 or waiting >= _AT_ONCE or ended):
                self._look_back()
        return self._end(ended, stream)

    def close(self) -> None:
        """Give the log that was saved its name."""
        if self._writer is not None:
            self._writer.close()

    def _silent(self, silent_s: float) -> str | None:
        """Return how the watch ends where nothing comes; None where it goes on.

        Raises:
            LiveError: no server ever answered.
        """
        config = self._config
        if self._last is not None:
            return "silence" if silent_s > config.silence_s else None
        if config.wait_s is not None and silent_s > config.wait_s:
            raise LiveError(
                f"{config.host} port {config.port}: no server showed a match within {config.wait_s:g} s; start it, or "
                "name its place with --host and --port"
            )
        return None

    def _take(self, frame: Frame, stream: MonitorStream) -> None:
        """Take in a cycle, and predict it."""
        self._last = frame.show
        if not self._seen.add(frame):
            return
        if self._config.save is not None and self._writer is None:
            self._writer = RcgWriter(self._config.save, stream.parameters, version=stream.version)
        if self._expected is None:
            self._begin(frame.show, stream)
        if self._expected is not None:
            actor = self._expected.predict(self._seen)
            took_ms = (time.time_ns() - frame.at) / 1e6
            if len(actor):
                self._times_ms.append(took_ms)
                self._tell(self._prediction(actor, took_ms))
        if self._writer is not None:
            self._writer.frame(frame)

    def _begin(self, show: Show, stream: MonitorStream) -> None:
        """Find the team, once it is there.

        Raises:
            LiveError: both sides are taken by others.
        """
        names, config = show.names, self._config
        wanted = self._teams if config.team is None else [config.team]
        side = {"left": 1, "right": -1}.get(config.side or "")
        if side is None:
            side = next((place for name, place in zip(names, (1, -1), strict=True) if name in wanted), None)
        if side is None:
            if None not in names:
                playing = [str(name) for name in names]
                raise LiveError(
                    f"{' or '.join(wanted)} does not play; {choose(wanted[0], playing)}, with --team, or name a --side"
                )
            return
        self._expected = Expected(self._clone, Subject.of(stream.parameters, side=side, **self._reads))
        self._scored = len(self._seen) - 1
        self._tell(
            {
                "event": "start",
                "left": names[0],
                "right": names[1],
                "side": "left" if side > 0 else "right",
                "cycle": show.cycle,
                "receive_buffer_bytes": stream.buffer_bytes,
            }
        )

    def _look_back(self) -> None:
        """Score the frames whose successor has come."""
        first, stop = self._scored, len(self._seen) - 1
        self._scored = stop
        if self._expected is None:
            return
        done = done_on(self._seen, self._expected, first, stop, context=_CONTEXT)
        self._score.add(done)
        for event in self._done(done):
            self._tell(event)
        if stop // self._config.score_every > self._told:
            self._told = stop // self._config.score_every
            self._tell({"event": "score", **self._figures()})

    def _end(self, ended: str, stream: MonitorStream) -> Happening:
        """Return the last event: the score, and of the whole match the errors of parameters."""
        counts = asdict(self._seen.counts)
        event: Happening = {"event": "end", "ended": ended, **self._figures()}
        if self._expected is not None and self._scored > 0:
            whole = done_on(self._seen, self._expected, 0, self._scored)
            event["parameters"] = parameter_errors(whole)
            event["calibration_error"] = calibration_error(whole)
            event["lacking"] = self._expected.lacking
        event["datagrams"] = {**counts, "dropped": stream.dropped}
        event["saved"] = None if self._writer is None else str(self._config.save)
        self._tell(event)
        return event

    def _figures(self) -> Happening:
        show = self._last
        return {
            "cycle": None if show is None else show.cycle,
            "goals": None if show is None else list(show.scores),
            "rows": self._score.rows,
            "scores": self._score.figures(),
            "moments": [self._moment(moment) for moment in self._score.moments],
            "latency": self._latency(),
        }

    def _latency(self) -> Happening:
        times = np.array(self._times_ms)
        if not len(times):
            return {"n": 0}
        return {
            "n": len(times),
            "p50_ms": float(np.quantile(times, 0.5)),
            "p99_ms": float(np.quantile(times, 0.99)),
            "max_ms": float(times.max()),
            "late": int((times > LIMIT_MS).sum()),
        }

    def _place(self, index: int) -> Happening:
        cycle, stoppage = self._seen.cycle(index)
        return {"cycle": cycle, "stoppage": stoppage}

    def _prediction(self, actor: NDArray[np.int64], took_ms: float) -> Happening:
        """Return what is expected of the players ``actor`` in the newest frame."""
        now, expected = len(self._seen) - 1, self._expected
        assert expected is not None
        players = []
        for player in actor.tolist():
            probabilities = expected.probabilities[now, player]
            likeliest = self._clone.commands[int(probabilities.argmax())]
            near = bool(expected.near[now, player])
            players.append(
                {
                    "unum": player + 1,
                    "likeliest": likeliest,
                    "probabilities": dict(zip(self._clone.commands, probabilities.tolist(), strict=True)),
                    "parameters": {
                        parameter.name: value
                        for parameter, value in zip(
                            self._parameters, expected.parameters[now, player].tolist(), strict=True
                        )
                        if near or parameter.kind not in _WITH_BALL
                    },
                }
            )
        return {"event": "prediction", **self._place(now), "ms": took_ms, "players": players}

    def _done(self, done: Done) -> Iterator[Happening]:
        """Yield what was done in each frame."""
        losses = metrics.log_loss(done.outcome.probabilities, done.outcome.kind).tolist()
        rows: dict[int, list[Happening]] = {}
        for row, frame in enumerate(done.frame.tolist()):
            kind = int(done.outcome.kind[row])
            command = self._clone.commands[kind]
            numbers = {}
            for parameter in self._parameters:
                low, high = done.interval[row, parameter.argument].tolist()
                if parameter.kind.name.lower() == command and np.isfinite(low):
                    value = float(done.value[row, parameter.argument])
                    numbers[parameter.name] = {"value": value, "low": value + low, "high": value + high}
            rows.setdefault(frame, []).append(
                {"unum": int(done.player[row]) + 1, "command": command, "parameters": numbers, "log_loss": losses[row]}
            )
        for frame, players in rows.items():
            yield {"event": "done", **self._place(frame), "players": players}

    def _moment(self, moment: Moment) -> Happening:
        commands = self._clone.commands
        return {
            **self._place(moment.frame),
            "unum": moment.player + 1,
            "command": commands[moment.kind],
            "probability": moment.probability,
            "likeliest": commands[moment.likeliest],
            "log_loss": moment.loss,
        }


def _dataset_of(run: Run) -> Dataset | None:
    """Return the dataset that a run was trained on, whose counts the baselines are; None where it is gone."""
    try:
        return open_dataset(run.dataset_path)
    except DatasetError:
        return None
