"""Cleaning, binding commands to states, splits by match, slices: from a store to training samples."""
