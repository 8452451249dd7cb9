"""Changes of rooms, judged cell by cell with shapely."""

from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.page.requests import Merge, Move, Rename, Split, changed, rings_of
from tests.strategies import tried

ROWS, COLS = 12, 18
GRID = hn.OccupancyGrid(np.zeros((ROWS, COLS), np.float32), robot_radius_m=0)
ROOMS = hn.RoomLabels(
    ("a", "b", "c"), np.tile(np.repeat([0, 1, 2], COLS // 3), (ROWS, 1)), {"a": (1.0, 1.0)}
)
CENTRES = shapely.points(*np.meshgrid(np.arange(COLS) + 0.5, np.arange(ROWS) + 0.5))
NUMBERS = st.floats(-3, 21, allow_nan=False)


@tried(60, st.tuples(NUMBERS, NUMBERS), st.tuples(NUMBERS, NUMBERS))
def test_a_cut_leaves_every_cell_on_its_side(one, other):
    change = Split(op="split", room="b", line=[list(one), list(other)], name="new")
    left = np.array(
        [
            [
                (other[0] - one[0]) * (r + 0.5 - one[1]) - (other[1] - one[1]) * (c + 0.5 - one[0])
                for c in range(COLS)
            ]
            for r in range(ROWS)
        ]
    )
    mine = ROOMS.label_of == 1
    if not (left[mine] < 0).any() or not (left[mine] >= 0).any():
        return
    sure = np.abs(left) > 1e-6
    try:
        after = changed(ROOMS, change, GRID)
    except hn.errors.InvalidValueError:
        assert not (sure & mine & (left < 0)).any() or not (sure & mine & (left >= 0)).any()
        return
    assert after.names == ("a", "b", "c", "new")
    assert (after.label_of[~mine] == ROOMS.label_of[~mine]).all()
    assert (after.label_of[mine & sure] == np.where(left < 0, 3, 1)[mine & sure]).all()


def test_a_union_has_the_cells_of_both_and_the_first_name() -> None:
    after = changed(ROOMS, Merge(op="merge", room="c", other="b"), GRID)
    assert after.names == ("a", "c")
    assert ((after.label_of == 1) == (ROOMS.label_of >= 1)).all()
    assert (ROOMS.label_of == np.tile(np.repeat([0, 1, 2], COLS // 3), (ROWS, 1))).all()


def test_rooms_apart_do_not_merge() -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="do not touch"):
        changed(ROOMS, Merge(op="merge", room="a", other="c"), GRID)


def test_a_name_takes_its_point_along() -> None:
    after = changed(ROOMS, Rename(op="rename", room="a", name="hall"), GRID)
    assert after.names == ("hall", "b", "c")
    assert after.points == {"hall": (1.0, 1.0)}
    assert (after.label_of == ROOMS.label_of).all()


@tried(40, st.integers(0, 3), NUMBERS, NUMBERS)
def test_a_moved_corner_changes_the_cells_between_both_outlines(which, x, y):
    ring = rings_of(ROOMS, GRID)[1][0]
    corner = ring[which % len(ring)]
    moved = [[x, y] if each == corner else each for each in ring]
    before, after = shapely.Polygon(ring), shapely.Polygon(moved)
    if not after.is_valid:
        return
    change = Move(op="move", room="b", corner=corner, to=[x, y])
    was, now = before.contains(CENTRES), after.contains(CENTRES)
    sure = shapely.distance(after.boundary, CENTRES) > 1e-6
    expected = np.where(
        now & ~was, 1, np.where(was & ~now & (ROOMS.label_of == 1), -1, ROOMS.label_of)
    )
    try:
        found = changed(ROOMS, change, GRID)
    except hn.errors.InvalidValueError:
        assert any(not (expected[sure] == label).any() for label in range(3))
        return
    assert (found.label_of[sure] == expected[sure]).all()


def test_what_was_changed_is_saved_and_read_cell_by_cell(tmp_path: Path) -> None:
    rooms = changed(ROOMS, Split(op="split", room="b", line=[[5, 2], [14, 9]], name="d"), GRID)
    corner = rings_of(rooms, GRID)[0][0][0]
    to = [min(max(corner[0], 2), 8), 3.2]
    rooms = changed(rooms, Move(op="move", room="a", corner=corner, to=to), GRID)
    hn.save_rooms(tmp_path / "rooms.yaml", rooms, GRID)
    read = hn.load_rooms(tmp_path / "rooms.yaml", GRID)
    assert read.names == rooms.names
    named = rooms.label_of >= 0
    assert (read.label_of[named] == rooms.label_of[named]).all()
