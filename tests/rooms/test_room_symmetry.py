"""Rooms hang on the map alone: not on how it is turned or mirrored, nor on what lies round it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from research._rooms_buildings import SITES, Building
from tests.graphs.test_lane_symmetry import WAYS, offices, turned
from tests.strategies import class_grids, examples, occupancy_grid

SIDES = st.tuples(st.integers(0, 9), st.integers(0, 9))


def found_rooms(cells, side_m):
    """The label of the room of each free cell of a map: in walls, two rooms may be as near."""
    grid = hn.OccupancyGrid(np.ascontiguousarray(cells), hn.Frame(side_m), robot_radius_m=0)
    return np.where(grid.probability == 0, hn.find_rooms(grid, least_area_m2=0.5).label_of, -1)


def assert_same_rooms(one, other):
    """Two arrays part the cells alike, whatever the labels, and the same cells are in none."""
    pairs = np.unique(np.stack([one, other]).reshape(2, -1).T @ [1 << 32, 1])
    assert len(pairs) == len(np.unique(one)) == len(np.unique(other))
    assert ((one < 0) == (other < 0)).all()


def check_image(cells, side_m, way, margin):
    """The rooms of an image with an unexplored margin are the images of the rooms."""
    top, left = margin
    padded = np.pad(cells, ((top, 3), (left, 0)), constant_values=0.5)
    expected = found_rooms(padded, side_m)
    assert_same_rooms(found_rooms(turned(padded, way), side_m), turned(expected, way))
    assert_same_rooms(found_rooms(cells, side_m), expected[top:-3, left:])


@settings(max_examples=examples(12))
@given(office=offices(), way=st.sampled_from(WAYS), margin=SIDES)
def test_offices_have_the_same_rooms_in_every_image(office, way, margin):
    check_image(office[0], 0.05, way, margin)


@settings(max_examples=examples(60))
@given(classes=class_grids(), way=st.sampled_from(WAYS), margin=SIDES)
def test_any_cells_have_the_same_rooms_in_every_image(classes, way, margin):
    check_image(occupancy_grid(classes).probability, 0.25, way, margin)


@pytest.mark.parametrize("name", SITES)
def test_labelled_maps_have_the_same_rooms_mirrored_turned_padded_and_cropped(data, name):
    grid = Building.read(data, name).grid
    cells = np.where(grid.measured == 2, 0.5, grid.measured == 0).astype(np.float32)
    known = np.flatnonzero((cells != 0.5).any(axis=1))
    found = found_rooms(cells, grid.resolution_m)
    for way in ((0, 0, 1), (1, 0, 1)):
        assert_same_rooms(found_rooms(turned(cells, way), grid.resolution_m), turned(found, way))
    padded = np.pad(cells[known[0] : known[-1] + 1], ((0, 0), (17, 5)), constant_values=0.5)
    rows = slice(known[0], known[-1] + 1)
    assert_same_rooms(found_rooms(padded, grid.resolution_m)[:, 17:-5], found[rows])
