"""A clone many cycles ahead: its commands through the step of a cycle, from frames of matches."""
