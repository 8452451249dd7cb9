"""Tiles against plain arrays, and what updates make of them."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.live import OnlinePyramid
from hybridnav.ext.live.tiles import CELL, SIDE, Box, Tiles
from tests.strategies import occupancy_grid

LOW = (-70, -130)
SHAPE = (5 * SIDE + 9, 6 * SIDE + 3)
"""Shape of a map that meets more tiles than a kernel is called with at once."""


@pytest.fixture
def cells():
    """Return the cells of a map: patches of places, each of one class."""
    rng = np.random.default_rng(0)
    cells = np.zeros(SHAPE, CELL)
    patches = rng.integers(-1, 90, (SHAPE[0] // 11 + 1, SHAPE[1] // 11 + 1))
    places = patches.repeat(11, 0).repeat(11, 1)[: SHAPE[0], : SHAPE[1]]
    cells["place"], cells["class"] = places, np.where(places < 0, 0, 1 + places % 2)
    return cells


def tiles_of(cells):
    tiles = Tiles({})
    tiles.write(Box(0, 0, *SHAPE).moved(*LOW), cells)
    tiles.close()
    return tiles


def inside(box):
    return box.inside(Box(0, 0, *SHAPE).moved(*LOW))


BOXES = [Box(0, 0, *SHAPE).moved(*LOW), Box(-64, -64, 0, 0), Box(-3, -2, 5, 200), Box(1, 1, 2, 2)]


@pytest.mark.parametrize("box", BOXES)
def test_a_window_has_the_cells_of_the_map(cells, box):
    place, of_class = tiles_of(cells).planes(box)
    assert np.array_equal(place, cells["place"][inside(box)])
    assert np.array_equal(of_class, cells["class"][inside(box)])


@pytest.mark.parametrize("box", BOXES)
def test_cells_that_differ_are_found_in_a_box_alone(cells, box):
    classes = np.random.default_rng(1).integers(0, 3, SHAPE).astype(np.uint8)
    found = tiles_of(cells).differing([box], classes, LOW)
    differs = np.zeros(SHAPE, np.bool_)
    differs[inside(box)] = (classes != cells["class"])[inside(box)]
    rows, cols = np.nonzero(differs)
    order = np.lexsort((found.col, found.row))
    assert np.array_equal(found.row[order] - LOW[0], rows)
    assert np.array_equal(found.col[order] - LOW[1], cols)
    assert np.array_equal(found.place[order], cells["place"][differs])
    assert np.array_equal(found.of_class[order], classes[differs])


@pytest.mark.parametrize("box", BOXES)
def test_cells_that_are_put_move_between_places_and_leave_the_version_before(cells, box):
    before = tiles_of(cells)
    after = before.next_version()
    now = cells.copy()
    now["place"][inside(box)] = np.random.default_rng(2).integers(-1, 9, box.shape)
    now["class"][inside(box)] = now["place"][inside(box)] >= 0
    after.put(box, (now["place"][inside(box)].copy(), now["class"][inside(box)].copy()))
    moved = now["place"] != cells["place"]
    pairs = np.stack([cells["place"][moved], now["place"][moved]], axis=1)
    pairs, counts = np.unique(pairs, axis=0, return_counts=True)
    assert np.array_equal(after.moved(before), np.column_stack([pairs, counts]))
    after.close()
    whole = BOXES[0]
    assert np.array_equal(after.planes(whole)[0], now["place"])
    assert np.array_equal(after.planes(whole)[1][moved], now["class"][moved])
    assert np.array_equal(before.planes(whole)[0], cells["place"])
    old, new = before.arrays(), after.arrays()
    assert not any(array.flags.writeable for tile in new.values() for array in tile)
    touched = {key for key in old if new[key] is not old[key]}
    rows, cols = np.nonzero(moved)
    tiles_moved = np.stack([rows + LOW[0], cols + LOW[1]], axis=1) // SIDE
    assert touched == {tuple(key) for key in np.unique(tiles_moved, axis=0).tolist()}


def test_a_place_all_of_whose_cells_change_class_keeps_its_number_and_has_the_class():
    classes = np.ones((6, 6), np.uint8)
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(classes), merge_distance_m=20.0)
    update = OnlinePyramid.of(pyramid).update(occupancy_grid(2 * classes))
    assert (update.changed, update.born, update.died) == ((0,), (), ())
    assert len(update.version.pyramid) > 1  # its cells are compared with the grid


@pytest.mark.parametrize("again", [copy.deepcopy, lambda this: pickle.loads(pickle.dumps(this))])  # noqa: S301
def test_a_copy_of_a_version_follows_the_map_too(again):
    classes = np.ones((200, 300), np.uint8)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(occupancy_grid(classes)))
    classes[20:180, 140] = 0
    update = again(version).update(occupancy_grid(classes))
    expected = version.update(occupancy_grid(classes))
    assert update.changed == expected.changed
    assert np.array_equal(update.version.number_of, expected.version.number_of)
    arrays = update.version.state.tiles.arrays().values()
    assert not any(array.flags.writeable for tile in arrays for array in tile)
