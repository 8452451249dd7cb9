"""Layers of costs: inflation by its formula, refusals, joining, costs along polylines."""

import itertools
import math
import re
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.maps.costs import cost_along
from tests.layers import grid_of, layer_of
from tests.strategies import seeds, tried

# nav2_costmap_2d/inflation_layer.hpp, InflationLayer::computeCost, worked out by hand for
# nav2_bringup's inflation_radius 0.70 and cost_scaling_factor 3.0, cells of 0.05 m and an inscribed
# radius of 0.25 m: cells from the obstacle -> cost.
#   0: LETHAL_OBSTACLE; up to 5 (0.25 m): INSCRIBED_INFLATED_OBSTACLE;
#   then (unsigned char)(252 * exp(-3.0 * (0.05 n - 0.25))): 252 * 0.860708 = 216.898, ...
NAV2 = {0: 254, 1: 253, 5: 253, 6: 216, 7: 186, 8: 160, 9: 138, 10: 119, 11: 102, 12: 88, 13: 75,
        14: 65, 15: 0}  # fmt: skip
# Off the axes, (rows, columns) -> cost: sqrt(5^2 + 5^2) = 7.07107 cells, 0.353553 m, and so on.
NAV2_OFF_AXIS = {(3, 4): 253, (4, 4): 228, (5, 5): 184, (9, 9): 79, (6, 8): 119, (10, 10): 0}


