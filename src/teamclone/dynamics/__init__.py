"""The computations of rcssserver in a cycle."""
