"""Cleaning, binding commands to states, splits by match, slices: from a store to what a network is trained on."""
