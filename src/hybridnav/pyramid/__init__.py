"""The dual graph pyramid: selection of stars (MIES), contraction, simplification, levels."""

from hybridnav.pyramid.decimation import Linkage
from hybridnav.pyramid.dual import DualGraph, FaceKind
from hybridnav.pyramid.level import Level, LevelArc
from hybridnav.pyramid.pyramid import DualGraphPyramid
from hybridnav.pyramid.resistance import Resistance

__all__ = [
    "DualGraph",
    "DualGraphPyramid",
    "FaceKind",
    "Level",
    "LevelArc",
    "Linkage",
    "Resistance",
]
