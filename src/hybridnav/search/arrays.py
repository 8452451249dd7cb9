"""Data structures in arrays, for kernels: heap, union-find forest, arrays that grow."""

from __future__ import annotations

from hybridnav.search._array_kernels import find, grow, pop, push

__all__ = ["find", "grow", "pop", "push"]
