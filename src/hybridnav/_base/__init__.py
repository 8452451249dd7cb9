"""What all layers share: compiled kernels, files, copies, moves, sines."""
