"""Layers that use the geometry and rules of the game."""
