"""Definitions of the simulator: pitch, parameters, play modes, commands, state bits, frame of reference. No I/O."""
