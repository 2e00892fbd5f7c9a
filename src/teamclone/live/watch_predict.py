"""What a clone expects of a team in the newest frame of a match that is being played, within milliseconds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from teamclone.dataset.clean import as_stored, players_to_model, whole_frames
from teamclone.dynamics.rules import check_parameters
from teamclone.engine.clone import CompiledClone
from teamclone.errors import LiveError, UsageError
from teamclone.live.asking import ask
from teamclone.live.watch_frames import Seen
from teamclone.logs.match import Columns
from teamclone.protocol.parameters import Parameters
from teamclone.rcss.commands import parameters_of
from teamclone.rcss.players import N_TEAM
from teamclone.world.channels import CHANNEL
from teamclone.world.view import view_columns
from teamclone.world.world import World

_ROOM = 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """Who is watched, and by which rules its commands become samples, those of the dataset of the run.

    Attributes:
        side: 1 left, -1 right. types, params: of the match. history: frames before each that the clone reads.
        channels: of players that it reads. cleaning: the arguments of `clean_match` that a dataset's options give.
    """

    side: int
    types: Columns
    params: Mapping[str, float | str]
    history: int
    channels: tuple[str, ...]
    cleaning: Mapping[str, Any]

    @classmethod
    def of(cls, parameters: Parameters, **others: Any) -> Subject:
        """Return the subject of a match with these parameters; ``others`` are the other attributes.

        Raises:
            LiveError: no match can be played by them.
        """
        types = parameters.type_columns
        try:
            check_parameters(parameters.server, types)
        except UsageError as error:
            raise LiveError(f"the server's parameters cannot be those of a match: {error}") from None
        return cls(types=types, params=parameters.server, **others)

    @property
    def n_types(self) -> int:
        """How many player types the server describes."""
        return len(next(iter(self.types.values())))

    def view(self, frames: Columns, players: Columns) -> World:
        """Return frames as the team sees them, and as a dataset keeps them."""
        world = view_columns(frames, players, types=self.types, params=self.params, side=self.side)
        return replace(world, players=as_stored(world.players))


class Expected:
    """A clone's answers for the frames so far, (room, 11, ...); NaN where it was not asked."""

    def __init__(self, clone: CompiledClone, subject: Subject) -> None:
        self.clone, self.subject, self.commands = clone, subject, clone.commands
        self.probabilities = np.full((_ROOM, N_TEAM, len(self.commands)), np.nan, np.float32)
        self.parameters = np.full((_ROOM, N_TEAM, len(parameters_of(self.commands))), np.nan, np.float32)
        self.near = np.zeros((_ROOM, N_TEAM), np.bool_)
        self.lacking = 0
        """Frames in play without a number that the clone reads."""

    def predict(self, seen: Seen) -> NDArray[np.int64]:
        """Answer for the players of the team in the newest frame; return who they are, (n,) 0..10."""
        now, subject = len(seen) - 1, self.subject
        if now >= len(self.near):
            self.probabilities, self.parameters = _roomier(self.probabilities), _roomier(self.parameters)
            self.near = _roomier(self.near)
        frames, players = seen.window(now - subject.history - 1, now + 1)
        due = players_to_model(frames, players, side=subject.side, repertoire=self.commands)
        actor = np.flatnonzero(due[-1])
        if not len(actor):
            return actor
        whole = whole_frames(frames, players, n_types=subject.n_types)
        world = subject.view(frames, players)
        if not whole[-1] or self._lacks(world):
            self.lacking += 1
            return actor[:0]
        # Only frames in play have samples, and a model has learned no past from others.
        past = world.select(np.flatnonzero(due.any(axis=1) & whole))
        since = np.full(len(past), seen.mode_cycles, np.int32)  # the play mode may have begun before the window
        answers, near = ask(self.clone, replace(past, mode_cycles=since), actor, history=subject.history)
        for row, player in enumerate(actor):
            answer = self.clone.network.view(answers[row])
            self.probabilities[now, player], self.parameters[now, player] = answer.probabilities, answer.parameters
        self.near[now, actor] = near
        return actor

    def _lacks(self, world: World) -> bool:
        reads = [CHANNEL[name] for name in self.subject.channels]
        return bool(np.isnan(world.ball[-1]).any() or np.isnan(world.players[-1][:, reads]).any())


def _roomier(values: NDArray[Any]) -> NDArray[Any]:
    """Return an array with as much room again: NaN, or False."""
    empty = np.nan if values.dtype.kind == "f" else 0
    return np.concatenate([values, np.full_like(values, empty)])
