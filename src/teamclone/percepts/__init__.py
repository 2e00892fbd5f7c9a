"""What players see: the server's visual messages, and what a player believes from them."""
