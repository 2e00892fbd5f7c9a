"""Layers that know the game."""
