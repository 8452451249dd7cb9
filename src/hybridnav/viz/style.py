"""Colours and sizes of the pictures, in one place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray

OCCUPIED = "#2b2b2b"
BLOCKED = "#b4b4b4"
UNEXPLORED = "#e4e4e4"
FREE = "#ffffff"
INK = "#1a1a1a"
ARC = "#5c5c5c"
RIM_ARC = "#868686"
UNEXPLORED_ARC = "#c9c9c9"
UNEXPLORED_DOT = "#a8a8a8"
PATH = "#c4122f"
PARALLEL = "#0077bb"
SELF_LOOP = "#cc3311"
HOLE = "#d55e00"
OUTSIDE = "#882255"
UNEXPLORED_NODE = "#8a8a8a"

PLACES = ("#77aadd", "#eedd88", "#44bb99", "#ffaabb", "#bbcc33", "#99ddff")
"""From Paul Tol's "light" scheme: made for filling areas, told apart by the colour-blind. Its
orange is left out: it would lie too near the path's red."""
UNEXPLORED_PLACES = ("#dcdcdc", "#ececec", "#e0e0e0", "#f0f0f0", "#e4e4e4", "#e8e8e8")

PALE = 0.36
"""Share of its colour that a place keeps where others are the ones to see; the rest is white."""

FULL_WIDTH_IN = 7.0
"""Width of a picture on two columns of a paper, in inches; sizes below are for it."""


def rgb(*colours: str, strength: float = 1.0) -> ByteArray:
    """Colours `#rrggbb`, mixed with white, as uint8 (n, 3)."""
    levels = np.array([list(bytes.fromhex(colour[1:])) for colour in colours], dtype=np.float64)
    return np.round(255 - strength * (255 - levels)).astype(np.uint8)


@dataclass(frozen=True)
class Sizes:
    """Sizes in points that suit the width of a picture."""

    font: float
    line: float
    """Factor for line widths and markers; 1 at `FULL_WIDTH_IN`."""
    points_per_metre: float

    @classmethod
    def fitting(cls, width_in: float, points_per_metre: float) -> Sizes:
        """Sizes for a picture of some width."""
        share = width_in / FULL_WIDTH_IN
        font = float(np.clip(8 * share**0.4, 6, 11))
        return cls(font, float(np.clip(share**0.6, 0.5, 1.6)), points_per_metre)
