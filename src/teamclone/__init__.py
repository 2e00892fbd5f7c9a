"""teamclone learns how a RoboCup Soccer Simulation 2D team plays from the logs of its matches.

The public names load on first use, so that ``import teamclone`` is quick and needs none of the extras.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from teamclone import plot
    from teamclone.api import LoadedClone, load, match_events, match_percepts
    from teamclone.comparison.compare import Comparison, compare, write_comparison
    from teamclone.dataset.build import DatasetConfig, build_dataset
    from teamclone.dataset.reader import Dataset, open_dataset
    from teamclone.dynamics.bodies import Bodies, Commands
    from teamclone.dynamics.logged import Logged
    from teamclone.dynamics.rules import Rules
    from teamclone.dynamics.step import step
    from teamclone.errors import TeamcloneError
    from teamclone.evaluation.evaluate import evaluate
    from teamclone.evaluation.prediction_table import PredictionTable
    from teamclone.events.statistics import TeamStatistics, team_statistics
    from teamclone.events.table import MatchEvents
    from teamclone.logs import Match, find_matches, read_match
    from teamclone.percepts.table import MatchPercepts
    from teamclone.replay.page import make_replay
    from teamclone.report.page import make_report
    from teamclone.scout.scout import scout_team
    from teamclone.scout.write import write_scout
    from teamclone.similarity.similar import Similarity, similar, write_similarity
    from teamclone.store.ingest import ingest
    from teamclone.store.opening import create_store, open_store
    from teamclone.training.config import load_config
    from teamclone.training.loop import train
    from teamclone.training.run import Run, open_run
    from teamclone.world.view import view
    from teamclone.world.world import World

__version__ = version("teamclone")

_HOME = {
    "read_match": "logs",
    "find_matches": "logs",
    "Match": "logs",
    "match_events": "api",
    "MatchEvents": "events.table",
    "match_percepts": "api",
    "MatchPercepts": "percepts.table",
    "team_statistics": "events.statistics",
    "TeamStatistics": "events.statistics",
    "Rules": "dynamics.rules",
    "Bodies": "dynamics.bodies",
    "Commands": "dynamics.bodies",
    "Logged": "dynamics.logged",
    "step": "dynamics.step",
    "create_store": "store.opening",
    "open_store": "store.opening",
    "ingest": "store.ingest",
    "view": "world.view",
    "World": "world.world",
    "DatasetConfig": "dataset.build",
    "build_dataset": "dataset.build",
    "open_dataset": "dataset.reader",
    "Dataset": "dataset.reader",
    "load_config": "training.config",
    "train": "training.loop",
    "open_run": "training.run",
    "Run": "training.run",
    "load": "api",
    "LoadedClone": "api",
    "PredictionTable": "evaluation.prediction_table",
    "evaluate": "evaluation.evaluate",
    "make_report": "report.page",
    "make_replay": "replay.page",
    "compare": "comparison.compare",
    "Comparison": "comparison.compare",
    "write_comparison": "comparison.compare",
    "similar": "similarity.similar",
    "Similarity": "similarity.similar",
    "write_similarity": "similarity.similar",
    "scout_team": "scout.scout",
    "write_scout": "scout.write",
    "plot": "plot",
    "TeamcloneError": "errors",
}
"""The module of each public name, in the order of the pipeline; `plot` is one itself."""

__all__ = [
    "Bodies",
    "Commands",
    "Comparison",
    "Dataset",
    "DatasetConfig",
    "LoadedClone",
    "Logged",
    "Match",
    "MatchEvents",
    "MatchPercepts",
    "PredictionTable",
    "Rules",
    "Run",
    "Similarity",
    "TeamStatistics",
    "TeamcloneError",
    "World",
    "build_dataset",
    "compare",
    "create_store",
    "evaluate",
    "find_matches",
    "ingest",
    "load",
    "load_config",
    "make_replay",
    "make_report",
    "match_events",
    "match_percepts",
    "open_dataset",
    "open_run",
    "open_store",
    "plot",
    "read_match",
    "scout_team",
    "similar",
    "step",
    "team_statistics",
    "train",
    "view",
    "write_comparison",
    "write_scout",
    "write_similarity",
]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        module = import_module(f"{__name__}.{_HOME[name]}")
        value = module if name == _HOME[name] else getattr(module, name)
        globals()[name] = value
        return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
