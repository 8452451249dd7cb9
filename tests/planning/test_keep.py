"""Plans that stay on the path of an earlier one: legal, no dearer than allowed, and given up where
something is closed on it."""

from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from shapely import LineString, Point

import hybridnav as hn
from hybridnav.harness.judges import segment_faults
from tests.planning.test_costs import scene, topology_of
from tests.strategies import class_grids, occupancy_grid, seeds, tried

_CLASSES = hn.CellClass.FREE, hn.CellClass.OCCUPIED


def is_rest(new: Any, old: Any) -> bool:
    """Whether a line is one of the last points of another, or all, behind its start."""
    n = len(new) - 1
    return n <= len(old) and np.array_equal(new[1:], old[len(old) - n :])


@tried(60, class_grids(max_side=24), seeds, st.sampled_from([0.0, 0.02, 0.5]))
def test_the_rest_is_kept_while_it_is_cheap_enough(classes: Any, seed: int, within: float) -> None:
    grid, layer, is_open, *cells, rng = scene(classes, seed)
    preset = hn.load_preset("robot", overrides=[f"planner.keep_within={within}"])
    planner = hn.HybridPlanner(topology_of(grid), preset=preset, costs=layer)
    start, goal = grid.frame.points_of(cells)
    old = planner.plan(start, goal)
    if old.line is None or len(old.line) == 1:
        return
    rest = LineString(old.line)
    for part in rng.random(4):
        # A step off the line, less than a cell long.
        here = np.array(rest.interpolate(part, normalized=True).coords[0])
        here = here + rng.uniform(-0.4, 0.4, 2) * grid.resolution_m * rng.integers(2)
        new = planner.plan(here, goal, keep=old)
        fresh = planner.plan(here, goal)
        assert new.status == fresh.status
        if new.line is None or new.path is None or fresh.line is None:
            continue
        shut = np.where(is_open, hn.CellClass.FREE, hn.CellClass.OCCUPIED).astype(np.uint8)
        assert segment_faults(occupancy_grid(shut, resolution_m=grid.resolution_m), new.line) == ()
        assert new.lower_bound <= new.cost
        # Lines are compared; then arcs may add a two-hundredth.
        kept, anew = (planner.plan(here, goal, keep=k, smooth="line-of-sight") for k in (old, None))
        assert kept.cost <= (1 + within) * anew.cost + 1e-6
        assert new.cost <= kept.cost * 1.0051 + 1e-6
        assert is_rest(new.line, old.line) or np.array_equal(new.line, fresh.line)


def test_the_rest_of_a_path_is_kept_in_the_office(office: hn.TopologicalMap) -> None:
    planner = hn.HybridPlanner(office, preset="robot")
    old = planner.plan((1.0, 13.2), (40.6, 19.4))
    assert old.line is not None
    poses = old.path.poses(0.5)
    aside = poses[:-2, :2] + np.array([0.03, -0.02])
    kept = [planner.plan(pose, (40.6, 19.4), keep=old) for pose in aside]
    assert all(result.line is not None and is_rest(result.line, old.line) for result in kept)
    # The same in a chain: each result is the next one's to keep.
    last = old
    for pose in poses[:-2]:
        last = planner.plan(pose[:2], (40.6, 19.4), keep=last)
        assert last.line is not None
        assert is_rest(last.line, old.line)
    # For another goal, the answer is that of a new plan.
    other = planner.plan((1.0, 13.2), poses[-9, :2], keep=old)
    fresh = planner.plan((1.0, 13.2), poses[-9, :2])
    assert np.array_equal(other.path.points, fresh.path.points)


def test_a_closed_path_is_left_and_an_open_one_is_kept_again(office: hn.TopologicalMap) -> None:
    planner = hn.HybridPlanner(office, preset="robot")
    lasting = hn.HybridPlanner(
        office, preset=hn.load_preset("robot", overrides=["planner.keep_within=9"])
    )
    old = planner.plan((1.0, 13.2), (40.6, 19.4))
    assert old.line is not None
    middle = Point(*LineString(old.line).interpolate(0.5, normalized=True).coords[0])
    shut = middle.buffer(0.3)
    round_it = lasting.plan((1.0, 13.2), (40.6, 19.4), keep=old, blocked=shut)
    assert round_it.line is not None
    assert LineString(round_it.line).distance(middle) > 0.3
    again = planner.plan((1.0, 13.2), (40.6, 19.4), keep=old)
    assert again.line is not None
    assert np.array_equal(again.line, old.line)
    # Costs that rise on it: kept within a large share only.
    factors = np.ones(office.grid.shape, np.float32)
    row, col = office.grid.frame.cell_of(middle.x, middle.y)
    factors[row - 5 : row + 6, col - 5 : col + 6] = 30
    for one in (planner, lasting):
        one.update(costs=hn.CostLayer(factors))
    left = planner.plan((1.0, 13.2), (40.6, 19.4), keep=old)
    dear = lasting.plan((1.0, 13.2), (40.6, 19.4), keep=old)
    assert left.line is not None
    assert dear.line is not None
    assert not np.array_equal(left.line, old.line)
    assert np.array_equal(dear.line, old.line)
    assert left.cost < dear.cost


