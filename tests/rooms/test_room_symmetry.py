"""Rooms hang on the map alone: not on how it is turned or mirrored, nor on what lies round it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.rooms.cutting import Kind, without_noise
from research._rooms_buildings import SITES, Building
from tests.graphs.test_lane_symmetry import WAYS, offices, turned
from tests.strategies import class_grids, occupancy_grid, tried

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


@tried(12, office=offices(), way=st.sampled_from(WAYS), margin=SIDES)
def test_offices_have_the_same_rooms_in_every_image(office, way, margin):
    check_image(office[0], 0.05, way, margin)


@tried(60, classes=class_grids(), way=st.sampled_from(WAYS), margin=SIDES)
def test_any_cells_have_the_same_rooms_in_every_image(classes, way, margin):
    check_image(occupancy_grid(classes).probability, 0.25, way, margin)


def test_rooms_outlive_noise():
    """With 1 % of all cells wrong, all rooms but one keep an intersection over union of 0.8."""
    maps = Path(__file__).parents[2] / "maps"
    grid = hn.load_map(maps / "office-explored" / "office-explored.yaml")
    hit = np.random.default_rng(2).random(grid.shape) < 0.01
    cells = np.where(hit & (grid.measured != 2), 1 - grid.probability, grid.probability)
    rooms, again = (hn.find_rooms(replace(grid, probability=p)) for p in (grid.probability, cells))
    one, other = rooms.label_of, again.label_of
    shares = [
        max(
            (mine & (other == to)).sum() / (mine | (other == to)).sum()
            for to in np.unique(other[mine])
        )
        for mine in (one == label for label in range(len(rooms.names)))
    ]
    assert sorted(shares)[1] >= 0.8


def test_pillars_are_no_noise():
    free = np.ones((12, 40), np.uint8)
    free[6, 4::8] = 0
    kinds = np.where(free, np.uint8(Kind.INSIDE), np.uint8(Kind.WALL))
    many = np.tile(kinds, (4, 4))
    for cells, side in ((kinds, 0.05), (many, 0.5)):  # few; wide
        assert np.array_equal(without_noise(cells, side), cells)
    assert (without_noise(many, 0.05) == Kind.INSIDE).all()


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
