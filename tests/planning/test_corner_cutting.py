"""Where corners may be cut: every status is true, though the topological map joins fewer cells."""

from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from benchmarks.baselines.hpa import HpaStar
from benchmarks.baselines.thrun import ThrunMap
from hybridnav.harness.baselines import Solver
from hybridnav.harness.baselines.grid import GridAstar
from hybridnav.harness.baselines.regions import SimpleGraphPyramid
from hybridnav.maps import CellClass
from tests.strategies import MAX_SIDE, drawn, seeds, tried

PRESETS = ["paper", "octile", "grid-astar"]
# Two free places that only a move between two blocked cells joins.
PINCHED = drawn("..###", "..###", "##...", "##...")


def cutting_map(classes: Any, merge_distance_m: float = 50.0) -> hn.TopologicalMap:
    probability = np.where(classes == CellClass.UNEXPLORED, 0.4, classes == CellClass.OCCUPIED)
    grid = hn.OccupancyGrid(probability.astype(np.float32), robot_radius_m=0.0, corner_cutting=True)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m)
    return hn.TopologicalMap(pyramid)


def joined(enterable: Any) -> Any:
    """Component of each cell by the moves of eight neighbours, 0 for none."""
    return ndimage.label(enterable, np.ones((3, 3)))[0]


def pairs(enterable: Any, seed: int, n: int) -> Any:
    cells = np.argwhere(enterable)
    rng = np.random.default_rng(seed)
    return cells[rng.integers(len(cells), size=(n, 2))].tolist() if len(cells) else []


@st.composite
def mazes(draw: Any) -> Any:
    """Small maps with many moves between two blocked cells."""
    side = st.integers(2, min(9, MAX_SIDE))
    rng = np.random.default_rng(draw(seeds))
    classes = rng.choice(np.array([0, 1, 2], np.uint8), (draw(side), draw(side)), p=[0.4, 0.5, 0.1])
    return cutting_map(classes, draw(st.sampled_from([1.5, 3.0, 50.0])))


@pytest.mark.parametrize("preset", PRESETS)
def test_a_path_between_two_blocked_cells_is_found(preset: str) -> None:
    topology = cutting_map(PINCHED)
    result = hn.HybridPlanner(topology, preset=preset).plan((0.5, 3.5), (4.5, 0.5))
    assert result.status is hn.PlanStatus.SOLVED
    assert result.cost == pytest.approx(1 + 3 * np.sqrt(2))
    assert result.route.arcs == (-1,)


@tried(25, topology=mazes(), seed=st.integers(0, 99))
def test_every_status_is_true(topology: hn.TopologicalMap, seed: int) -> None:
    grid = topology.grid
    for preset in PRESETS:
        for unexplored, corridor in ((False, "route"), (True, "neighbours")):
            planner = hn.HybridPlanner(
                topology,
                preset=hn.load_preset(
                    preset,
                    overrides=[
                        f"planner.allow_unexplored={str(unexplored).lower()}",
                        *([f"planner.corridor={corridor}"] if preset == "paper" else []),
                    ],
                ),
            )
            enterable = grid.enterable(allow_unexplored=unexplored)
            part = joined(enterable)
            for start, goal in pairs(enterable, seed, 4):
                endpoints = grid.frame.points_of(start), grid.frame.points_of(goal)
                result = planner.plan(*endpoints)
                assert result.solved == (part[tuple(start)] == part[tuple(goal)])
                assert result.cost >= result.lower_bound - 1e-9


@tried(25, topology=mazes(), seed=st.integers(0, 99))
def test_no_baseline_denies_a_path_that_exists(topology: hn.TopologicalMap, seed: int) -> None:
    grid = topology.grid
    part = joined(grid.enterable())
    methods: list[Solver] = [
        GridAstar(grid),
        HpaStar(grid, cluster_cells=4),
        SimpleGraphPyramid(topology),
        ThrunMap(grid, epsilon_cells=2),
    ]
    for start, goal in pairs(grid.enterable(), seed, 4):
        for method in methods:
            found = method.solve(tuple(start), tuple(goal))
            if not found.gave_up:
                assert found.is_path == (part[tuple(start)] == part[tuple(goal)])


def test_no_move_crosses_shut_doors_where_corners_may_be_cut() -> None:
    # The robot's radius may take both cells beside a diagonal, which then passes on no arc.
    label_of = np.repeat(np.array([[0] * 5 + [1] * 5], dtype=np.int32), 10, axis=0)
    rooms = hn.RoomLabels(("left", "right"), label_of)
    opened = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        grid = hn.OccupancyGrid(
            (rng.random((10, 10)) < 0.15).astype(np.float32),
            frame=hn.Frame(1.0),
            robot_radius_m=1.0,
            corner_cutting=True,
        )
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
        blocked = hn.Blocked(doors=list(topology.rooms.doors))
        remaining = grid.enterable()
        opened += bool(remaining[:, 4].any() and remaining[:, 5].any())
        remaining.ravel()[blocked.cells_of(topology)] = False
        left, right = remaining[:, 4], np.pad(remaining[:, 5], 1)
        assert not (left & (right[:-2] | right[1:-1] | right[2:])).any(), seed
    assert opened > 30
