"""Tables of places, tiles and layers of costs that follow a map; updates that are interrupted."""

import copy
import pickle

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live import OnlinePyramid, carry_costs
from hybridnav.ext.live.state import PLACE, PlaceTable
from hybridnav.ext.live.tiles import SIDE, Box, Tiles
from tests.interrupts import Struck, lines_of, timer
from tests.strategies import occupancy_grid, seeds, tried

LOW = (-70, -130)
SHAPE = (5 * SIDE + 9, 6 * SIDE + 3)
"""Shape of a map that meets more tiles than a kernel is called with at once."""


@pytest.fixture
def cells():
    """Return the cells of a map: patches of places, each of one class."""
    rng = np.random.default_rng(0)
    cells = np.zeros(SHAPE, [("place", np.int32), ("class", np.uint8)])
    patches = rng.integers(-1, 90, (SHAPE[0] // 11 + 1, SHAPE[1] // 11 + 1))
    places = patches.repeat(11, 0).repeat(11, 1)[: SHAPE[0], : SHAPE[1]]
    cells["place"], cells["class"] = places, np.where(places < 0, 0, 1 + places % 2)
    return cells


def tiles_of(cells):
    tiles = Tiles()
    tiles.put(Box(0, 0, *SHAPE).moved(*LOW), (cells["place"].copy(), cells["class"].copy()))
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


def grid_of(classes, south=0, west=0):
    probability = np.array([1.0, 0.0, 0.5], np.float32)[classes]
    frame = hn.Frame(0.5, (-0.5 * west, -0.5 * south))
    return hn.OccupancyGrid(probability, frame, robot_radius_m=0)


@st.composite
def changes(draw):
    """A map, the map later, grown on all sides, and where the first lies in it."""
    rng = np.random.default_rng(draw(seeds))
    rows, cols = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    south, north, west, east = draw(st.tuples(*[st.integers(0, 3)] * 4))
    before = rng.choice(3, (rows, cols), p=[0.15, 0.75, 0.1])
    after = rng.choice(3, (rows + south + north, cols + west + east), p=[0.15, 0.75, 0.1])
    inside = np.s_[south : south + rows, west : west + cols]
    after[inside] = np.where(rng.random((rows, cols)) < 0.9, before, after[inside])
    return grid_of(before), grid_of(after, south, west), inside, rng


@tried(100, changes())
def test_factors_and_closed_cells_stay_on_their_cells(case):
    before, after, inside, rng = case
    layer = hn.CostLayer(rng.integers(1, 9, before.shape), rng.random(before.shape) < 0.3)
    carried = carry_costs(layer, before, after)
    factors, closed = np.ones(after.shape), np.zeros(after.shape, bool)
    factors[inside], closed[inside] = layer.factors, False if layer.closed is None else layer.closed
    assert np.array_equal(carried.layer.factors, factors)
    found = np.zeros(after.shape, bool) if carried.layer.closed is None else carried.layer.closed
    assert np.array_equal(found, closed)
    assert not carried.outdated.any()
    assert carried.layer.source == layer.source


@tried(100, changes(), st.sampled_from([0.0, 0.7, 1.5]))
def test_clearance_is_that_of_the_newer_map_and_outdated_where_it_was_joined(case, radius_m):
    before, after, inside, rng = case
    clear = {"inflation_radius_m": radius_m, "multiplier": 3.0}
    alone = hn.CostLayer.clearance(before, **clear)
    fresh = hn.CostLayer.clearance(after, **clear)
    carried = carry_costs(alone, before, after)
    assert np.array_equal(carried.layer.factors, fresh.factors)
    assert not carried.outdated.any()
    own = rng.integers(1, 5, before.shape)
    padded = np.ones(after.shape)
    padded[inside] = own
    joined = carry_costs(alone | hn.CostLayer(own), before, after)
    expected = (fresh | hn.CostLayer(padded)).factors
    known = ~joined.outdated
    assert np.array_equal(joined.layer.factors[known], expected[known])


def test_costs_of_another_map_are_refused_in_one_line():
    before, after = grid_of(np.ones((3, 3), int)), grid_of(np.ones((2, 3), int))
    layer = hn.CostLayer(np.ones((3, 3), np.float32))
    for wrong, grids in (
        (hn.CostLayer(np.ones((2, 2), np.float32)), (before, before)),
        (layer, (before, after)),
    ):
        with pytest.raises(InvalidValueError, match="cells") as error:
            carry_costs(wrong, *grids)
        assert "\n" not in str(error.value)


def test_the_table_forgets_places_that_are_no_more():
    table, first = PlaceTable(), 0
    row = np.zeros(10, PLACE)
    row["area"] = 1
    for _ in range(300):
        table = table.next_version()
        table.drop(table.numbers())
        numbers = table.append(first, row)
        first += 10
        table.close()
    assert table.numbers() == numbers.tolist()
    assert len(table.columns()[0]) < 600


def state_of(version):
    state = version.state
    tiles = {
        key: [values.tobytes() for values in tile] for key, tile in state.tiles.arrays().items()
    }
    numbers = state.places.numbers()
    rows = state.places.read(numbers)
    columns = {name: rows[name].tolist() for name in rows.dtype.names}
    return tiles, numbers, columns


@pytest.fixture
def change():
    """Return a version, and a grid on which places die, split and merge."""
    rng = np.random.default_rng(4)
    classes = np.where(rng.random((40, 90)) < 0.05, 0, 1).astype(np.uint8)
    grid = occupancy_grid(classes)
    changed = classes.copy()
    changed[10:14, 20:70] = 0
    changed[30:38, 5:60] = 1
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid, merge_distance_m=8.0))
    return version, occupancy_grid(changed)


def test_an_interrupt_before_any_line_leaves_the_old_version(change):
    version, grid = change
    expected = state_of(version.update(grid).version)
    before = state_of(version)
    n_lines = lines_of(lambda: version.update(grid))
    rng = np.random.default_rng(0)
    for line in rng.integers(1, n_lines + 1, 40).tolist():
        with pytest.raises(Struck):
            lines_of(lambda: version.update(grid), strike_at=line)
        assert state_of(version) == before
    assert state_of(version.update(grid).version) == expected


def test_an_interrupt_by_a_timer_leaves_the_old_version_or_returns_the_new_one(change):
    version, grid = change
    expected = state_of(version.update(grid).version)
    before = state_of(version)
    struck = 0
    for delay_s in np.linspace(1e-4, 2e-2, 40).tolist():
        try:
            with timer(delay_s):
                after = version.update(grid).version
        except Struck:
            struck += 1
        else:
            assert state_of(after) == expected
        assert state_of(version) == before
    assert struck > 0
    assert state_of(version.update(grid).version) == expected
