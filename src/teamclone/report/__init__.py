"""One HTML file of all that was measured of a clone."""
