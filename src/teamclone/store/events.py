"""The events of a match out of a store."""

from __future__ import annotations

from teamclone.events.definitions import COLUMNS, typed
from teamclone.logs.match import Columns
from teamclone.store import schema
from teamclone.store.store import Store


def read_events(store: Store, match_id: str) -> Columns:
    """Return the events of a match as ``find_events`` gives them.

    Raises:
        StoreError: its rows cannot be read.
    """
    names = [column.name for column in COLUMNS]
    return typed(store.read_match_columns(match_id, schema.MATCH_EVENTS.name, columns=names))
