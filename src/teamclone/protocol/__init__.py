"""What rcssserver and its clients send each other."""
