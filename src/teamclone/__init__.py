"""teamclone learns how a RoboCup Soccer Simulation 2D team plays from the logs of its matches."""

from importlib.metadata import version

__version__ = version("teamclone")