def one_obstacle(side: int = 41, resolution_m: float = 0.05, radius_m: float = 0.25) -> Any:
    probability = np.zeros((side, side))
    probability[side // 2, side // 2] = 1.0
    return grid_of(probability, hn.Frame(resolution_m), robot_radius_m=radius_m)


def factor(cost: int, multiplier: float = 2.0) -> float:
    """Factor of a cost, rounded down to 2^-14."""
    return math.floor((1 + multiplier * cost / 252) * 2**14) / 2**14


def test_clearance_is_nav2s_inflation_cell_by_cell() -> None:
    factors = hn.CostLayer.clearance(one_obstacle()).factors
    for cells, cost in NAV2.items():
        assert factors[20, 20 + cells] == factors[20 - cells, 20] == factor(cost)
    for (rows, cols), cost in NAV2_OFF_AXIS.items():
        assert factors[20 + rows, 20 - cols] == factor(cost)


@pytest.mark.parametrize("radius_m", [0.0, 0.1, 0.4])
def test_distances_are_from_measured_obstacles_whatever_the_robots_radius(radius_m: float) -> None:
    factors = hn.CostLayer.clearance(one_obstacle(radius_m=radius_m), inscribed_radius_m=0.25)
    assert (factors.factors == hn.CostLayer.clearance(one_obstacle()).factors).all()


def test_the_inscribed_radius_is_the_robots_by_default() -> None:
    for radius_m in (0.0, 0.1, 0.4):
        layer = hn.CostLayer.clearance(one_obstacle(radius_m=radius_m))
        assert layer.source["inscribed_radius_m"] == radius_m
        given_m = hn.CostLayer.clearance(one_obstacle(), inscribed_radius_m=radius_m)
        assert (layer.factors == given_m.factors).all()


def nav2_cost(cells: float, resolution_m: float, inscribed_m: float, scaling: float) -> int:
    if cells == 0:
        return 254
    if cells * resolution_m <= inscribed_m:
        return 253
    return int(252 * math.exp(-1.0 * scaling * (cells * resolution_m - inscribed_m)))


@tried(
    60,
    seeds,
    st.sampled_from([0.025, 0.05, 0.1]),
    st.sampled_from([0.0, 0.22, 0.25]),
    st.sampled_from([0.3, 0.55, 0.7, 1.0, 3.3]),
    st.sampled_from([0.0, 1.5, 3.0, 10.0]),
)
def test_every_cell_has_the_cost_of_its_nearest_obstacle(
    seed: int, resolution_m: float, inscribed_m: float, inflation_m: float, scaling: float
) -> None:
    rng = np.random.default_rng(seed)
    probability = rng.choice([0.0, 0.5, 1.0], (14, 15), p=[0.75, 0.2, 0.05])
    grid = grid_of(probability, hn.Frame(resolution_m))
    layer = hn.CostLayer.clearance(
        grid,
        inflation_radius_m=inflation_m,
        scaling=scaling,
        inscribed_radius_m=inscribed_m,
        multiplier=5.0,
    )
    obstacles = np.argwhere(probability == 1.0)
    reach = math.ceil(inflation_m / resolution_m)  # Costmap2D::cellDistance
    for row, col in np.ndindex(*grid.shape):
        cells = min((math.hypot(row - r, col - c) for r, c in obstacles), default=math.inf)
        cost = nav2_cost(cells, resolution_m, inscribed_m, scaling) if cells <= reach else 0
        assert layer.factors[row, col] == factor(cost, 5.0)


def test_unexplored_cells_are_no_obstacles_and_cost_as_free_ones() -> None:
    probability = np.zeros((3, 30))
    probability[1, 0], probability[1, 20:] = 1.0, 0.5
    grid = grid_of(probability, hn.Frame(0.05))
    free = grid_of(np.where(probability == 0.5, 0.0, probability), hn.Frame(0.05))
    assert (hn.CostLayer.clearance(grid).factors == hn.CostLayer.clearance(free).factors).all()


def test_a_map_without_obstacles_costs_its_lengths() -> None:
    grid = grid_of(np.zeros((4, 5)))
    assert (hn.CostLayer.clearance(grid).factors == 1).all()


def test_speed_masks_cost_the_time_that_they_take() -> None:
    grid = grid_of(np.zeros((1, 6)), robot_radius_m=0)
    values = [[0, 50, 80, 100, -1, 75]]
    percent = hn.CostLayer.speed_mask(grid, values)
    assert percent.factors.tolist() == [[1, 2, 5, 1, 1, 4]]  # a limit of 0 % is none, as in Nav2
    metres = hn.CostLayer.speed_mask(
        grid, values, base=0.0, multiplier=0.01, unit="m/s", full_speed_mps=0.8
    )
    expected = [[1, 1.6, 1, 1, 1, 0.8 / 0.75]]
    assert np.abs(metres.factors - expected).max() < 2**-14
    assert (metres.factors <= np.array(expected, np.float32)).all()


def test_keepout_masks_close_cells_and_weigh_lanes() -> None:
    grid = grid_of(np.zeros((1, 5)), robot_radius_m=0)
    layer = hn.CostLayer.keepout_mask(grid, [[0, 20, 99, 100, -1]])
    # round(2.54 * 20) = 51, round(2.54 * 99) = 251, 254 is lethal.
    assert layer.keepout.tolist() == [[False, False, False, True, False]]
    assert layer.closed_flat.tolist() == [3]
    assert layer.factors.tolist() == [[1, factor(51), factor(251), 1, 1]]


def test_a_mask_of_another_frame_counts_where_centres_lie() -> None:
    frame = hn.Frame(0.5, (10.0, -3.0), math.radians(90))
    grid = grid_of(np.zeros((4, 6)), frame, robot_radius_m=0)
    values = np.zeros((7, 9), np.int64)
    mask_frame = hn.Frame(0.3, (8.5, -2.6), math.radians(10))
    values[1:5, 2:7] = 50
    layer = hn.CostLayer.speed_mask(grid, values, mask_frame)
    for cell in np.ndindex(*grid.shape):
        x, y = frame.points_of(cell).tolist()
        row, col = mask_frame.cell_of(x, y)
        inside = 0 <= row < 7 and 0 <= col < 9
        assert layer.factors[cell] == (2 if inside and values[row, col] == 50 else 1)
    assert 1 in layer.factors
    assert 2 in layer.factors


def test_layers_are_joined_and_record_their_sources() -> None:
    first = layer_of(np.array([[1.0, 2.0, 3.0]]), np.array([[True, False, False]]))
    second = layer_of(np.array([[4.0, 1.5, 1.0]]), np.array([[False, False, True]]))
    for joined, expected, kind in (
        (first | second, [[4, 2, 3]], "maximum"),
        (first * second, [[4, 3, 3]], "product"),
    ):
        assert joined.factors.tolist() == expected
        assert joined.closed.tolist() == [[True, False, True]]
        assert joined.source == {"kind": kind, "of": [{"kind": "array"}] * 2}
    assert len((first | second | first).source["of"]) == 3


def test_factors_are_rounded_down_to_units() -> None:
    layer = layer_of(np.array([[1.0, 1.1, 999.99999]]))
    assert (layer.factors <= [[1.0, 1.1, 999.99999]]).all()
    assert layer.units.tolist() == [[2**14, math.floor(1.1 * 2**14), math.floor(999.99999 * 2**14)]]


ARRAYS: list[tuple[Any, str]] = [
    ([[1.0, math.nan]], "factors must be numbers from 1 to 1000, got nan in cell (0, 1)"),
    ([[math.inf, 1.0]], "factors must be numbers from 1 to 1000, got inf in cell (0, 0)"),
    ([[1.0], [-2.0]], "factors must be numbers from 1 to 1000, got -2 in cell (1, 0)"),
    ([[0.999, 1.0]], "factors must be numbers from 1 to 1000, got 0.999 in cell (0, 0)"),
    ([[1e9]], "factors must be numbers from 1 to 1000, got 1e+09 in cell (0, 0)"),
    (
        [1.0, 2.0],
        "factors must be numbers of shape (rows, cols), one for each cell, got shape (2,)",
    ),
    ([[]], "factors must be numbers of shape (rows, cols), one for each cell, got shape (1, 0)"),
    ([["high"]], "factors must be numbers of shape (rows, cols)"),
    ([[1.0], [1.0, 2.0]], "factors must be numbers of shape (rows, cols)"),
    ([[1 + 2j]], "factors must be numbers of shape (rows, cols)"),
    ([[True]], "factors must be numbers of shape (rows, cols)"),
    (None, "factors must be numbers of shape (rows, cols)"),
]


@pytest.mark.parametrize(("given", "message"), ARRAYS)
def test_unusable_factors_are_refused_in_one_line(given: Any, message: str) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match=re.escape(message)) as refused:
        layer_of(given)
    assert "\n" not in str(refused.value)


