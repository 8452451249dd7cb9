"""Areas that changed as boxes of cells: all cells that they overlap, and no more."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely import Polygon, box

import hybridnav as hn
from hybridnav.maps.areas import box_of_area
from tests.strategies import examples

SHAPE = (7, 9)
COORDINATES = st.floats(-3, 12) | st.integers(-3, 12).map(float)


def cells_of(found: tuple[int, int, int, int]) -> Any:
    """The cells of a box, bool (rows, cols)."""
    inside = np.zeros(SHAPE, np.bool_)
    inside[slice(*found[:2]), slice(*found[2:])] = True
    return inside


@given(st.lists(COORDINATES, min_size=4, max_size=4), st.sampled_from([0.0, 0.7]))
@settings(max_examples=examples(100))
def test_a_box_holds_each_cell_that_an_area_overlaps(at: list[float], yaw: float) -> None:
    (x_min, x_max), (y_min, y_max) = sorted(at[::2]), sorted(at[1::2])
    frame = hn.Frame(0.5, (1.0, -1.0), yaw)
    found = box_of_area((x_min, y_min, x_max, y_max), frame, SHAPE)
    assert found == box_of_area(box(x_min, y_min, x_max, y_max), frame, SHAPE)
    inside, bounds = cells_of(found), box(x_min, y_min, x_max, y_max)
    for row, col in np.ndindex(SHAPE):
        corners = [(row, col), (row, col + 1), (row + 1, col + 1), (row + 1, col)]
        overlap = Polygon(frame.points_of_grid(corners)).intersection(bounds).area
        assert inside[row, col] or overlap < 1e-5
        if yaw == 0 and inside[row, col] and bounds.area > 1e-3:
            assert overlap > 0


def test_a_mask_and_none_are_areas_too() -> None:
    frame, mask = hn.Frame(), np.zeros(SHAPE, np.bool_)
    assert not cells_of(box_of_area(mask, frame, SHAPE)).any()
    mask[2, 3] = mask[4, 5] = True
    assert box_of_area(mask, frame, SHAPE) == (2, 5, 3, 6)
    assert cells_of(box_of_area(None, frame, SHAPE)).all()
    with pytest.raises(hn.InvalidValueError, match="make it for this map"):
        box_of_area(mask.T, frame, SHAPE)
