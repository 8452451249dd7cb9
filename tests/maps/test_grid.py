"""Frame, thresholds and inflation; areas as boxes of cells; runs of consecutive numbers."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage
from shapely import Polygon, box

import hybridnav as hn
from hybridnav._base.rows import in_runs, unique_rows
from hybridnav.errors import InvalidValueError
from hybridnav.maps import MAX_CELLS, CellClass, Frame, OccupancyGrid
from hybridnav.maps.areas import box_of_area
from hybridnav.maps.clearance import clearance_cells, within_radius
from hybridnav.maps.geometry import centres, position_of
from tests.strategies import class_grids, tried

FREE, OCCUPIED, UNEXPLORED = CellClass.FREE, CellClass.OCCUPIED, CellClass.UNEXPLORED


def _grid(rows, frame=None, **settings):
    return OccupancyGrid(np.array(rows, dtype=np.float32), frame or Frame(), **settings)


coordinates = st.floats(-1000, 1000)
frames = st.builds(
    Frame, st.floats(0.001, 10), st.tuples(coordinates, coordinates), st.floats(-math.pi, math.pi)
)
cells = hnp.arrays(
    np.int64, st.tuples(st.integers(1, 8), st.just(2)), elements=st.integers(0, 5000)
)


@given(frames, cells)
@example(Frame(0.0504, (25.9, 48.5), 3.14), np.array([[0, 0], [1299, 1729]]))
@example(Frame(0.05, (-12.5, -12.5), 0.0), np.array([[0, 0], [499, 499]]))
def test_a_cell_holds_its_own_centre(frame, cells):
    np.testing.assert_array_equal(frame.cells_of(frame.points_of(cells)), cells)


@given(frames, cells)
def test_compiled_centres_are_those_of_the_frame(frame, cells):
    found = centres(cells, frame.for_kernels)
    np.testing.assert_allclose(found, frame.points_of(cells), rtol=1e-14, atol=1e-9)


@given(frames, cells, st.floats(0.001, 0.999), st.floats(0.001, 0.999))
def test_every_point_inside_a_cell_belongs_to_it(frame, cells, up, along):
    points = frame.points_of_grid(cells + np.array([up, along]))
    np.testing.assert_array_equal(frame.cells_of(points), cells)


@given(frames, cells)
def test_neighbouring_centres_are_one_resolution_apart_along_the_yaw(frame, cells):
    here = frame.points_of(cells)
    east = frame.points_of(cells + np.array([0, 1])) - here
    north = frame.points_of(cells + np.array([1, 0])) - here
    heading = frame.resolution_m * np.array([math.cos(frame.yaw_rad), math.sin(frame.yaw_rad)])
    np.testing.assert_allclose(east, np.broadcast_to(heading, east.shape), atol=1e-9)
    left = np.array([-heading[1], heading[0]])
    np.testing.assert_allclose(north, np.broadcast_to(left, north.shape), atol=1e-9)


def test_a_quarter_turn_sends_columns_up_and_rows_left():
    frame = Frame(0.5, (10.0, 20.0), math.pi / 2)
    np.testing.assert_allclose(frame.points_of_grid([0, 0]), [10.0, 20.0])
    np.testing.assert_allclose(frame.points_of([0, 3]), [9.75, 21.75])
    np.testing.assert_allclose(frame.points_of([3, 0]), [8.25, 20.25])


def test_a_point_on_a_side_belongs_to_the_higher_cell_and_before_the_origin_to_a_negative_one():
    frame = Frame(0.5, (1.0, 2.0))
    points = [[1.0, 2.0], [1.5, 2.0], [1.0, 2.5], [0.999, 2.0], [1.0, 1.999]]
    expected = [[0, 0], [0, 1], [1, 0], [0, -1], [-1, 0]]
    np.testing.assert_array_equal(frame.cells_of(points), expected)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ((0.0,), "resolution"),
        ((-0.05,), "resolution"),
        ((math.nan,), "resolution"),
        ((math.inf,), "resolution"),
        ((0.05, (math.nan, 0.0)), "origin"),
        ((0.05, (0.0, 0.0), math.inf), "yaw"),
    ],
)
def test_a_frame_needs_finite_values(arguments, word):
    with pytest.raises(InvalidValueError, match=word):
        Frame(*arguments)


@pytest.mark.parametrize("probability", [[["wall"]], [[None, {}]], [[0.0], [0.0, 1.0]]])
def test_probabilities_that_are_no_numbers_are_refused_in_one_line(probability):
    with pytest.raises(InvalidValueError, match="occupancy probabilities are") as error:
        OccupancyGrid(probability)
    assert "\n" not in str(error.value)


def test_points_must_be_finite():
    with pytest.raises(InvalidValueError, match="finite"):
        Frame().cells_of([0.0, math.nan])


masks = hnp.arrays(np.bool_, hnp.array_shapes(min_dims=2, max_dims=2, max_side=12))


def _brute_force(occupied, radius_cells):
    rows, cols = np.indices(occupied.shape)
    within = np.zeros_like(occupied)
    for row, col in np.argwhere(occupied):
        within |= (rows - row) ** 2 + (cols - col) ** 2 <= radius_cells**2 * (1 + 1e-9)
    return within


# Radii that are themselves distances between centres, and others.
@given(masks, st.one_of(st.floats(0, 20), st.integers(0, 150).map(math.sqrt)))
def test_inflation_equals_brute_force(occupied, radius_cells):
    before = occupied.copy()
    within = within_radius(occupied, radius_cells=radius_cells)
    np.testing.assert_array_equal(within, _brute_force(occupied, radius_cells))
    np.testing.assert_array_equal(occupied, before)


@pytest.mark.parametrize("radius_cells", [63.5, 64.0, 64.1, 80.0, 119.0])
def test_inflation_by_large_radii_equals_brute_force(radius_cells):
    occupied = np.zeros((150, 90), dtype=np.bool_)
    occupied[60, 2] = occupied[3, 5] = True
    within = within_radius(occupied, radius_cells=radius_cells)
    assert not within.all()
    np.testing.assert_array_equal(within, _brute_force(occupied, radius_cells))


def test_a_distance_equal_to_the_radius_is_blocked_despite_rounding():
    # 0.25 / 0.05 and 0.3 / 0.1 fall short of 5 and 3 as floats.
    for resolution_m, radius_m, reach in [(0.05, 0.25, 5), (0.1, 0.3, 3), (0.1, 0.7, 7)]:
        grid = _grid([[1.0] + 19 * [0.0]], Frame(resolution_m), robot_radius_m=radius_m)
        blocked = np.flatnonzero(grid.classes[0] == OCCUPIED)
        np.testing.assert_array_equal(blocked, np.arange(reach + 1))


def test_neither_unexplored_cells_nor_the_border_inflate():
    grid = _grid([[0.0, 0.0, math.nan, 0.0, 0.0, 0.0, 0.0, 1.0]], robot_radius_m=2.0)
    expected = [FREE, FREE, UNEXPLORED, FREE, FREE, OCCUPIED, OCCUPIED, OCCUPIED]
    np.testing.assert_array_equal(grid.classes, [expected])
    assert grid.class_counts() == {"free": 4, "unexplored": 1, "occupied": 1, "blocked": 2}


def test_inflation_blocks_unexplored_cells_too_and_keeps_what_was_measured():
    grid = _grid([[1.0, math.nan, math.nan]], robot_radius_m=1.0)
    np.testing.assert_array_equal(grid.classes, [[OCCUPIED, OCCUPIED, UNEXPLORED]])
    np.testing.assert_array_equal(grid.measured, [[OCCUPIED, UNEXPLORED, UNEXPLORED]])


def test_thresholds_are_inclusive_as_float32():
    # 0.2 as float32 lies above 0.2 as float64: a pixel of 204 is free at free_thresh 0.2.
    probability = [[0.2, 0.65, 0.5, 0.0, 1.0, math.nan]]
    grid = _grid(probability, free_threshold=0.2, occupied_threshold=0.65)
    expected = [FREE, OCCUPIED, UNEXPLORED, FREE, OCCUPIED, UNEXPLORED]
    np.testing.assert_array_equal(grid.classes, [expected])


def test_never_measured_is_unexplored_at_the_widest_thresholds():
    grid = _grid([[math.nan, 0.0, 1.0]], free_threshold=0.999, occupied_threshold=1.0)
    np.testing.assert_array_equal(grid.classes, [[UNEXPLORED, FREE, OCCUPIED]])


def test_a_grid_neither_shares_nor_lends_its_arrays():
    probability = np.zeros((2, 3), dtype=np.float32)
    grid = OccupancyGrid(probability)
    probability[:] = 1
    assert grid.probability.max() == 0
    for array in (grid.probability, grid.measured, grid.classes):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1


@pytest.mark.parametrize(
    ("probability", "settings", "word"),
    [
        (np.zeros((0, 3)), {}, "row"),
        (np.zeros(3), {}, "shape"),
        (np.full((1, 1), 1.5), {}, "probabilities"),
        (np.full((1, 1), -0.5), {}, "probabilities"),
        (np.full((1, 1), math.inf), {}, "probabilities"),
        (np.zeros((1, 1)), {"free_threshold": 0.7}, "thresholds"),
        (np.zeros((1, 1)), {"free_threshold": -0.1}, "thresholds"),
        (np.zeros((1, 1)), {"free_threshold": math.nan}, "thresholds"),
        (np.zeros((1, 1)), {"occupied_threshold": 1.1}, "thresholds"),
        (np.zeros((1, 1)), {"robot_radius_m": -0.1}, "radius"),
        (np.zeros((1, 1)), {"robot_radius_m": math.nan}, "radius"),
    ],
)
def test_a_grid_refuses_what_makes_no_sense(probability, settings, word):
    with pytest.raises(InvalidValueError, match=word) as caught:
        OccupancyGrid(probability, **settings)
    assert "\n" not in str(caught.value)


def test_the_darts_of_the_largest_grid_have_numbers_in_32_bits():
    assert MAX_CELLS >= 16_384**2
    assert 4 * MAX_CELLS < 2**31


FRAMES = [hn.Frame(), hn.Frame(0.05, (-3.0, 7.5), 0.3), hn.Frame(0.1, (4e5, -5e6), -2.5)]
POSITIONS = np.random.default_rng(3).uniform(-40, 40, (4, 5, 2))


@pytest.mark.parametrize("frame", FRAMES)
def test_positions_come_back_from_their_points_in_any_shape(frame: hn.Frame) -> None:
    points = frame.points_of_grid(POSITIONS)
    assert frame.positions_of(points) == pytest.approx(POSITIONS, abs=1e-6)
    assert np.array_equal(frame.positions_of(points[1]), frame.positions_of(points)[1])
    assert np.array_equal(frame.cells_of(points), np.floor(POSITIONS))


@pytest.mark.parametrize("frame", FRAMES)
def test_one_point_is_converted_like_many_and_in_kernels(frame: hn.Frame) -> None:
    points = frame.points_of_grid(POSITIONS).reshape(-1, 2)
    many = frame.positions_of(points)
    assert np.array_equal([frame.position_of(x, y) for x, y in points.tolist()], many)
    assert np.array_equal([position_of(x, y, frame.for_kernels) for x, y in points], many)


@pytest.mark.parametrize("frame", FRAMES)
def test_axes_and_rates_describe_one_cell_and_one_metre(frame: hn.Frame) -> None:
    corner, up, along = frame.points_of_grid([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert frame.axes_m == pytest.approx(np.stack([up, along]) - corner, abs=1e-8)
    metre = frame.positions_of(corner + np.eye(2)) - frame.positions_of(corner)
    assert frame.per_metre == pytest.approx(metre.T, abs=1e-6)


SHAPE = (7, 9)
COORDINATES = st.floats(-3, 12) | st.integers(-3, 12).map(float)


def cells_of(found: tuple[int, int, int, int]) -> Any:
    """The cells of a box, bool (rows, cols)."""
    inside = np.zeros(SHAPE, np.bool_)
    inside[slice(*found[:2]), slice(*found[2:])] = True
    return inside


@tried(100, st.lists(COORDINATES, min_size=4, max_size=4), st.sampled_from([0.0, 0.7]))
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
    with pytest.raises(hn.errors.InvalidValueError, match="make it for this map"):
        box_of_area(mask.T, frame, SHAPE)


runs = st.lists(st.tuples(st.integers(0, 10**12), st.integers(0, 9)), max_size=8)


@given(runs)
def test_the_numbers_of_runs_follow_one_another(drawn: list[tuple[int, int]]) -> None:
    start, length = np.array(drawn, dtype=np.int64).reshape(-1, 2).T
    expected = [number for first, n in drawn for number in range(first, first + n)]
    found = in_runs(start, length)
    assert found.dtype == np.int64
    assert found.tolist() == expected


@pytest.mark.parametrize("kind", [np.int32, np.int64, np.float64])
@given(st.integers(1, 3), st.lists(st.integers(-2, 2), max_size=60))
def test_distinct_rows_are_those_of_numpy(kind: type, width: int, drawn: list[int]) -> None:
    rows: Any = np.array(drawn[: len(drawn) // width * width], dtype=kind).reshape(-1, width)
    found = unique_rows(rows)
    if not len(rows):
        assert [len(part) for part in found] == [0, 0, 0, 0]
        return
    expected = np.unique(rows, axis=0, return_index=True, return_inverse=True, return_counts=True)
    for one, other in zip(found, expected, strict=True):
        assert one.tolist() == other.reshape(one.shape).tolist()
    assert found.rows.dtype == kind


@given(class_grids(24))
def test_clearances_are_those_of_scipy_to_the_last_bit(classes):
    """scipy 1.17.1, ndimage.distance_transform_edt, which needs an occupied cell."""
    occupied = classes == 0
    found = clearance_cells(occupied)
    expected = ndimage.distance_transform_edt(~occupied) if occupied.any() else np.inf
    assert (found == expected).all()
