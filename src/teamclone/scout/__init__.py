"""Opponent reports: what a team does, where and when, how sure that is, and where it can be hurt."""