CALLS: list[tuple[str, Any, str]] = [
    ("clearance", {"scaling": math.nan}, "scaling must be a finite number >= 0, got nan"),
    ("clearance", {"multiplier": -1}, "multiplier must be a finite number >= 0, got -1"),
    ("clearance", {"multiplier": 1e6}, "multiplier must be at most 991"),
    ("clearance", {"inflation_radius_m": math.inf}, "inflation_radius_m must be a finite number"),
    ("clearance", {"inscribed_radius_m": "x"}, "inscribed_radius_m must be a finite number >= 0"),
    ("speed_mask", {"values": [[101, 0]]}, "0 to 100, or -1 for unknown, got 101 in cell (0, 0)"),
    ("speed_mask", {"values": [[0.5, 0.0]]}, "a mask must be integers of shape (rows, cols)"),
    ("speed_mask", {"values": [[0, 0, 0]]}, "a mask of shape (1, 3) is not that of a map of shape"),
    ("speed_mask", {"unit": "m/s"}, "full_speed_mps is needed with the unit m/s"),
    ("speed_mask", {"full_speed_mps": 1.0}, "full_speed_mps does not go with the unit percent"),
    ("speed_mask", {"unit": "mph"}, "the unit of speed limits is percent or m/s, got 'mph'"),
    ("speed_mask", {"base": math.nan}, "base must be a finite number, got nan"),
    ("keepout_mask", {"multiplier": math.inf}, "multiplier must be a finite number >= 0, got inf"),
]


@pytest.mark.parametrize(("name", "wrong", "message"), CALLS)
def test_unusable_settings_are_refused_in_one_line(name: str, wrong: Any, message: str) -> None:
    grid = grid_of(np.zeros((1, 2)), robot_radius_m=0)
    settings = {} if name == "clearance" else {"values": [[0, 0]]}
    with pytest.raises(hn.errors.InvalidValueError, match=re.escape(message)) as refused:
        getattr(hn.CostLayer, name)(grid, **settings | wrong)
    assert "\n" not in str(refused.value)


def test_layers_of_other_shapes_and_closed_cells_of_other_kinds_are_refused() -> None:
    layer = layer_of(np.ones((2, 3)))
    with pytest.raises(hn.errors.InvalidValueError, match="cannot be joined"):
        layer | layer_of(np.ones((3, 2)))
    with pytest.raises(hn.errors.InvalidValueError, match="closed cells must be bool of the shape"):
        layer_of(np.ones((2, 3)), np.zeros((2, 3)))
    with pytest.raises(
        hn.errors.InvalidValueError, match="costs of 3 x 2 cells are not those of a map"
    ):
        layer.check_fits(grid_of(np.zeros((3, 3))))


