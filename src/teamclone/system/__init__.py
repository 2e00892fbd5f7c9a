"""What the rest stands on: files, settings, processes, the machine. Knows nothing of football."""
