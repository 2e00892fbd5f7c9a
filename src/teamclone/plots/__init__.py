"""Drawing: one theme, one pitch."""