def test_a_changed_layer_differs_in_the_box_alone() -> None:
    rng = np.random.default_rng(5)
    old = layer_of(rng.uniform(1, 9, (6, 8)), rng.random((6, 8)) < 0.3)
    part = layer_of(rng.uniform(1, 9, (2, 3)), np.eye(2, 3, dtype=np.bool_))
    new = old.changed(part, 1, 4)
    expected = old.factors.copy()
    expected[1:3, 4:7] = part.factors
    np.testing.assert_array_equal(new.factors, expected)
    closed = old.closed.copy()
    closed[1:3, 4:7] = part.closed
    np.testing.assert_array_equal(new.closed, closed)
    np.testing.assert_array_equal(new.closed_flat, np.flatnonzero(closed))
    np.testing.assert_array_equal(new.units, (expected * 2**14).astype(np.int32))
    assert not new.factors.flags.writeable
    back = new.changed(old.part((1, 3, 4, 7)), 1, 4)
    np.testing.assert_array_equal(back.factors, old.factors)
    np.testing.assert_array_equal(back.closed, old.closed)
    for row, col in ((-1, 0), (5, 0), (0, 6), (0, -1)):
        with pytest.raises(
            hn.errors.InvalidValueError, match="do not lie inside costs of 8 x 6 cells"
        ):
            old.changed(part, row, col)


@pytest.mark.parametrize(
    "box",
    [
        *("", "0123", None, 3, 1.5, math.nan, object(), slice(0, 10**30), {}, itertools.count()),
        *((), (0, 1, 0), (0, 1, 0, 1, 1), ("0", "1", "0", "1"), (0.0, 1.0, 0.0, 1.0)),
        *((0, None, 0, 1), (slice(2), slice(2), 0, 1), np.ones((2, 2), dtype=np.int64)),
        *((0, 7, 0, 1), (0, 1, 0, 9), (-1, 1, 0, 1), (1, 1, 0, 1), (2, 1, 0, 1), (0, 1, 3, 2)),
        *((0, 10**30, 0, 1), (0, 1, 0, 10**5000), (-(10**5000), 1, 0, 1)),
    ],
    ids=lambda box: f"{type(box).__name__}",
)
def test_a_part_that_is_no_box_is_refused_in_one_line(box: Any) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="inside costs of 8 x 6 cells") as raised:
        layer_of(np.ones((6, 8))).part(box)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 250


@pytest.mark.parametrize(
    "where",
    [
        *((None, 0), ("0", 0), (0, 1.0), (0, math.nan), (object(), 0), (slice(10**30), 0)),
        *(([0], 0), (0, np.zeros(2, dtype=np.int64)), (10**30, 0), (0, -(10**5000)), (10**5000, 0)),
    ],
    ids=lambda where: f"{type(where[0]).__name__}-{type(where[1]).__name__}",
)
def test_a_change_at_no_cell_of_the_layer_is_refused_in_one_line(where: Any) -> None:
    layer = layer_of(np.ones((6, 8)))
    with pytest.raises(hn.errors.InvalidValueError, match=r"two whole|do not lie") as raised:
        layer.changed(layer_of(np.ones((1, 1))), *where)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 250


@pytest.mark.parametrize("part", [None, "layer", 1.5, np.ones((1, 1)), [[1.0]], 10**5000], ids=type)
def test_a_change_to_no_layer_is_refused_in_one_line(part: Any) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="expected a CostLayer") as raised:
        layer_of(np.ones((6, 8))).changed(part, 0, 0)
    assert "\n" not in str(raised.value)


def test_sources_do_not_grow_with_every_change() -> None:
    layer = layer_of(np.ones((2, 9)))
    for at in range(30):
        part = hn.CostLayer(np.full((1, 1), 2.0, np.float32), None, {"kind": "door", "number": at})
        layer = layer.changed(part, 0, at % 9)
    numbers = [source.get("number") for source in layer.source["of"]]
    assert numbers == [None, *range(23, 30)]
    assert layer.source["left_out"] == 23
    again = layer.changed(part, 1, 0)
    assert again.source == layer.source


def test_layers_with_other_contents_have_other_digests() -> None:
    factors, closed = np.full((2, 3), 2.0), np.zeros((2, 3), np.bool_)
    layer = layer_of(factors)
    closed[0, 0] = True
    others = [
        layer_of(factors.T),
        layer_of(factors + 2**-14),
        layer_of(factors, closed),
        layer_of(factors, closed[::-1]),
    ]
    assert len({each.digest for each in (layer, *others)}) == 5
    assert layer_of(factors.copy()).digest == layer.digest
    assert layer.changed(layer_of(np.full((1, 1), 3.0)), 0, 0).digest != layer.digest


ROWS, COLS = 6, 8


