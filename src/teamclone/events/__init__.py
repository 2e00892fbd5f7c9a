"""What happened in a match: touches of the ball, what became of them, and what the referee said, as columns."""
