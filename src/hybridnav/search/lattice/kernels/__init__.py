"""Kernels of the lattice."""
