"""Plans past sides with a direction: their costs against scipy on directed moves, for every preset
that plans on cells."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from scipy import sparse
from scipy.sparse import csgraph

import hybridnav as hn
from hybridnav.errors import InvalidValueError, MapWarning
from hybridnav.refine.one_way import on_grain, wrong_at
from hybridnav.search.directed import DirectedSides
from hybridnav.search.found import ClosedCells
from tests.closures.test_one_way import STEPS, forbidden_by
from tests.oracle.grid import assert_legal, move_graph
from tests.plans import PLAIN, PRESETS, TWO_ROOMS, map_of, points_in, scene_map
from tests.strategies import Scene, occupancy_grid, scenes, seeds

SEED = seeds


def drawn_sides(grid: hn.OccupancyGrid, seed: int) -> DirectedSides:
    """One to six chains of sides: lines, some of them parts of others or turned round."""
    rng = np.random.default_rng(seed)
    high = np.array(grid.shape)[::-1]
    found: list[hn.OneWay] = []
    while not found:
        for _ in range(int(rng.integers(1, 7))):
            corners = rng.integers(0, high + 1, (int(rng.integers(2, 4)), 2)).astype(float)
            if rng.random() < 0.5:  # along rows or columns, as doors are
                corners[:, int(rng.integers(2))] = corners[0, 0]
                corners = np.clip(corners, 0, high)
            line = hn.OneWay(lines=[grid.frame.points_of_grid(corners[:, ::-1])])
            try:
                line.on(grid)
            except InvalidValueError:  # of no length, or along the edge of the map
                continue
            found.append(line)
        if min(grid.shape) == max(grid.shape) == 1:
            return hn.OneWay().on(grid)
    one_way = found[0]
    for other in found[1:]:
        one_way |= other
    return one_way.on(grid)


def directed_graph(enterable: Any, forbidden: Any) -> Any:
    """The legal moves, in both directions but for those that are forbidden."""
    half = move_graph(enterable).tocoo()
    tails, heads = np.concatenate([[half.row, half.col], [half.col, half.row]], axis=1)
    cols = enterable.shape[1]
    step = {step: k for k, step in enumerate(STEPS)}
    k = [
        step[a // cols - b // cols, a % cols - b % cols]
        for a, b in zip(heads.tolist(), tails.tolist(), strict=True)
    ]
    left = (forbidden.ravel()[tails] >> np.array(k, dtype=np.uint8) & 1) == 0
    weights = np.tile(half.data, 2)
    shape = enterable.size, enterable.size
    return sparse.coo_array((weights[left], (tails[left], heads[left])), shape=shape).tocsr()


def lengths_from(graph: Any, shape: tuple[int, int], cell: Any) -> Any:
    flat = cell[0] * shape[1] + cell[1]
    return csgraph.dijkstra(graph, indices=[flat])[0].reshape(shape)


def assert_obeys(cells: Any, enterable: Any, forbidden: Any) -> None:
    assert_legal(cells, enterable)
    for at, step in zip(cells[:-1].tolist(), np.diff(cells, axis=0).tolist(), strict=True):
        assert not forbidden[tuple(at)] >> STEPS.index(tuple(step)) & 1, "crosses the wrong way"


@pytest.mark.parametrize("preset", [*PRESETS, "places"])
@PLAIN
@given(scenes(24), SEED)
def test_plans_obey_and_cost_what_directed_moves_cost(preset: str, scene: Scene, seed: int) -> None:
    topology = scene_map(scene)
    grid, rng = topology.grid, np.random.default_rng(seed)
    sides = drawn_sides(grid, seed)
    closed = ClosedCells(np.empty(0, np.int64), one_way=sides)
    chosen: Any = preset
    if preset == "places":
        paper = hn.load_preset("paper")
        chosen = paper.model_copy(
            update={"planner": paper.planner.model_copy(update={"levels": "places"})}
        )
    planner = hn.HybridPlanner(topology, preset=chosen)
    enterable = grid.enterable()
    forbidden = forbidden_by(sides.sides, grid.shape)
    graph = directed_graph(enterable, forbidden)
    pairs = points_in(grid, rng, 6)
    for start, goal in pairs:
        found = planner.plan(start, goal, blocked=closed, smooth="none")
        first, last = grid.frame.cell_of(*start), grid.frame.cell_of(*goal)
        least = lengths_from(graph, grid.shape, first)[last] * grid.resolution_m
        assert (found.path is None) == math.isinf(least)
        if found.path is None:
            assert found.status is hn.PlanStatus.NO_PATH
            assert found.lower_bound == math.inf
            continue
        assert_obeys(found.path.cells, enterable, forbidden)
        assert found.lower_bound <= least * (1 + 1e-9)
        if preset in {"octile", "grid-astar"}:
            assert found.cost == pytest.approx(least, rel=1e-9, abs=1e-12)
        else:
            assert found.cost >= least * (1 - 1e-9)
    if len(pairs):
        starts, goals = pairs[:, 0], pairs[:, 1]
        batch = planner.plan_many(starts, goals, blocked=closed, smooth="none")
        table = planner.distances(starts, goals, blocked=closed)
        costs = [planner.plan(*pair, blocked=closed).cost for pair in pairs]
        assert batch.cost.tolist() == costs
        assert np.diag(table) == pytest.approx(costs, rel=1e-9)


@pytest.mark.parametrize("preset", [*PRESETS, "robot"])
@PLAIN
@given(scenes(24), SEED)
def test_lines_and_arcs_obey(preset: str, scene: Scene, seed: int) -> None:
    topology = scene_map(scene)
    grid, rng = topology.grid, np.random.default_rng(seed)
    sides = drawn_sides(grid, seed)
    closed = ClosedCells(np.empty(0, np.int64), one_way=sides)
    factors = np.where(rng.random(grid.shape) < 0.3, 3.0, 1.0)
    costs = hn.CostLayer(factors) if preset != "octile" and seed % 2 else None
    planner = hn.HybridPlanner(topology, preset=preset, costs=costs)
    enterable = grid.enterable()
    forbidden = forbidden_by(sides.sides, grid.shape)
    graph = directed_graph(enterable, forbidden)
    smooth: list[Any] = ["line-of-sight", "arcs"] if costs is not None else ["line-of-sight"]
    for start, goal in points_in(grid, rng, 4):
        first, last = grid.frame.cell_of(*start), grid.frame.cell_of(*goal)
        least = lengths_from(graph, grid.shape, first)[last]
        ways: list[Any] = [None, "none"] if preset == "robot" and costs is None else smooth
        for way in ways:
            found = planner.plan(start, goal, blocked=closed, smooth=way)
            assert (found.path is None) == math.isinf(least)
            if found.path is None:
                continue
            assert found.lower_bound <= found.cost * (1 + 1e-9)
            line = found.path.poses(grid.resolution_m / 8)[:, :2]
            line = line if found.path.is_curved else found.path.points
            positions = on_grain(line, grid.frame, grid.shape)
            for k, cell in ((0, first), (-1, last)):
                positions[k] = np.clip(positions[k], cell, np.array(cell) + 1)
            assert wrong_at(sides, enterable, positions, (first, last)) is None


def test_each_preset_goes_in_by_one_door_and_out_by_the_other() -> None:
    topology = map_of(occupancy_grid(TWO_ROOMS), merge_distance_m=3.0)
    low, high = (1, 6, 1, 7), (7, 7, 7, 6)  # in from the west below, out above
    west, east = (2.5, 4.5), (12.5, 4.5)
    for preset in (*PRESETS, "robot", "shortest"):
        planner = hn.HybridPlanner(topology, preset=preset)
        both = hn.OneWay(sides=[low, high])
        there, back = (
            planner.plan(*ends, one_way=both).raise_for_status().path
            for ends in ((west, east), (east, west))
        )
        assert there is not None
        assert back is not None
        rows = [set(path.cells[path.cells[:, 1] == 7][:, 0].tolist()) for path in (there, back)]
        assert rows == [{1}, {7}]
        only_in = hn.OneWay(sides=[low, (7, 6, 7, 7)])
        assert planner.plan(east, west, one_way=only_in).status is hn.PlanStatus.NO_PATH
        assert planner.plan(west, east, one_way=only_in).solved
        assert planner.distance(east, west, one_way=only_in) == math.inf
        table = planner.distances([west, east], [west, east], one_way=both)
        assert table[0, 1] > 0
        assert table[0, 1] == pytest.approx(table[1, 0], rel=0.5)
        # Beside other closures too.
        shut = hn.Blocked(cells=[(1, 7)])
        assert not planner.plan(west, east, one_way=both, blocked=shut).solved
        assert planner.plan(east, west, one_way=both, blocked=shut).solved


def test_near_goals_and_closed_starts_obey() -> None:
    topology = map_of(occupancy_grid(TWO_ROOMS), merge_distance_m=3.0)
    planner = hn.HybridPlanner(topology, preset="grid-astar")
    into_west = hn.OneWay(sides=[(1, 7, 1, 6), (7, 7, 7, 6)])
    found = planner.plan((2.5, 4.5), (8.5, 4.5), one_way=into_west, within_m=5)
    assert found.status is hn.PlanStatus.NEAR_GOAL
    assert found.path.points[-1, 0] <= 7
    zone = hn.Blocked(cells=[(row, col) for row in range(9) for col in (7, 8, 9)])
    out = hn.OneWay(sides=[(row, 9, row, 10) for row in range(9)])
    into = hn.OneWay(sides=[(row, 10, row, 9) for row in range(9)])
    free = planner.plan((8.5, 4.5), (12.5, 4.5), blocked=zone, one_way=out, leave_zone=True)
    assert free.solved
    assert free.leaves_m is not None
    stuck = planner.plan((8.5, 4.5), (12.5, 4.5), blocked=zone, one_way=into, leave_zone=True)
    assert not stuck.solved


def test_ompl_goes_in_by_one_door_and_out_by_the_other() -> None:
    pytest.importorskip("ompl")
    topology = map_of(occupancy_grid(TWO_ROOMS), merge_distance_m=3.0)
    preset = hn.load_preset(
        "ompl", overrides=["planner.along=grid-astar", "planner.ompl.budget_s=30"]
    )
    both = hn.OneWay(sides=[(1, 6, 1, 7), (7, 7, 7, 6)])
    planner = hn.HybridPlanner(topology, preset=preset)
    sides = both.on(topology.grid)
    for start, goal in (((6.5, 7.4), (8.5, 7.4)), ((8.5, 1.5), (6.5, 1.5))):
        path = planner.plan(start, goal, one_way=both).raise_for_status().path
        ends = topology.grid.frame.cell_of(*start), topology.grid.frame.cell_of(*goal)
        line = on_grain(path.points, topology.grid.frame, topology.grid.shape)
        assert wrong_at(sides, topology.grid.enterable(), line, ends) is None
        assert path.length_m > 9  # the door beside the start is for the others
    planner.close()


def test_a_door_that_is_lost_by_an_update_is_reported() -> None:
    grid = occupancy_grid(TWO_ROOMS)
    line = hn.OneWayRule.of("line:7,8:7,7")  # from the east, in the upper door
    names = hn.RoomLabels(("all",), np.zeros(grid.shape, np.int32), one_way=(line,))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=names))
    planner = hn.HybridPlanner(topology, preset="octile")
    west, east = (6.5, 7.5), (8.5, 7.5)
    assert planner.plan(west, east).cost == pytest.approx(14, abs=1)
    assert planner.plan(east, west).cost == pytest.approx(2)
    closed = TWO_ROOMS.copy()
    closed[7, 6:8] = 0
    with pytest.warns(MapWarning, match="one-way line 1 of the rooms lies nowhere in free space"):
        planner.update(grid=occupancy_grid(closed))
    assert planner.plan((5.5, 7.5), east).cost > 14


def test_a_line_of_a_query_that_lies_in_walls_is_reported() -> None:
    planner = hn.HybridPlanner(map_of(occupancy_grid(TWO_ROOMS), merge_distance_m=3.0))
    in_the_wall = [(7, 5), (7, 4)]
    with pytest.warns(MapWarning, match="one-way line 2 lies nowhere in free space"):
        planner.plan((6.5, 7.5), (8.5, 7.5), one_way={"lines": [[(7, 8), (7, 7)], in_the_wall]})
