"""Files, settings, processes and the machine: used by the rest, knows nothing of football."""
