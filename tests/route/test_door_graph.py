"""The graph of doors against networkx, on floors whose doors are known."""

import itertools

import networkx as nx
import numpy as np
import pytest

from hybridnav.route import DoorGraph, DoorRoute, door_graph
from tests.floors import Floor, random_floor


def flat(cell, floor):
    return cell[0] * floor.classes.shape[1] + cell[1]


def doors_of(route: DoorRoute, graph, floor):
    number_of = {
        frozenset(flat(cell, floor) for cell in cells): number
        for number, cells in enumerate(floor.doors)
    }
    at = [int(np.flatnonzero(graph.arcs == arc)[0]) for arc in route.arcs]
    return [
        number_of[frozenset(int(graph.cells_beside(arc, half)[0]) for half in (0, 1))] for arc in at
    ]


def floors(count, seed):
    """Random floors with a start and a goal."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        floor = random_floor(rng)
        free = np.argwhere(floor.classes == 1)
        first, last = (tuple(cell) for cell in rng.choice(free, 2, replace=False).tolist())
        yield floor, first, last


def test_every_route_is_one_of_networkx_and_has_its_length():
    found = first = 0
    for floor, start, goal in floors(25, seed=1):
        graph = DoorGraph(floor.topology.rooms)
        darts = floor.darts(start, goal)
        simple: dict[tuple[int, ...], float] = {}
        if nx.has_path(darts, "start", "goal"):
            paths = nx.shortest_simple_paths(darts, "start", "goal", weight="weight")
            for path in itertools.islice(paths, 200):
                rooms = floor.rooms_passed(start, path[1:-1])
                if len(set(rooms)) == len(rooms):
                    doors = tuple(number for number, _ in path[1:-1])
                    simple.setdefault(doors, nx.path_weight(darts, path, "weight"))
        routes = list(graph.routes(flat(start, floor), flat(goal, floor)))
        lengths = [route.length_m for route in routes]
        assert lengths == pytest.approx(sorted(lengths))
        known = [tuple(doors_of(route, graph, floor)) for route in routes]
        assert len(set(known)) == len(known)
        for doors, length in zip(known, lengths, strict=True):
            if doors in simple:
                assert length == pytest.approx(simple[doors])
                found += 1
            else:  # networkx was stopped before it came to it
                assert length >= max(simple.values()) - 1e-9
        if simple:
            assert lengths[0] == pytest.approx(min(simple.values()))
            first += 1
    assert found > 60
    assert first > 12


def test_the_routes_are_the_shortest_over_each_pair_of_doors():
    """Where shortest paths are unique, each pair has its route, unless a room comes twice."""
    compared = 0
    for floor, start, goal in floors(25, seed=2):
        darts = floor.darts(start, goal)
        graph = door_graph(floor.topology)
        lengths = {
            tuple(doors_of(route, graph, floor)): route.length_m
            for route in graph.routes(flat(start, floor), flat(goal, floor))
        }
        for tail, head in darts.edges:
            if not (nx.has_path(darts, "start", tail) and nx.has_path(darts, head, "goal")):
                continue
            coming = list(nx.all_shortest_paths(darts, "start", tail, weight="weight"))
            going = list(nx.all_shortest_paths(darts, head, "goal", weight="weight"))
            if len(coming) > 1 or len(going) > 1:
                continue
            path = coming[0] + going[0]
            rooms = floor.rooms_passed(start, path[1:-1])
            if len(set(rooms)) == len(rooms):
                length = nx.path_weight(darts, path, "weight")
                assert lengths[tuple(number for number, _ in path[1:-1])] == pytest.approx(length)
                compared += 1
    assert compared > 200


def test_closed_cells_count_as_in_a_map_that_never_had_them():
    rng = np.random.default_rng(3)
    changed = 0
    for floor, start, goal in floors(15, seed=3):
        graph = DoorGraph(floor.topology.rooms)
        free = np.argwhere(floor.classes == 1)
        cells = [tuple(cell) for cell in rng.choice(free, 6, replace=False).tolist()]
        shut = np.unique([flat(cell, floor) for cell in cells if cell not in {start, goal}])
        ends = flat(start, floor), flat(goal, floor)
        found = [(route.arcs, route.legs_m) for route in graph.closed(shut).routes(*ends)]
        walled = floor.classes.copy()
        walled.ravel()[shut] = 0
        doors = [pair for pair in floor.doors if all(walled[cell] for cell in pair)]
        darts = Floor(walled, floor.label_of, doors).darts(start, goal)
        if found and nx.has_path(darts, "start", "goal"):
            path = nx.dijkstra_path(darts, "start", "goal")
            shortest = nx.path_weight(darts, path, "weight")
            rooms = floor.rooms_passed(start, path[1:-1])
            assert sum(found[0][1]) >= shortest - 1e-9
            if len(set(rooms)) == len(rooms):
                assert sum(found[0][1]) == pytest.approx(shortest)
        else:
            assert not found
        changed += found != [(route.arcs, route.legs_m) for route in graph.routes(*ends)]
        assert graph.closed(shut) is graph.closed(shut.copy())
    assert changed > 5
