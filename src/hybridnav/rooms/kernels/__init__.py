"""Kernels: compiled loops over plain arrays."""
