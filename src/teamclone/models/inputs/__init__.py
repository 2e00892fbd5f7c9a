"""Inputs of a network: from the state of the game to numbers around zero."""
