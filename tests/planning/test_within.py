"""Paths to the nearest point that can be reached, judged by shapely and a flooding of its own."""

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from tests.planning.test_costs import topology_of
from tests.strategies import class_grids, seeds, tried

_CORNERS = np.array([[0, 0], [0, 1], [1, 1], [1, 0]])
PRESETS = ("shortest", "octile", "grid-astar", "robot", "paper")


def reached(is_open: Any, start: tuple[int, int]) -> list[tuple[int, int]]:
    """The cells that side by side lead to a start, by a walk."""
    found, queue = {start}, [start]
    while queue:
        row, col = queue.pop()
        for near in ((row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)):
            inside = all(0 <= at < size for at, size in zip(near, is_open.shape, strict=True))
            if inside and near not in found and is_open[near]:
                found.add(near)
                queue.append(near)
    return sorted(found)


@tried(
    80,
    class_grids(max_side=12),
    st.sampled_from(PRESETS),
    seeds,
    st.sampled_from([0.0, 0.3, 1.0, 40.0]),
)
def test_the_path_ends_at_the_nearest_point_of_the_free_space_that_is_reached(
    classes: Any, preset: str, seed: int, within: float
) -> None:
    rng = np.random.default_rng(seed)
    frame = hn.Frame(resolution_m=0.5, origin_m=(-3.0, 7.0), yaw_rad=0.4)
    probability = np.array([0.0, 1.0, 0.5])[np.searchsorted([0, 1, 2], classes)]
    grid = hn.OccupancyGrid(probability, frame=frame)
    free = grid.classes == hn.CellClass.FREE
    if not free.any():
        return
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    cells = np.argwhere(free)
    shut = cells[rng.random(len(cells)) < rng.choice([0.0, 0.3])]
    start = tuple(cells[rng.integers(len(cells))].tolist())
    shut = shut[(shut != start).any(axis=1)]
    goal = frame.points_of_grid(rng.uniform(-2, np.array(grid.shape) + 2))
    ends = frame.points_of(np.array([start]))[0], goal
    blocked = hn.Blocked(cells=shut) if len(shut) else None
    plain = planner.plan(*ends, blocked=blocked)
    found = planner.plan(*ends, blocked=blocked, within_m=within)
    if plain.solved:
        assert found.status == plain.status
        assert found.cost == plain.cost
        assert found.short_m == 0
        return
    is_open = free.copy()
    is_open[tuple(shut.T)] = False
    squares = shapely.union_all(
        [
            shapely.Polygon(frame.points_of_grid(np.add(cell, _CORNERS)))
            for cell in reached(is_open, start)
        ]
    )
    nearest_m = shapely.distance(squares, shapely.Point(goal))
    if abs(nearest_m - within) < 1e-5:
        return
    if nearest_m > within:
        assert found.status == plain.status
        assert found.path is None
        assert found.short_m == math.inf
        return
    assert str(found.status) == "near the goal"
    assert not found.solved
    assert found.goal == tuple(goal.tolist())
    end = shapely.Point(found.path.points[-1])
    # Paths of cells end at the centre of a cell, as for every goal.
    by_cells = preset in {"octile", "grid-astar", "paper"}
    slack_m = 0.5 * math.sqrt(0.5) if by_cells else 1e-6
    assert found.short_m == pytest.approx(shapely.distance(end, shapely.Point(goal)))
    assert nearest_m - 1e-9 <= found.short_m <= nearest_m + slack_m
    assert shapely.distance(squares, end) < 1e-6
    assert found.lower_bound <= found.cost < math.inf
    assert found.raise_for_status() is found
    assert found.reason
    again = planner.plan(ends[0], found.path.points[-1], blocked=blocked)
    if not by_cells:
        assert again.cost == pytest.approx(found.cost, abs=1e-6)


@pytest.mark.parametrize("wrong", [-1.0, math.nan, True, "far"])
def test_a_distance_that_is_none_is_refused(office: hn.TopologicalMap, wrong: Any) -> None:
    planner = hn.HybridPlanner(office)
    with pytest.raises(InvalidValueError, match="within_m must be metres"):
        planner.plan((1.0, 13.2), (40.6, 19.4), within_m=wrong)


def test_the_command_ends_near_the_goal(cli: Any) -> None:
    office = "maps/office/office.yaml"
    query = ("plan", office, "--robot-radius", "0.25", "--start", "1.0,13.2", "--goal", "16.0,-0.3")
    assert cli(*query).code == 1
    done = cli(*query, "--within", "3")
    assert done.code == 0, done.err
    assert "status     near the goal\n" in done.out
    assert "of the goal, at the nearest point that can be reached\n" in done.out
    assert "\nwhy        The goal lies " in done.out
    short = cli(*query, "--within", "0.01")
    assert short.code == 1
    assert "near the goal" not in short.out
    assert cli(*query, "--within", "-1").refuses(2, "--within must be metres, 0 or more, got -1")
    named = (*query[:-2], "--to", "room-7", "--within", "1")
    assert cli(*named).refuses(2, "--within goes with --start and --goal alone")
