"""What a player of HELIOS Base would do with the ball: the plan that most agents of the league grew from."""
