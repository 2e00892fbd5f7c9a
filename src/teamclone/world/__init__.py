"""What one cycle looks like to a team."""
