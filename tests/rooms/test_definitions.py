"""What one room is, as the page on rooms says it: floors drawn by rule, each found room by room."""

import math

import numpy as np
import pytest

import hybridnav as hn
from research._rooms_agreement import compare_rooms
from research._rooms_drawn import bend, crossing, drawn, hall, straight

WIDTHS_M = (1.6, 2.2, 3.0)
PLANS = {
    **{f"straight {w}": straight(w) for w in WIDTHS_M},
    **{f"long {w}": straight(w, 48.0) for w in WIDTHS_M},
    **{f"bend {w}": bend(w) for w in WIDTHS_M},
    **{f"branch {w}": crossing(w, w, down=0.0) for w in WIDTHS_M},
    **{f"crossing {w}": crossing(w, w) for w in (1.6, 3.0)},
    **{f"doors of {door} across": straight(3.0, parts=3, door=door) for door in (0.9, 1.0)},
    **{f"bays {bay}": hall(5, bay, 0.8 * bay) for bay in (2.0, 2.5, 3.0)},
}


@pytest.mark.parametrize(("side_m", "degrees"), [(0.05, 0), (0.05, 37), (0.1, 0), (0.1, 10)])
@pytest.mark.parametrize("name", PLANS)
def test_each_room_of_a_drawn_floor_is_found_as_one(name, side_m, degrees):
    floor = drawn(PLANS[name], side_m, math.radians(degrees))
    label_of = hn.find_rooms(floor.grid).label_of
    agreed = compare_rooms(floor.true[floor.compared], label_of[floor.compared])
    assert agreed.recall_at(0.8) == 1.0
    assert agreed.n_found == len(PLANS[name].rooms)


@pytest.mark.parametrize("step_degrees", [1.5, 4.0])
def test_what_is_seen_through_glass_is_no_room(step_degrees):
    floor = drawn(straight(2.4), 0.05)
    true = np.pad(floor.true, 150, constant_values=-1)
    cells = np.pad(floor.grid.probability, 150, constant_values=0.5).astype(np.float32)
    rows, cols = np.nonzero(true == 2)  # an office whose far wall is of glass
    up = np.arange(np.ptp(rows) + 120)
    for degrees in np.arange(60.0, 120.5, step_degrees):
        aside = (cols.mean() + up / math.tan(math.radians(degrees))).astype(int)
        seen = ((aside > cols.min()) & (aside < cols.max())) | (up > np.ptp(rows) + 8)
        cells[rows.min() + up[seen], aside[seen]] = 0.0
    grid = hn.OccupancyGrid(cells, floor.grid.frame, robot_radius_m=0.25)
    labels = hn.find_rooms(grid)
    inside = true >= 0
    assert compare_rooms(true[inside], labels.label_of[inside]).recall_at(0.8) == 1.0
    rooms = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels)).rooms
    assert np.count_nonzero(rooms.is_listed[: len(labels.names)]) == true.max() + 1
