"""From the state of the game to the inputs of a network and to its answer, in compiled kernels: no PyTorch."""
