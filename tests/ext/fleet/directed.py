"""Routes over floors with directed lines and closed cells, held against an oracle of the parts."""

import itertools
import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

import networkx as nx
import numpy as np

import hybridnav as hn
from tests.ext.fleet.scenes import Scene, charge, random_building
from tests.one_way import CELLS, random_sides
from tests.oracle.one_way import OneWayPlane

Cell = tuple[int, int]
Spot = tuple[int, Cell]
"""Index of a floor, and a cell on it."""


def floor_faults(seed: int, preset: str, *, n_queries: int = 3) -> Iterator[str]:
    """What is wrong with the routes over the two or three floors of a random building, of which
    each has one to six lines, and some closed cells; half of its links lead one way."""
    scene = random_building(seed, preset=preset, most_floors=3, shape=(6, 7))
    rng = np.random.default_rng([64, seed])
    given = scene.building
    ways: Any = rng.choice(["", "", "up", "down"], len(given.links)).tolist()
    links = [replace(a, one_way=way or None) for a, way in zip(given.links, ways, strict=True)]
    house = hn.ext.fleet.Building(given.floors, links, speed_m_s=given.speed_m_s)
    scene = replace(scene, building=house)
    for _ in range(n_queries):
        ends = scene.somewhere(), scene.somewhere()
        spots = [spot_of(scene, index, point) for index, point in ends]
        planes, blocked = [], {}
        for index, floor in enumerate(scene.building.floors):
            free, sides = scene.grids[index].enterable().copy(), random_sides(rng, 6, 7)
            shut = free & (rng.random(free.shape) < rng.choice([0.0, 0.1]))
            for _, cell in (spot for spot in spots if spot[0] == index):
                shut[cell] = False
            free &= ~shut
            planes.append(OneWayPlane(free, sides))
            blocked[floor.name] = hn.Blocked(cells=np.argwhere(shut), one_way={"sides": sides})
        plan = scene.building.plan(*map(scene.named, ends), blocked=blocked)
        least = optimum(scene.building, planes, spots, by_cells=preset in CELLS)
        asked = f"building {seed}, {preset} from {spots[0]} to {spots[1]}: "
        if plan.solved != math.isfinite(least):
            yield f"{asked}{plan.status}, the optimum is {least}"
        elif plan.solved and (plan.cost < least - 1e-9 or plan.lower_bound > least + 1e-9):
            yield f"{asked}cost {plan.cost}, bound {plan.lower_bound}, the optimum is {least}"
        elif plan.solved and preset != "paper" and plan.cost > least + 1e-9:
            yield f"{asked}cost {plan.cost}, the optimum is {least}"


def spot_of(scene: Scene, index: int, point: Any) -> Spot:
    """The cell of a point on a floor."""
    return index, scene.grids[index].frame.cell_of(*point)


def optimum(  # noqa: PLR0913 - a question with defaults
    building: hn.ext.fleet.Building,
    planes: list[OneWayPlane],
    ends: list[Spot],
    *,
    by_cells: bool,
    closed: Collection[str] = (),
    factors: Sequence[Any] = (),
) -> float:
    """The least cost from one spot to another: directed lengths on floors, charges of rides.

    `closed`: links that are closed, `NAME`, `NAME@FLOOR`, `NAME=up`; `factors`: costs of cells.
    """
    number = {floor.name: k for k, floor in enumerate(building.floors)}
    graph: nx.DiGraph[Spot] = nx.DiGraph()
    graph.add_nodes_from(ends)
    grids = [floor.planner.grid for floor in building.floors]
    for link in building.links:
        floors = [end.floor for end in link.ends]
        at = [grids[number[end.floor]].frame.cell_of(*end.position_m) for end in link.ends]
        spots = [(number[floor], cell) for floor, cell in zip(floors, at, strict=True)]
        fits = building.robot_radius_m <= link.max_radius_m
        for (k, one), (n, two) in itertools.permutations(list(enumerate(spots)), 2):
            back = "down" if k < n else "up"
            by = ("", f"={back}", f"@{floors[k]}", f"@{floors[n]}")
            if not fits or link.one_way == back or {link.name + text for text in by} & set(closed):
                continue
            weight = charge(link, k, n, building.speed_m_s)
            if weight < graph.get_edge_data(one, two, {"weight": math.inf})["weight"]:
                graph.add_edge(one, two, weight=weight)
    for index, plane in enumerate(planes):
        spots = [spot for spot in graph if spot[0] == index]
        shut = [spot for spot in spots if not plane.free[spot[1]]]
        graph.remove_nodes_from(shut)
        spots = [spot for spot in spots if spot not in shut]
        own = factors[index] if factors else None
        for one, two, cells in lengths(plane, spots, own, by_cells=by_cells):
            if math.isfinite(cells):
                graph.add_edge(one, two, weight=cells * grids[index].resolution_m)
    found = nx.single_source_dijkstra_path_length(graph, ends[0])
    return float(found.get(ends[1], math.inf))


def lengths(
    plane: OneWayPlane, spots: list[Spot], factors: Any = None, *, by_cells: bool
) -> Iterator[tuple[Spot, Spot, float]]:
    """The directed lengths between the centres of cells, in cells; with `factors` their costs."""
    if by_cells:
        for one, two in itertools.permutations(spots, 2):
            yield one, two, plane.cells_length(one[1], two[1], factors)
        return
    half = Fraction(1, 2)
    placed = [(cell, (cell[0] + half, cell[1] + half)) for _, cell in spots]
    table = plane.lengths(placed, placed) if placed else np.empty((0, 0))
    for (i, one), (j, two) in itertools.permutations(list(enumerate(spots)), 2):
        yield one, two, float(table[i, j])
