"""One cycle as a team sees it."""