@pytest.mark.parametrize("preset", ["grid-astar", "paper"])
def test_other_methods_refuse_it(preset: str, office: hn.TopologicalMap) -> None:
    old = hn.HybridPlanner(office, preset="robot").plan((1.0, 13.2), (5.0, 13.2))
    with pytest.raises(
        hn.errors.InvalidValueError, match="keep goes with presets of methods cheapest, shortest"
    ):
        hn.HybridPlanner(office, preset=preset).plan((1.0, 13.2), (5.0, 13.2), keep=old)


def test_what_is_no_result_is_refused(office: hn.TopologicalMap) -> None:
    planner = hn.HybridPlanner(office, preset="robot")
    old: Any = "old"
    with pytest.raises(hn.errors.InvalidValueError, match="expected a PlanResult"):
        planner.plan((1.0, 13.2), (5.0, 13.2), keep=old)


def test_a_kept_path_does_not_bend_between_cells_that_meet_at_a_corner() -> None:
    """The closed cell touches the kept path only where it bends round a wall."""
    free = np.ones((9, 9), np.uint8)
    free[1, 3] = 0
    grid = occupancy_grid(free, resolution_m=0.5)
    planner = hn.HybridPlanner(topology_of(grid), preset="shortest")
    start, goal = (4.25, 1.75), (0.75, 0.25)
    old = planner.plan(start, goal)
    assert [2.0, 0.5] in old.path.points.tolist()
    new = planner.plan((3.25, 1.25), goal, keep=old, blocked={"cells": [(0, 4)]})
    assert [2.0, 0.5] not in new.path.points.tolist()


@tried(80, class_grids(max_side=16), seeds, st.sampled_from(["shortest", "octile"]))
def test_shortest_paths_are_kept_while_they_are_legal_and_hardly_longer(classes, seed, preset):
    rng = np.random.default_rng(seed)
    grid = occupancy_grid(classes, resolution_m=0.5)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    free = np.argwhere(grid.classes == hn.CellClass.FREE)
    if not len(free):
        return
    start, goal = grid.frame.points_of(free[rng.integers(len(free), size=2)])
    old = planner.plan(start, goal)
    if old.path is None or len(old.path.cells) < 2:
        return
    for cell in (old.path.cells[rng.integers(len(old.path.cells))], free[rng.integers(len(free))]):
        here = grid.frame.points_of(cell[None])[0]
        shut = free[rng.random(len(free)) < rng.choice([0.0, 0.1])]
        is_end = (shut == cell).all(axis=1) | (shut == old.path.cells[-1]).all(axis=1)
        blocked = hn.Blocked(cells=shut[~is_end])
        new = planner.plan(here, goal, keep=old, blocked=blocked)
        fresh = planner.plan(here, goal, blocked=blocked)
        assert new.status == fresh.status
        if new.path is None or fresh.path is None:
            continue
        assert new.lower_bound <= new.cost <= 1.02 * fresh.cost + 1e-9
        assert new.lower_bound <= fresh.cost + 1e-9
        is_open = grid.classes == hn.CellClass.FREE
        is_open[tuple(shut[~is_end].T)] = False
        closed = np.where(is_open, hn.CellClass.FREE, hn.CellClass.OCCUPIED).astype(np.uint8)
        assert segment_faults(occupancy_grid(closed, resolution_m=0.5), new.path.points) == ()
        assert tuple(new.path.cells[0]) == tuple(cell)
        kept = is_rest(new.path.points, old.path.points)
        assert kept or np.array_equal(new.path.points, fresh.path.points)


@pytest.mark.parametrize("preset", ["shortest", "octile"])
def test_a_shortest_path_changes_only_for_a_gain(preset: str) -> None:
    """Two ways round a post, one a little shorter: from beside the middle both are about equal."""
    free = np.ones((21, 60), np.bool_)
    free[5:15, 28:32] = False
    grid = occupancy_grid(np.where(free, *_CLASSES).astype(np.uint8), resolution_m=0.1)
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    goal = (5.85, 1.05)
    old = planner.plan((0.15, 0.95), goal)
    above = (0.15, 1.25)
    kept, fresh = planner.plan(above, goal, keep=old), planner.plan(above, goal)
    assert kept.path is not None
    assert fresh.path is not None
    if preset == "shortest":
        side = old.path.points[:, 1].min() < 0.6
        assert side == (kept.path.points[:, 1].min() < 0.6)
        assert side != (fresh.path.points[:, 1].min() < 0.6)
        assert fresh.cost < kept.cost <= 1.02 * fresh.cost
    on = old.path.cells[len(old.path.cells) // 3]
    rest = planner.plan(grid.frame.points_of(on[None])[0], goal, keep=old)
    assert is_rest(rest.path.points, old.path.points)
