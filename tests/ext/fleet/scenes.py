"""Random buildings, and the optimal costs of their routes by code of their own."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse

import hybridnav as hn
from hybridnav.harness.judges import VisibilityGraph

STEPS = [(0, 1), (1, 0), (1, 1), (1, -1)]
KINDS = ("lift", "stairs", "ramp")
Where = tuple[int, Any]
"""Index of a floor, and a point on it."""


@dataclass(frozen=True)
class Scene:
    """A building, and points on its floors."""

    building: hn.ext.fleet.Building
    rng: np.random.Generator

    @property
    def grids(self) -> list[hn.OccupancyGrid]:
        return [floor.planner.grid for floor in self.building.floors]

    def somewhere(self) -> Where:
        index = int(self.rng.integers(len(self.building.floors)))
        return index, free_point(self.grids[index], self.rng)

    def named(self, where: Where) -> tuple[str, Any]:
        """The point as `Building.plan` takes it."""
        return self.building.floors[where[0]].name, where[1]


def free_point(grid: hn.OccupancyGrid, rng: np.random.Generator) -> Any:
    """The centre of a free cell: where cells and points have one distance."""
    cells = np.argwhere(grid.enterable())
    return grid.frame.points_of(cells[rng.integers(len(cells))])


def random_building(
    seed: int, *, preset: str = "shortest", most_floors: int = 6, shape: tuple[int, int] = (12, 14)
) -> Scene:
    """Floors of random obstacles in frames of their own, joined by links that do not line up."""
    rng = np.random.default_rng(seed)
    floors = []
    for number in range(int(rng.integers(2, most_floors + 1))):
        probability = (rng.random(shape) < rng.choice([0.1, 0.3])).astype(np.float32)
        probability[tuple(rng.integers(shape))] = 0.0
        origin = (float(rng.uniform(-9, 9)), float(rng.uniform(-9, 9)))
        frame = hn.Frame(0.25, origin_m=origin, yaw_rad=float(rng.uniform(-3, 3)))
        grid = hn.OccupancyGrid(probability, frame, robot_radius_m=0.1)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
        planner = hn.HybridPlanner(topology, preset=preset)
        floors.append(hn.ext.fleet.Floor(f"floor {number}", planner, elevation_m=3.0 * number))
    links = [random_link(f"link {number}", floors, rng) for number in range(rng.integers(1, 6))]
    return Scene(hn.ext.fleet.Building(floors, links, speed_m_s=float(rng.uniform(0.2, 1.0))), rng)


def random_link(
    name: str, floors: Sequence[hn.ext.fleet.Floor], rng: np.random.Generator
) -> hn.ext.fleet.Link:
    """A link between some of the floors, whose ends do not line up."""
    count = int(rng.integers(2, len(floors) + 1))
    chosen = sorted(rng.choice(len(floors), size=count, replace=False).tolist())
    ends = []
    for index in chosen:
        point = free_point(floors[index].planner.grid, rng)
        ends.append(hn.ext.fleet.LinkEnd(floors[index].name, tuple(point.tolist())))
    return hn.ext.fleet.Link(
        name=name,
        kind=KINDS[rng.integers(3)],  # type: ignore[arg-type]
        ends=tuple(ends),
        wait_s=float(rng.choice([0.0, rng.uniform(0, 5)])),
        ride_s=float(rng.choice([0.0, rng.uniform(0, 2)])),
        cost_m=float(rng.choice([0.0, rng.uniform(0, 2)])),
        max_radius_m=float(rng.choice([math.inf, 0.3, 0.05], p=[0.6, 0.3, 0.1])),
    )


def usable(scene: Scene, closed: set[str], *, stairs: bool) -> list[hn.ext.fleet.Link]:
    """The links that the robot may use, by their own rules."""
    radius_m = scene.building.robot_radius_m
    return [
        link
        for link in scene.building.links
        if link.name not in closed
        and link.max_radius_m >= radius_m
        and (stairs or link.kind != "stairs")
    ]


def charge(link: hn.ext.fleet.Link, start: int, goal: int, speed_m_s: float) -> float:
    """What a ride between two of its ends costs, counted again."""
    return link.cost_m + speed_m_s * (link.wait_s + link.ride_s * abs(start - goal))


def optimum_on_cells(
    scene: Scene, start: Where, goal: Where, links: list[hn.ext.fleet.Link], open_cells: list[Any]
) -> float:
    """The cost of a cheapest route by cells, by Dijkstra on the joined grids.

    `open_cells` are the cells of each floor that may be entered, bool (rows, cols).
    """
    offsets = np.concatenate([[0], np.cumsum([cells.size for cells in open_cells])]).tolist()
    edges = []
    for grid, cells, base in zip(scene.grids, open_cells, offsets, strict=False):
        edges += _moves(cells, base, grid.resolution_m)
    n = offsets[-1]
    for link in links:
        at = [_node(scene, _index(scene, end.floor), end.position_m, offsets) for end in link.ends]
        # A node for each end at which a ride ends, so that rides are not free of their charge.
        for (one, a), (other, b) in itertools.permutations(list(enumerate(at)), 2):
            if _is_open(open_cells, offsets, a) and _is_open(open_cells, offsets, b):
                edges.append((a, b, charge(link, one, other, scene.building.speed_m_s)))
    first, last = (_node(scene, *where, offsets) for where in (start, goal))
    return _dijkstra(edges, n, first, last)


def optimum_any_angle(
    scene: Scene, start: Where, goal: Where, links: list[hn.ext.fleet.Link]
) -> float:
    """The cost of a cheapest route at any angle, by a visibility graph of each floor."""
    points: list[list[Any]] = [[] for _ in scene.grids]
    node_of: list[tuple[int, int]] = []

    def add(index: int, point: Any) -> int:
        points[index].append(point)
        node_of.append((index, len(node_of)))
        return len(node_of) - 1

    edges = []
    first, last = add(*start), add(*goal)
    for link in links:
        at = [add(_index(scene, end.floor), end.position_m) for end in link.ends]
        for (one, a), (other, b) in itertools.permutations(list(enumerate(at)), 2):
            edges.append((a, b, charge(link, one, other, scene.building.speed_m_s)))
    for index, grid in enumerate(scene.grids):
        graph = VisibilityGraph(grid)
        here = [number for at, number in node_of if at == index]
        cells: list[Any] = [grid.frame.cell_of(*point) for point in points[index]]
        for (a, from_cell), (b, to_cell) in itertools.combinations(
            zip(here, cells, strict=True), 2
        ):
            length_m = graph.shortest(from_cell, to_cell).length_m
            edges += [(a, b, length_m), (b, a, length_m)]
    return _dijkstra(edges, len(node_of), first, last)


def _dijkstra(edges: list[tuple[int, int, float]], n: int, first: int, last: int) -> float:
    """The least cost; parallel edges keep the cheapest, and edges of no cost stay edges."""
    least: dict[tuple[int, int], float] = {}
    for a, b, cost in edges:
        if a != b and cost < least.get((a, b), math.inf):
            least[a, b] = cost
    if first == last:
        return 0.0
    if not least:
        return math.inf
    (rows, cols), costs = zip(*least, strict=True), list(least.values())
    # scipy takes an explicit 0 of a sparse matrix for an edge, if it is not summed away.
    graph = sparse.csr_array((costs, (rows, cols)), shape=(n, n))
    found: Any = sparse.csgraph.dijkstra(graph, indices=first)  # type: ignore[call-overload]
    return float(found[last])


def _moves(cells: Any, base: int, resolution_m: float) -> list[tuple[int, int, float]]:
    rows, cols = cells.shape
    found = []
    for row, col in np.argwhere(cells).tolist():
        for up, right in STEPS:
            to = row + up, col + right
            if not (0 <= to[0] < rows and 0 <= to[1] < cols):
                continue
            if cells[to] and cells[row, to[1]] and cells[to[0], col]:
                a, b = base + row * cols + col, base + to[0] * cols + to[1]
                length_m = math.hypot(up, right) * resolution_m
                found += [(a, b, length_m), (b, a, length_m)]
    return found


def _index(scene: Scene, name: str) -> int:
    return [floor.name for floor in scene.building.floors].index(name)


def _node(scene: Scene, index: int, point: Any, offsets: list[int]) -> int:
    row, col = scene.grids[index].frame.cell_of(*point)
    return int(offsets[index] + row * scene.grids[index].shape[1] + col)


def _is_open(open_cells: list[Any], offsets: list[int], node: int) -> bool:
    index = int(np.searchsorted(offsets, node, side="right")) - 1
    return bool(open_cells[index].ravel()[node - offsets[index]])
