"""Factors of cells as an overlay takes them: checked, and in whole units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.costs.checks import MOST_FACTOR, UNIT_BITS
from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray, IntArray

ONE = 1 << UNIT_BITS
"""Units of a factor of 1; a straight move over such cells costs twice as many."""


def units_of(
    factor: FloatArray, shape: tuple[int, int], enterable: BoolArray, box: tuple[slice, slice]
) -> IntArray:
    """Return the factors of the cells in a box in units, rounded down, 0 where not enterable.

    Parameters
    ----------
    factor
        Any float (rows, cols).
    shape
        Rows and columns of the map.
    enterable
        bool, the cells of the box that may be entered.
    box
        Its rows and columns.

    Raises
    ------
    InvalidValueError
        When the shape is another one, or a factor of a cell that may be entered is out of range.
    """
    if factor.shape != shape:
        raise InvalidValueError(
            f"factors have shape {factor.shape}, the map has {shape}: give one per cell"
        )
    own = np.where(enterable, factor[box], 1.0)
    if not ((own >= 1) & (own <= MOST_FACTOR)).all():
        bad = own[~((own >= 1) & (own <= MOST_FACTOR))][0]
        raise InvalidValueError(
            f"a factor of a free cell is {bad}, expected a number from 1 to {MOST_FACTOR:.0f}: "
            "close cells that must not be entered"
        )
    units: IntArray = np.where(enterable, np.floor(own * ONE), 0).astype(np.int32)
    return units


def numbers_of(factor: FloatArray) -> FloatArray:
    """Return factors as an array of floats.

    Raises
    ------
    InvalidValueError
        When they are no numbers, or rows differ in length.
    """
    try:
        array = np.asarray(factor)
    except ValueError:
        array = np.empty(0, dtype=np.bool_)
    if array.dtype.kind not in "iuf":
        raise InvalidValueError(
            f"factors are {factor!r:.60}, expected one number per cell: give an array of rows and "
            "columns"
        )
    return array


def are_whole(factor: FloatArray) -> bool:
    """Return whether factors are whole units."""
    return bool((np.floor(factor * ONE) == factor * ONE).all())
