"""A store as tasks carry it to other processes."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from teamclone.errors import StoreError
from teamclone.store.opening import open_store
from teamclone.store.parquet import MARKER
from teamclone.store.postgres.location import masked
from teamclone.store.status import stamp
from teamclone.store.store import Store


@dataclass(frozen=True, slots=True, kw_only=True)
class SharedStore:
    """A store as a task carries it to another process, perhaps on another machine.

    ``marker`` is the stamp of the file that makes a folder a store, so that a machine which has another folder at the
    same place, or none, is noticed. A store that is no folder has none.
    """

    location: str
    marker: tuple[int, int]

    @classmethod
    def of(cls, store: Store) -> Self:
        """Describe an open store so that another process can open it."""
        return cls(location=store.location, marker=_marker(store.location))

    def open(self) -> Store:
        """Open the store, in the process that works on it.

        Raises:
            StoreError: this machine does not see it.
        """
        if _marker(self.location) != self.marker:
            raise StoreError(
                f"{masked(self.location)}: the worker on {platform.node()} does not see this store; put it on a file "
                "system that all machines have under the same path"
            )
        return open_store(self.location)


def _marker(location: str) -> tuple[int, int]:
    return stamp(Path(location) / MARKER)
