"""How near a clone that plays in a team's place is to the team, in units of the team's own spread."""
