"""A match as one HTML file that plays it in a browser, with what a clone predicted beside what happened."""
