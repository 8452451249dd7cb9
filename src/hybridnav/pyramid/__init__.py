"""The dual graph pyramid: selection of stars (MIES), contraction, simplification, levels."""

from hybridnav.pyramid.level import Level
from hybridnav.pyramid.pyramid import DualGraphPyramid, Linkage

__all__ = ["DualGraphPyramid", "Level", "Linkage"]
