"""What a server says of a match to every client that comes, before it shows the match."""

from __future__ import annotations

from dataclasses import dataclass, field

from teamclone.logs.assemble import checked_type, player_type_columns
from teamclone.logs.match import Columns
from teamclone.logs.rcg_text import parameters


@dataclass(slots=True)
class Parameters:
    """The parameters of a match, as far as they have come.

    Attributes:
        server, player: parameters as `rcg_text.parameters` reads them. types: of each player type by its number.
        texts: the messages as they came, by the first words of each.
    """

    server: dict[str, float | str] = field(default_factory=dict)
    player: dict[str, float | str] = field(default_factory=dict)
    types: dict[int, dict[str, float]] = field(default_factory=dict)
    texts: dict[bytes, bytes] = field(default_factory=dict)

    @property
    def whole(self) -> bool:
        """Whether all have come: those of the server and of players, and as many types as these say."""
        n_types = self.player.get("player_types", 1.0)
        return bool(self.server and self.player) and isinstance(n_types, float) and len(self.types) >= n_types

    @property
    def type_columns(self) -> Columns:
        """The columns of ``player_types.FIELDS``, see `GameLog.player_types`."""
        return player_type_columns(self.types)

    def take(self, text: bytes) -> bool:
        """Take a message in; return whether it is one of parameters."""
        word = text.partition(b" ")[0]
        if b"\n" in text or not text.endswith(b")"):  # a log could not have the one, the other is cut off
            return False
        if word == b"(server_param":
            self.server = parameters(text)
        elif word == b"(player_param":
            self.player = parameters(text)
        elif word == b"(player_type":
            try:
                number, fields = checked_type(parameters(text))
            except ValueError:
                return False
            self.types[number] = fields
            word += b" %d" % number
        else:
            return False
        self.texts[word] = text
        return True
