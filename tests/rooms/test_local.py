"""Local maps of places: laid over each other, they are the whole map."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from tests.strategies import seeds, tried


@tried(60, seeds, st.sampled_from([0.0, 0.1, 0.25]), st.sampled_from([0.0, 0.7, -2.0]))
def test_local_maps_laid_over_each_other_are_the_whole_map(seed, radius_m, yaw_rad):
    rng = np.random.default_rng(seed)
    chances = rng.choice(
        [0.0, 0.1, 0.4, 0.9, np.nan], p=[0.7, 0.1, 0.06, 0.08, 0.06], size=(17, 23)
    )
    frame = hn.Frame(0.1, (-3.0, 7.0), yaw_rad)
    grid = hn.OccupancyGrid(chances, frame, robot_radius_m=radius_m)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=0.6))
    level, whole = topology.level, np.full(grid.shape, np.nan, np.float32)
    covered = np.zeros(grid.shape, dtype=np.bool_)
    for place in range(topology.n_places):
        local = topology.local_grid(place)
        x, y, yaw = topology.local_pose(place)
        points = local.frame.points_of(np.argwhere(np.isfinite(local.probability)))
        turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        rows, cols = grid.frame.cells_of(points @ turn + [x, y]).T
        whole[rows, cols] = local.probability[np.isfinite(local.probability)]
        covered[rows, cols] = True
        own = level.receptive_field(place)
        there = local.frame.cells_of((grid.frame.points_of(own) - [x, y]) @ turn.T)
        assert (local.classes[tuple(there.T)] == topology.classes[place]).all()
        free = np.count_nonzero(local.classes == hn.CellClass.FREE)
        assert free == (len(own) if topology.classes[place] == hn.CellClass.FREE else 0)
    assert np.array_equal(whole[covered], grid.probability[covered])
    # What no map holds is far from all places.
    near = ndimage.binary_dilation(level.field_of >= 0, np.ones((3, 3), np.bool_))
    assert covered[near & np.isfinite(grid.probability)].all()


@tried(30, seeds)
def test_transforms_compose_to_the_identity_round_every_cycle(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = hn.OccupancyGrid(
        rng.choice([0.0, 0.4, 0.9], p=[0.8, 0.1, 0.1], size=(25, 25)),
        hn.Frame(0.05, (2.0, 1.0), 0.4),
        robot_radius_m=0,
    )
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=0.2))
    graph: nx.MultiGraph[int] = topology.level.to_networkx()
    for cycle in nx.cycle_basis(nx.Graph(graph)):
        pose = np.eye(3)
        for one, other in zip(cycle, [*cycle[1:], cycle[0]], strict=True):
            parallel = max(map(int, graph[one][other]))
            step = matrix(*topology.transform(parallel))
            pose @= step if topology.arcs[parallel, 0] == one else np.linalg.inv(step)
        assert pose == pytest.approx(np.eye(3), abs=1e-12)
    for arc in range(topology.n_arcs):
        one, other = topology.arcs[arc].tolist()
        leads = matrix(*topology.local_pose(one)) @ matrix(*topology.transform(arc))
        assert leads == pytest.approx(matrix(*topology.local_pose(other)), abs=1e-12)


def matrix(x: float, y: float, yaw: float) -> np.ndarray:
    return np.array(
        [[np.cos(yaw), -np.sin(yaw), x], [np.sin(yaw), np.cos(yaw), y], [0.0, 0.0, 1.0]]
    )


def test_a_local_map_is_a_map_that_plans_are_made_on() -> None:
    grid = hn.example_map("figure1")
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    free = topology.classes == hn.CellClass.FREE
    place = int((topology.areas_m2 * free).argmax())
    local = topology.local_grid(place)
    start = local.frame.points_of(np.argwhere(local.classes == hn.CellClass.FREE)[0])
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(local)))
    assert planner.plan(tuple(start), (0.0, 0.0)).solved  # the origin is the place's position


@pytest.mark.parametrize("index", [-1, 10_000])
def test_there_are_maps_of_places_and_transforms_of_arcs_alone(index: int) -> None:
    grid = hn.OccupancyGrid(np.zeros((3, 3), np.float32), robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    with pytest.raises(hn.errors.InvalidValueError, match="place must be from 0 to 0"):
        topology.local_grid(index)
    with pytest.raises(hn.errors.InvalidValueError, match="place must be from 0 to 0"):
        topology.local_pose(index)
    with pytest.raises(hn.errors.InvalidValueError, match="arc must be from 0 to -1"):
        topology.transform(index)
