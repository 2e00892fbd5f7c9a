"""Many matches as one SQL schema: ingest, query, check.

The schema (``schema``), the rows of a match (``convert``) and the checks (``checks``) know nothing of where a store
keeps its rows. ``Store`` is the interface of every back end; ``parquet`` is the embedded one, ``postgres`` a server's.
"""

from teamclone.store.ingest import IngestReport, ingest
from teamclone.store.opening import create_store, is_store, open_store
from teamclone.store.store import Store

__all__ = ["IngestReport", "Store", "create_store", "ingest", "is_store", "open_store"]
