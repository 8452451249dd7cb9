"""Alternatives by doors of planners by costs: order, overlap and stretch are measured in cost."""

import functools
import json
import math
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import example
from PIL import Image

import hybridnav as hn
from hybridnav.maps.costs import cost_along
from hybridnav.route import DoorGraph, door_graph
from tests.door_alternatives import Planned, check_alternatives, two_points
from tests.floors import random_floor
from tests.layers import layer_of
from tests.strategies import seeds, tried


def weighted_moves(floor: Any, layer: hn.CostLayer, doors: Any = None) -> Any:
    """The graph of networkx of all moves, with their costs."""
    moves = floor.moves() if doors is None else floor.moves(doors=doors)
    factors = layer.factors.astype(float)
    for one, other, about in moves.edges(data=True):
        about["weight"] *= (factors[one] + factors[other]) / 2
    return moves


def random_layer(floor: Any, rng: np.random.Generator) -> hn.CostLayer:
    grid = floor.topology.grid
    if rng.random() < 0.5:
        return hn.CostLayer.clearance(grid, inflation_radius_m=3.0, scaling=0.5, multiplier=5.0)
    return layer_of(rng.choice([1.0, 1.5, 6.0], grid.shape))


@tried(40, seed=seeds)
def test_each_is_the_cheapest_path_by_its_doors_and_within_the_limits(seed: int) -> None:
    def by_costs(floor: Any, rng: np.random.Generator) -> Planned:
        layer, grid = random_layer(floor, rng), floor.topology.grid

        def measure(line: Any) -> float:
            parts = (shapely.get_coordinates(part) for part in shapely.get_parts(line))
            return sum(cost_along(grid, layer, part) for part in parts if len(part) > 1)

        planner = hn.HybridPlanner(floor.topology, preset="grid-astar", costs=layer)
        return Planned(planner, functools.partial(weighted_moves, floor, layer), measure)

    for other in check_alternatives(seed, by_costs):
        assert other.result.metric == "weighted"


@tried(30, seed=seeds)
@example(seed=1058)  # two legs that rounding to 1 / 80782 of a cell brings below the path
def test_the_first_route_on_the_graph_of_doors_costs_what_its_legs_do(seed: int) -> None:
    """Legs run from middle to middle of the boundaries, so no route is cheaper than the path."""
    rng = np.random.default_rng(seed)
    floor = random_floor(rng)
    layer = random_layer(floor, rng)
    topology = floor.topology
    cols = topology.grid.shape[1]
    first, last = two_points(floor, rng)
    graph = door_graph(topology, costs=layer)
    assert door_graph(topology, costs=layer) is graph
    assert door_graph(topology) is not graph
    routes = list(graph.routes(first[0] * cols + first[1], last[0] * cols + last[1]))
    costs = [route.length_m for route in routes]
    assert costs == pytest.approx(sorted(costs))
    moves = weighted_moves(floor, layer)
    assert bool(routes) == nx.has_path(moves, first, last)
    if routes:
        least = nx.dijkstra_path_length(moves, first, last)
        assert costs[0] >= least * (1 - 1e-9)
    ones = DoorGraph(topology.rooms, factors=np.ones(topology.grid.shape))
    plain = list(door_graph(topology).routes(first[0] * cols + first[1], last[0] * cols + last[1]))
    same = list(ones.routes(first[0] * cols + first[1], last[0] * cols + last[1]))
    assert [route.length_m for route in same] == pytest.approx([r.length_m for r in plain])


def dear_door_map() -> tuple[hn.TopologicalMap, hn.CostLayer]:
    """Two rooms and two doors: the near one lies in a dear zone that the costs do not close."""
    free = np.zeros((21, 31), dtype=np.bool_)
    free[1:-1, 1:15] = free[1:-1, 16:-1] = True
    free[4, 15] = free[17, 15] = True
    labels = np.full(free.shape, -1, np.int32)
    labels[1:-1, 1:15], labels[1:-1, 16:-1] = 0, 1
    labels[4, 15] = labels[17, 15] = 0
    grid = hn.OccupancyGrid(1.0 - free, robot_radius_m=0)
    rooms = hn.RoomLabels(("west", "east"), labels)
    factors = np.ones(free.shape)
    factors[1:8, 10:21] = 8.0
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    return topology, layer_of(factors)


def test_costs_change_which_sequence_of_doors_comes_first() -> None:
    topology, layer = dear_door_map()
    query = (8.5, 4.5), (22.5, 4.5)
    short = hn.plan_alternatives(hn.HybridPlanner(topology), *query, 3, max_stretch=4)
    planner = hn.HybridPlanner(topology, preset="grid-astar", costs=layer)
    cheap = hn.plan_alternatives(planner, *query, 3, max_stretch=4)
    assert [other.doors for other in short] == [other.doors for other in cheap][::-1]
    assert len(cheap) == 2
    assert cheap[0].path.length_m > cheap[1].path.length_m
    assert cheap[0].result.cost < cheap[1].result.cost
    assert cheap[1].to_dict()["cost"] == cheap[1].result.cost
    stretch = cheap[1].result.cost / cheap[0].result.cost
    for most, count in ((stretch - 1e-6, 1), (stretch + 1e-6, 2)):
        assert len(hn.plan_alternatives(planner, *query, 3, max_stretch=most)) == count
    closed = np.zeros(topology.grid.shape, np.bool_)
    closed[17, 15] = True
    shut = hn.HybridPlanner(
        topology, preset="grid-astar", costs=layer_of(layer.factors.astype(float), closed)
    )
    only = hn.plan_alternatives(shut, *query, 3, max_stretch=4)
    assert [other.doors for other in only] == [cheap[1].doors]


def test_the_command_prints_alternatives_by_costs(cli: Any, tmp_path: Any) -> None:
    topology, _ = dear_door_map()
    pixels = np.where(topology.grid.classes[::-1] == hn.CellClass.FREE, 254, 0).astype(np.uint8)
    Image.fromarray(pixels).save(tmp_path / "two.pgm")
    (tmp_path / "two.yaml").write_text(
        "image: two.pgm\nresolution: 1.0\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    labels = topology.pyramid.rooms
    assert labels is not None
    hn.save_rooms(tmp_path / "rooms.yaml", labels, topology.grid)
    query: tuple[Any, ...] = (
        "plan",
        tmp_path / "two.yaml",
        "--robot-radius",
        "0",
        "--from",
        "8.5,4.5",
    )
    options = (*query, "--to", "22.5,4.5", "--costs", "clearance:inflation_radius_m=2,multiplier=5")
    options = (*options, "--alternatives", "3", "--preset", "grid-astar")
    options = (*options, "--max-stretch", "4")
    found = json.loads(cli(*options, "--json").out)["alternatives"]
    costs = [other["cost"] for other in found]
    assert len(costs) == 2
    assert costs == sorted(costs)
    assert all(other["metric"] == "weighted" for other in found)
    assert math.isclose(costs[0], found[0]["lower_bound"])
    told = cli(*options).out
    assert "is at most 4 times as dear as the first" in told
    assert all(f"cost {cost:.2f} m (weighted)" in told for cost in costs)
