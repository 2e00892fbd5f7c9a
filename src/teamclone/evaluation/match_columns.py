"""The columns of a match that whatever looks at one match needs, from its logs or from a store. Needs no PyTorch."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from teamclone.dynamics.inverse.columns import recovered_commands
from teamclone.errors import UsageError
from teamclone.logs.columns import Source
from teamclone.logs.match import Columns, Match, side_named
from teamclone.rcss.player_types import FIELDS
from teamclone.store import schema
from teamclone.store.store import Store


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchColumns:
    """The columns of a match that a prediction needs, from its logs or from a store.

    Attributes:
        match_id: of the match. left, right: names of the teams, None for an empty side.
        frames, players, commands: columns of the match, see ``teamclone.logs.columns``.
        source: of the commands; recovered ones have ``columns.INTERVALS``, too.
        types: the columns of ``player_types.FIELDS``. params: the server's parameters.
    """

    match_id: str
    left: str | None
    right: str | None
    frames: Columns
    players: Columns
    commands: Columns
    types: Columns
    params: Mapping[str, float | str]
    source: Source = Source.LOGGED

    @classmethod
    def of(cls, match: Match) -> MatchColumns:
        """Return the columns of a match that was read from its logs; without a command log, its recovered commands."""
        game, commands, source = match.game, match.commands, Source.LOGGED
        if match.log is None:
            with suppress(UsageError):  # then there are none
                commands, _ = recovered_commands(
                    game.frames, game.players, types=game.player_types, params=game.server_params
                )
                source = Source.RECOVERED
        return cls(
            match_id=match.match_id,
            left=match.left.name,
            right=match.right.name,
            frames=match.frames,
            players=match.players,
            commands=commands,
            source=source,
            types=match.game.player_types,
            params=match.game.server_params,
        )

    @classmethod
    def of_store(cls, store: Store, match_id: str) -> MatchColumns:
        """Return the columns of a match of a store.

        Raises:
            StoreError: the store has no such match, or its rows cannot be read.
        """
        row = cls.row_of(store, match_id)
        tables = {name: store.read_match_columns(match_id, name) for name in ("frames", "player_states", "commands")}
        return cls(
            match_id=match_id,
            left=row["left_name"],
            right=row["right_name"],
            frames=tables["frames"],
            players=tables["player_states"],
            commands=tables["commands"],
            source=Source(int(tables["commands"]["source"].max(initial=Source.LOGGED))),
            types=store.read_match_columns(match_id, "player_types", columns=FIELDS),
            params=store.read_parameters(match_id)["server"],
        )

    @staticmethod
    def row_of(store: Store, match_id: str) -> dict[str, Any]:
        """Return the row of a match in the table ``matches``. Raises as `of_store`."""
        row: dict[str, Any]
        (row,) = store.read_table(match_id, schema.MATCHES.name).to_pylist()
        return row

    def side_of(self, team: str | None, side: str | None) -> int:
        """Return the side that ``team`` or ``side`` names, 1 left or -1 right.

        Raises:
            UsageError: neither or both are named, or the team does not play.
        """
        return side_named(self.match_id, self.left, self.right, team=team, side=side)
