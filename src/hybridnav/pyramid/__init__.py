"""The dual graph pyramid: selection of stars (MIES), contraction, simplification, levels.

Names load on first use: to look at a pyramid takes less than to build one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use

if TYPE_CHECKING:
    from hybridnav.pyramid.dual import DualGraph, FaceKind
    from hybridnav.pyramid.level import Level, LevelArc
    from hybridnav.pyramid.pyramid import DualGraphPyramid
    from hybridnav.pyramid.record import Linkage
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

__getattr__ = on_first_use(
    __name__,
    {
        "DualGraph": "dual",
        "DualGraphPyramid": "pyramid",
        "FaceKind": "dual",
        "Level": "level",
        "LevelArc": "level",
        "Linkage": "record",
        "Resistance": "resistance",
    },
)
