"""The protocols of rcssserver: messages as bytes and columns, and the sockets that carry them."""
