"""Where one stands in a room, and the doors that lead somewhere."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.rooms.choices import free_point, leading_doors

FRAME = hn.Frame(resolution_m=0.5, origin_m=(3.0, -2.0), yaw_rad=0.4)


def _rooms(walls: np.ndarray, label_of: np.ndarray, names: tuple[str, ...]) -> hn.Rooms:
    grid = hn.OccupancyGrid(walls.astype(float), frame=FRAME, robot_radius_m=0.0)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=hn.RoomLabels(names, label_of))
    return hn.TopologicalMap(pyramid).rooms


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.floats(-1, 9), st.floats(-1, 11))
@example(0, 8.0, 0.0)  # the side of a free cell at the end of the map
@example(0, 3.0, 2.5)  # the side between a free cell and a wall
def test_the_place_is_the_nearest_free_cell_of_the_room(seed: int, row: float, col: float) -> None:
    rng = np.random.default_rng(seed)
    walls = rng.random((8, 10)) < 0.3
    label_of = np.where(np.arange(10) < 5, 0, 1) * np.ones((8, 1), dtype=int)
    walls[4, 2] = walls[4, 7] = False
    rooms = _rooms(walls, label_of, ("a", "b"))
    near = tuple(FRAME.points_of_grid([row, col]).tolist())
    # The oracle: cells of the room in the connected set that is largest of those that reach it.
    joined, _ = ndimage.label(~walls)
    sizes = np.bincount(joined.ravel())
    here = np.argwhere(~walls & (label_of == 0))
    most = max(sizes[joined[r, c]] for r, c in here)
    away = [
        math.hypot(r + 0.5 - row, c + 0.5 - col) for r, c in here if sizes[joined[r, c]] == most
    ]
    x, y = free_point(rooms, "a", near)
    assert rooms.at((x, y)) == "a"
    assert not walls[FRAME.cell_of(x, y)]
    if (x, y) != near:
        assert math.dist(FRAME.position_of(x, y), (row, col)) == pytest.approx(min(away), abs=1e-6)


def test_a_room_that_the_robot_does_not_fit_in_is_refused() -> None:
    walls = np.zeros((6, 6), dtype=bool)
    walls[:, 3] = True
    walls[:, 5] = True
    grid = hn.OccupancyGrid(walls.astype(float), frame=FRAME, robot_radius_m=0.6)
    label_of = np.where(np.arange(6) < 3, 0, 1) * np.ones((6, 1), dtype=int)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=hn.RoomLabels(("a", "slot"), label_of))
    rooms = hn.TopologicalMap(pyramid).rooms
    with pytest.raises(InvalidValueError, match=r"slot.*has no free cell"):
        free_point(rooms, "slot")
    with pytest.raises(InvalidValueError, match="did you mean slot"):
        free_point(rooms, "slott")


def test_doors_to_a_nook_without_a_name_lead_nowhere() -> None:
    """Rooms a and b below a nameless corridor, and a nameless nook beside b."""
    walls = np.ones((13, 26), dtype=bool)
    label_of = np.full((13, 26), -1)
    for label, cols in enumerate([slice(1, 8), slice(9, 16)]):
        walls[1:7, cols] = False
        label_of[1:7, cols] = label
    walls[8:12, 1:16] = False  # the corridor
    walls[1:7, 17:24] = False  # the nook
    walls[7, [3, 4]] = walls[7, [11, 12]] = False  # doors to the corridor
    walls[3:5, 16] = False  # the door to the nook
    rooms = _rooms(walls, label_of, ("a", "b"))
    listed = {door.number: door.position for door in rooms.listed_doors}
    leading = {door.number for door in leading_doors(rooms)}
    nook = [n for n, at in listed.items() if FRAME.position_of(*at)[1] > 15]
    assert len(listed) == 3
    assert len(nook) == 1
    assert leading == set(listed) - set(nook)
