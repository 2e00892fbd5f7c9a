"""What rcssserver computes in a cycle."""
