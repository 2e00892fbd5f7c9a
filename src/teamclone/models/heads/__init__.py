"""Heads: from hidden features to an answer."""