def by_shapely(factors: Any, points: Any) -> float:
    """Sum of the lengths inside each square; what lies on a line between two counts for the larger.

    Squares are shrunk to be half open for that: a segment on their line is counted once.
    """
    total = 0.0
    for tail, head in itertools.pairwise(points):
        segment = shapely.LineString([tail, head])
        level = [tail[k] == head[k] and tail[k] == int(tail[k]) for k in range(2)]
        for row, col in np.ndindex(ROWS, COLS):
            length = shapely.intersection(shapely.box(col, row, col + 1, row + 1), segment).length
            if not any(level):
                total += length * factors[row, col]
                continue
            # On a line: counted by the upper cell, for both.
            beside = (row, col - 1) if level[0] else (row - 1, col)
            is_lower = (col if level[0] else row) + 1 == (tail[0] if level[0] else tail[1])
            if is_lower and (tail[0] if level[0] else tail[1]) < (COLS if level[0] else ROWS):
                continue
            factor = factors[row, col]
            if not is_lower and min(beside) >= 0:
                factor = max(factor, factors[beside])
            total += length * factor
    return total


coordinates = st.one_of(
    st.integers(0, 12).map(lambda n: n / 2),
    st.integers(0, 6 * 2**20).map(lambda n: n / 2**20),
    st.floats(0, 6),
)


@tried(150, st.lists(st.tuples(coordinates, coordinates), min_size=2, max_size=5), seeds)
def test_the_cost_is_the_exact_integral(points: Any, seed: int) -> None:
    factors = np.floor(np.random.default_rng(seed).uniform(1, 9, (ROWS, COLS)) * 2**14) / 2**14
    grid = grid_of(np.zeros((ROWS, COLS)), robot_radius_m=0)
    layer = layer_of(factors)
    rounded = [tuple(math.floor(c * 2**24 + 0.5) / 2**24 for c in point) for point in points]
    cost = cost_along(grid, layer, points)
    assert cost == pytest.approx(by_shapely(factors, rounded), rel=1e-9, abs=1e-9)
    assert cost_along(grid, layer, points[::-1]) == pytest.approx(cost, rel=1e-12, abs=1e-12)


@tried(60, seeds)
def test_paths_of_cells_cost_what_their_moves_cost(seed: int) -> None:
    rng = np.random.default_rng(seed)
    steps = rng.integers(-1, 2, (40, 2))
    cells = [np.array([10, 10])]
    for step in steps[steps.any(axis=1)]:
        if ((cells[-1] + step >= 0) & (cells[-1] + step < 21)).all():
            cells.append(cells[-1] + step)
    path = np.array(cells)
    frame = hn.Frame(0.05, (3.0, -2.0), 0.4)
    grid = grid_of(np.zeros((21, 21)), frame, robot_radius_m=0)
    layer = layer_of(rng.uniform(1, 5, (21, 21)))
    along = layer.factors[path[:, 0], path[:, 1]].astype(float)
    lengths = np.hypot(*np.diff(path, axis=0).T) * 0.05
    moves = float((lengths * (along[1:] + along[:-1]) / 2).sum())
    assert layer.cost_of_cells(path) * 0.05 == pytest.approx(moves, rel=1e-12)
    assert cost_along(grid, layer, frame.points_of(path)) == pytest.approx(moves, rel=1e-6)


def test_a_point_costs_nothing_and_a_diagonal_passes_no_side_cell() -> None:
    grid = grid_of(np.zeros((2, 2)), robot_radius_m=0)
    layer = layer_of(np.array([[1.0, 900.0], [900.0, 3.0]]))
    assert cost_along(grid, layer, [(0.3, 0.4)]) == 0
    assert cost_along(grid, layer, [(0.5, 0.5), (1.5, 1.5)]) == pytest.approx(2 * math.sqrt(2))
    assert cost_along(grid, layer, [(1.0, 0.0), (1.0, 1.0)]) == 900


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0.5, 0.5), (2.5, 0.5)], "point (2.500, 0.500) m lies outside the map"),
        ([(0.5, math.nan)], "points need finite coordinates in metres"),
        (
            [0.5, 0.5],
            "points must be finite numbers (x, y) of shape (n, 2), n >= 1, got shape (2,)",
        ),
        (np.empty((0, 2)), "points must be finite numbers"),
        ([(0.5, 0.5), (0.5,)], "give each point two"),
        ("home", "give each point two"),
    ],
)
def test_unusable_points_are_refused(points: Any, message: str) -> None:
    grid = grid_of(np.zeros((2, 2)), robot_radius_m=0)
    with pytest.raises(hn.errors.InvalidValueError, match=re.escape(message)):
        cost_along(grid, layer_of(np.ones((2, 2))), points)
