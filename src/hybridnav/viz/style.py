"""Colours and sizes of the pictures, in one place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridnav._base.typing import ByteArray

OCCUPIED = "#2b2b2b"
BLOCKED = "#989898"
UNEXPLORED = "#d2d2d2"
FREE = "#ffffff"
INK = "#1a1a1a"
ARC = "#5c5c5c"
RIM_ARC = "#868686"
UNEXPLORED_ARC = "#a6a6a6"
UNEXPLORED_DOT = "#8c8c8c"
PATH = "#c4122f"
PARALLEL = "#0077bb"
SELF_LOOP = "#cc3311"
SELF_LOOP_DASHES = (0.0, (3.0, 1.2))
"""Lengths in line widths. Printed in grey, self-loops are no darker than parallel arcs."""
HOLE = "#d55e00"
OUTSIDE = "#882255"
ROUTES = (PATH, "#4837b6", "#e49b34", "#110328", "#8c8d8c")
"""Colours of routes in one picture, the shortest first: as distinct as five can be for every kind
of colour vision, from each other and from pale places."""
UNEXPLORED_NODE = "#8a8a8a"
METHODS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", INK)
"""Okabe and Ito's palette, safe for the colour-blind, without the yellow that white swallows."""

PLACES = ("#3ba2b2", "#e0d59d", "#99a9ea", "#aea160", "#abcdec", "#daada3")
"""Colours of places, found by simulated annealing: as distinct as six can be for every kind of
colour vision and in grey, from each other, from pale and unexplored places, and from the path's
red."""
UNEXPLORED_PLACES = ("#c6c6c6", "#d2d2d2", "#cacaca", "#d6d6d6", "#cecece", "#d0d0d0")

PALE = 0.3
"""Share of its colour that a place keeps if others are highlighted; the rest is white."""

FULL_WIDTH_IN = 7.0
"""Width of a picture on two columns of a paper, in inches; sizes below are for it."""


def rgb(*colours: str, strength: float = 1.0) -> ByteArray:
    """Return colours `#rrggbb`, mixed with white, as uint8 (n, 3)."""
    levels = np.array([list(bytes.fromhex(colour[1:])) for colour in colours], dtype=np.float64)
    return np.round(255 - strength * (255 - levels)).astype(np.uint8)


def class_rgb(*more: str) -> ByteArray:
    """Return the colours of cells by `CellClass`, and then more, as `rgb` does."""
    return rgb(BLOCKED, FREE, UNEXPLORED, *more)


@dataclass(frozen=True)
class Sizes:
    """Sizes in points that suit the width of a picture."""

    font: float
    line: float
    """Factor for line widths and markers; 1 at `FULL_WIDTH_IN`."""
    points_per_metre: float

    @classmethod
    def fitting(cls, width_in: float, points_per_metre: float) -> Sizes:
        """Return the sizes for a picture of some width."""
        share = width_in / FULL_WIDTH_IN
        font = float(np.clip(8 * share**0.4, 6, 11))
        return cls(font, float(np.clip(share**0.6, 0.5, 1.6)), points_per_metre)
