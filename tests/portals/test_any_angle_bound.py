"""Bounds on any-angle paths against the exact optima of the visibility graph."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.grid.worlds import office_world
from hybridnav.metrics import VisibilityGraph
from hybridnav.portals.any_angle_bound import AnyAngleBound
from tests.divided import Divided, halves, partitions
from tests.strategies import examples


def position(cell: tuple[int, int]) -> tuple[float, float]:
    return cell[0] + 0.5, cell[1] + 0.5


@settings(max_examples=examples(50), derandomize=True, deadline=None)
@given(partitions(), st.sampled_from(["all", "few"]), st.integers(0, 2**32 - 1))
def test_no_any_angle_path_is_shorter(divided: Divided, gates: str, seed: int) -> None:
    assume(divided.free.any() and not divided.allow_unexplored)
    graph, rng = VisibilityGraph(divided.grid), np.random.default_rng(seed)
    bound = AnyAngleBound(divided.portals(gates))
    free, label = np.argwhere(divided.free), divided.label.reshape(divided.free.shape)
    resolution_m = divided.grid.resolution_m
    for i, j in rng.integers(len(free), size=(12, 2)).tolist():
        start, goal = tuple(free[i].tolist()), tuple(free[j].tolist())
        lower = bound.of(int(label[start]), int(label[goal]), position(start), position(goal))
        assert lower >= math.dist(start, goal) * (1 - 1e-12)
        optimum = graph.shortest(start, goal).length_m / resolution_m
        assert lower <= optimum * (1 + 1e-12)


def test_a_way_round_through_a_door_is_told_from_the_straight_line() -> None:
    divided = halves(40, 9, 4)
    free = np.ones((40, 9), dtype=np.uint8)
    divided.grid.classes.flags.writeable = True
    divided.grid.classes[:] = free
    divided.grid.classes[:39, 4] = hn.CellClass.OCCUPIED
    fields = np.zeros((40, 9), dtype=np.int32)
    fields[:, 5:] = 1
    bound = AnyAngleBound(Divided(divided.grid, fields).portals())
    start, goal = (0.5, 0.5), (0.5, 8.5)
    assert math.dist(start, goal) == 8
    assert 76 < bound.of(0, 1, start, goal) < math.dist(start, (39, 4)) + math.dist((39, 5), goal)


def test_gates_everywhere_prove_more_than_the_straight_line() -> None:
    grid = office_world().grid(robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    free = np.argwhere(grid.classes == hn.CellClass.FREE)
    pairs = np.random.default_rng(0).choice(free, size=(30, 2))
    planner = hn.HybridPlanner(topology, preset="portals")
    plain = hn.HybridPlanner(topology, preset="grid-astar")
    gaps = []
    for start, goal in grid.frame.points_of(pairs).tolist():
        straight = plain.plan(start, goal, smooth="line-of-sight")
        if not straight.solved:
            continue
        assert straight.lower_bound == math.dist(start, goal)
        result = planner.plan(start, goal, smooth="line-of-sight")
        assert straight.lower_bound * (1 - 1e-12) <= result.lower_bound
        assert result.lower_bound <= min(result.cost, straight.cost)
        gaps.append((result.gap, straight.gap))
    proved, by_line = np.mean(gaps, axis=0)
    assert proved < 0.85 * by_line
