"""From the state of the game to the inputs of a network, in compiled kernels: no PyTorch, and nothing of it learns."""
