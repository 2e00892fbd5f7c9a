"""Clones in a match that is being played."""
