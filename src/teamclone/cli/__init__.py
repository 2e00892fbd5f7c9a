"""The command line: one module per command, each a thin call of one library function."""

from teamclone.cli.app import main

__all__ = ["main"]
