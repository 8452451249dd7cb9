"""Plans round closed cells, areas, arcs and places, with every preset."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.closures.blocked import Blocked
from hybridnav.harness.judges import segment_faults
from hybridnav.harness.scenes import sample_pairs
from hybridnav.search.grid_search import GridSearch
from tests.oracle.grid import assert_legal, recounted
from tests.plans import (
    PLAIN,
    PRESETS,
    TWO_ROOMS,
    answer,
    grid_of,
    map_of,
    points_in,
    presets,
    scene_map,
)
from tests.strategies import Scene, scenes


def closed_grid(grid: hn.OccupancyGrid, closed: Any) -> hn.OccupancyGrid:
    """The same free cells but for those that are closed."""
    classes = grid.classes.copy()
    classes.ravel()[closed] = hn.CellClass.OCCUPIED
    probability = np.where(classes == 2, 0.5, classes == 0).astype(np.float32)
    return hn.OccupancyGrid(
        probability, grid.frame, corner_cutting=grid.corner_cutting, robot_radius_m=0
    )


def random_blocked(topology: hn.TopologicalMap, rng: np.random.Generator) -> Blocked:
    """A few cells, arcs, places and areas, each often absent."""
    grid = topology.grid
    arcs = topology.arc_ids[~topology.level.is_self_loop]
    counts = rng.integers(0, 3, size=4) * (rng.random(4) < 0.5)
    low = rng.uniform(0, grid.shape, size=(counts[3], 2))
    high = low + rng.uniform(0.2, 6, size=low.shape)
    corners = [[(a, b), (a, d), (c, d), (c, b)] for (a, b), (c, d) in zip(low, high, strict=True)]
    return Blocked(
        arcs=rng.permutation(arcs)[: counts[0]].tolist(),
        places=rng.permutation(topology.place_ids)[: min(counts[1], 1)].tolist(),
        cells=rng.integers(0, grid.shape, size=(3 * counts[2], 2)),
        polygons=[grid.frame.points_of_grid(corner) for corner in corners],
    )


def check_blocked(
    planner: hn.HybridPlanner, endpoints: tuple[Any, Any], blocked: Any, optimum_m: float
) -> hn.PlanResult:
    """A plan round what is closed against the optimum of the grid without those cells."""
    before = answer(planner.plan(*endpoints))
    result = planner.plan(*endpoints, blocked=blocked)
    assert answer(planner.plan(*endpoints)) == before
    if math.isinf(optimum_m):
        assert result.status is hn.PlanStatus.NO_PATH
        assert result.cost == result.lower_bound == math.inf
        assert result.route is None
        return result
    assert result.solved
    assert 0 <= result.lower_bound <= optimum_m * (1 + 1e-9)
    assert optimum_m <= result.cost * (1 + 1e-9)
    assert result.cost == pytest.approx(
        recounted(result.path.cells) * planner.grid.resolution_m, rel=1e-12
    )
    if planner.preset.planner.method != "paper":
        assert result.cost == pytest.approx(optimum_m, rel=1e-9)
    assert len(result.route.arcs) == len(result.route.places) - 1
    return result


@given(scene=scenes(max_side=18), corner_cutting=st.booleans())
@PLAIN
def test_closed_cells_are_as_good_as_occupied_ones(scene: Scene, corner_cutting: bool) -> None:
    topology = scene_map(scene, corner_cutting=corner_cutting)
    grid, rng = topology.grid, np.random.default_rng(scene.seed)
    # Where corners may be cut the arcs of the places do not lead everywhere that paths do.
    chosen = PRESETS[1 if corner_cutting else 0 :]
    planners = [hn.HybridPlanner(topology, preset=preset) for preset in chosen]
    for pairs in points_in(grid, rng, 6).reshape(-1, 2, 2, 2):
        blocked = random_blocked(topology, rng)
        closed = blocked.cells_of(topology)
        rebuilt = closed_grid(grid, closed)
        other = hn.HybridPlanner(
            map_of(rebuilt, merge_distance_m=topology.pyramid.merge_distance_m), preset="octile"
        )
        search = GridSearch(rebuilt.enterable(), corner_cutting=corner_cutting)
        for start, goal in pairs:
            cells = [grid.frame.cell_of(*point) for point in (start, goal)]
            shut = [cell[0] * grid.shape[1] + cell[1] in set(closed.tolist()) for cell in cells]
            if any(shut):
                status = hn.PlanStatus.START_BLOCKED if shut[0] else hn.PlanStatus.GOAL_BLOCKED
                for planner in planners:
                    assert planner.plan(start, goal, blocked=blocked).status is status
                continue
            found = search.search(*cells).cells
            optimum = math.inf if found is None else recounted(found) * grid.resolution_m
            assert other.plan(start, goal).cost == pytest.approx(optimum, rel=1e-9)
            for planner in planners:
                result = check_blocked(planner, (start, goal), blocked, optimum)
                if result.path is not None and not corner_cutting:
                    assert_legal(result.path.cells, rebuilt.enterable())


@given(scene=scenes(max_side=18), corner_cutting=st.booleans())
@PLAIN
def test_any_angle_paths_keep_off_what_is_closed(scene: Scene, corner_cutting: bool) -> None:
    topology = scene_map(scene, corner_cutting=corner_cutting)
    grid, rng = topology.grid, np.random.default_rng(scene.seed)
    planners = [hn.HybridPlanner(topology, preset=preset) for preset in ("octile", "grid-astar")]
    for start, goal in points_in(grid, rng, 4):
        blocked = random_blocked(topology, rng)
        rebuilt = closed_grid(grid, blocked.cells_of(topology))
        for planner in planners:
            plain = planner.plan(start, goal, blocked=blocked)
            result = planner.plan(start, goal, blocked=blocked, smooth="line-of-sight")
            assert result.status is plain.status
            if result.path is not None:
                if not corner_cutting:
                    assert segment_faults(rebuilt, result.path.points) == ()
                assert result.lower_bound <= result.cost


@presets
def test_an_any_angle_path_goes_round_a_closed_wall(preset: str) -> None:
    planner = hn.HybridPlanner(
        map_of(grid_of(np.ones((9, 20))), merge_distance_m=0.15), preset=preset
    )
    grid = planner.grid
    wall = [(row, 10) for row in range(8)]
    start, goal = grid.frame.points_of_grid([(1.5, 1.5), (1.5, 18.5)])
    result = planner.plan(start, goal, smooth="line-of-sight", blocked={"cells": wall})
    assert (
        segment_faults(closed_grid(grid, [row * 20 + 10 for row, _ in wall]), result.path.points)
        == ()
    )
    assert result.cost == pytest.approx(0.05 * (1 + math.hypot(8.5, 6.5) + math.hypot(7.5, 6.5)))
    # And without the wall the planner sees straight through again.
    again = planner.plan(start, goal, smooth="line-of-sight")
    assert again.cost == pytest.approx(0.05 * 17)


@presets
def test_what_is_closed_may_be_said_in_every_form(preset: str) -> None:
    planner = hn.HybridPlanner(map_of(grid_of(TWO_ROOMS), merge_distance_m=0.35), preset=preset)
    grid = planner.grid
    start, goal = grid.frame.points_of([(2, 2), (2, 12)])
    near, far = ((1, 7), (7, 7))
    square = grid.frame.points_of_grid([(1, 7), (1, 8), (2, 8), (2, 7)])
    forms: list[Any] = [
        {"cells": [near]},
        Blocked(cells=[near]),
        {"polygons": [square]},
        shapely.Polygon(square),
    ]
    open_cost = planner.plan(start, goal).cost
    answers = [answer(planner.plan(start, goal, blocked=form)) for form in forms]
    assert answers[0][0] is hn.PlanStatus.SOLVED
    assert answers[0][2] > open_cost
    assert all(other == answers[0] for other in answers[1:])
    both = planner.plan(start, goal, blocked={"cells": [near, far]})
    assert both.status is hn.PlanStatus.NO_PATH
    assert answer(planner.plan(start, goal, blocked={})) == answer(planner.plan(start, goal))
    assert planner.plan(start, goal).cost == open_cost


@presets
def test_an_end_that_is_closed_is_named(preset: str) -> None:
    planner = hn.HybridPlanner(map_of(grid_of(TWO_ROOMS), merge_distance_m=0.35), preset=preset)
    topology = planner.topology
    cells = [(2, 2), (2, 12)]
    start, goal = topology.grid.frame.points_of(cells)
    here, there = (int(topology.place_ids[topology.place_at(cell)]) for cell in cells)
    for blocked, status in (
        ({"cells": cells[:1]}, hn.PlanStatus.START_BLOCKED),
        ({"cells": cells[1:]}, hn.PlanStatus.GOAL_BLOCKED),
        ({"cells": cells}, hn.PlanStatus.START_BLOCKED),
        ({"places": [here]}, hn.PlanStatus.START_BLOCKED),
        ({"places": [there]}, hn.PlanStatus.GOAL_BLOCKED),
        (shapely.Point(start).buffer(0.01), hn.PlanStatus.START_BLOCKED),
        (shapely.Point(goal).buffer(0.01), hn.PlanStatus.GOAL_BLOCKED),
    ):
        result = planner.plan(start, goal, blocked=blocked)
        assert result.status is status
        assert result.path is None
        assert result.lower_bound == math.inf
        with pytest.raises(hn.errors.PlanError, match=str(status)):
            result.raise_for_status()


@presets
def test_a_door_closed_by_a_polygon_sends_the_route_through_another(office_planners, preset):
    planner = office_planners[preset]
    topology, grid = planner.topology, planner.grid
    search, rerouted = GridSearch(grid.enterable()), 0
    for pair in sample_pairs(grid, 12, seed=2):
        endpoints = grid.frame.points_of([pair.start, pair.goal])
        before = planner.plan(*endpoints)
        if before.path is None:
            continue
        # A box of 40 cm round the middle of the path: some close a door, some only part of one.
        middle = before.path.points[len(before.path.points) // 2]
        box = shapely.Point(middle).buffer(0.2, cap_style="square")
        closed = Blocked(polygons=[box]).cells_of(topology)
        found = search.search(pair.start, pair.goal, blocked=closed).cells
        optimum = math.inf if found is None else recounted(found) * grid.resolution_m
        result = check_blocked(planner, (endpoints[0], endpoints[1]), box, optimum)
        if result.path is not None:
            at = result.path.cells @ np.array([grid.shape[1], 1])
            assert not np.isin(at, closed).any()
            distances = shapely.distance(box, shapely.points(result.path.points))
            assert distances.min() > grid.robot_radius_m - grid.resolution_m
            rerouted += result.route.arcs != before.route.arcs
    assert rerouted > 0


@presets
def test_a_closed_arc_is_not_passed(office_planners, preset):
    planner = office_planners[preset]
    frame = planner.grid.frame
    detours = 0
    for pair in sample_pairs(planner.grid, 8, seed=5, least_distance_m=8.0):
        endpoints = frame.points_of([pair.start, pair.goal])
        before = planner.plan(*endpoints)
        if before.route is None or not before.route.arcs:
            continue
        arc = before.route.arcs[len(before.route.arcs) // 2]
        result = planner.plan(*endpoints, blocked={"arcs": [arc]})
        if result.route is not None:
            assert result.solved
            assert arc not in result.route.arcs
            detours += 1
    assert detours > 0


@presets
def test_what_is_closed_far_from_the_path_changes_nothing(office_planners, preset):
    planner = office_planners[preset]
    grid = planner.grid
    for pair in sample_pairs(grid, 8, seed=11):
        endpoints = grid.frame.points_of([pair.start, pair.goal])
        before = planner.plan(*endpoints)
        if before.path is None:
            continue
        passed = shapely.MultiPoint(before.path.points)
        corners = grid.frame.points_of(np.argwhere(grid.enterable())[::997])
        far = corners[shapely.distance(passed, shapely.points(corners)) > 2]
        boxes = shapely.MultiPolygon([shapely.box(x, y, x + 0.1, y + 0.1) for x, y in far[::3]])
        result = planner.plan(*endpoints, blocked=boxes)
        # The bound of `paper` is the optimum among what is open.
        assert result.lower_bound >= before.lower_bound
        assert before.cost >= result.lower_bound
        assert answer(replace(result, lower_bound_source=before.lower_bound)) == answer(before)
        assert result.route == before.route


@presets
def test_a_diagonal_past_a_closed_cell_is_not_taken(preset: str) -> None:
    planner = hn.HybridPlanner(map_of(grid_of(np.ones((3, 3)))), preset=preset)
    start, goal = planner.grid.frame.points_of([(0, 0), (1, 1)])
    assert planner.plan(start, goal).cost == pytest.approx(0.05 * math.sqrt(2))
    result = planner.plan(start, goal, blocked={"cells": [(0, 1)]})
    assert result.cost == pytest.approx(0.05 * 2)
    shut = planner.plan(start, goal, blocked={"cells": [(0, 1), (1, 0)]})
    assert shut.status is hn.PlanStatus.NO_PATH


@presets
@pytest.mark.parametrize("blocked", [{"doors": [1]}, {"cells": [(0, 99)]}])
def test_what_cannot_be_closed_is_refused_and_the_planner_goes_on(preset, blocked):
    planner = hn.HybridPlanner(map_of(grid_of(TWO_ROOMS)), preset=preset)
    start, goal = planner.grid.frame.points_of([(2, 2), (2, 12)])
    with pytest.raises(hn.errors.InvalidValueError) as caught:
        planner.plan(start, goal, blocked=blocked)
    assert str(caught.value).isprintable()
    assert planner.plan(start, goal).solved
