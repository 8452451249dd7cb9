"""Refiners: from a corridor to a metric path, behind one protocol."""

from hybridnav.refine.grid import GridRefiner, Refiner, path_of

__all__ = ["GridRefiner", "Refiner", "path_of"]
