"""Refiners: from a corridor to a metric path, behind one protocol."""

from hybridnav.refine.grid import GridRefiner, Refiner

__all__ = ["GridRefiner", "Refiner"]
