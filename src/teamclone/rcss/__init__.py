"""What the simulator defines: pitch, parameters, play modes, commands, state bits, the frame of reference. No I/O."""
