"""Data structures in arrays, for kernels: heap, union-find forest, arrays that grow."""

from __future__ import annotations

from hybridnav._base.kernels.arrays import find, grow, pop, push

__all__ = ["find", "grow", "pop", "push"]
