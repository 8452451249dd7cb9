"""Floors of drawn graphs are put on their maps, whatever one link of them says."""

import math
from dataclasses import replace
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.fleet import (
    BuildingGraph,
    FloorGraph,
    MatchedGraph,
    check_building_graph,
    match_graph,
    moved_floor,
)
from tests.plans import PLAIN

SEEDS = st.integers(0, 10**6)


def floors_with(links: int, rng: np.random.Generator) -> hn.ext.fleet.Building:
    """Two floors of 12 x 16 m with obstacles, in frames of their own, and lifts."""
    floors = []
    for name in ("1", "2"):
        occupied = (rng.random((24, 32)) < 0.15).astype(np.float32)
        origin = tuple(rng.uniform(-9, 9, 2).tolist())
        frame = hn.Frame(0.5, origin_m=origin, yaw_rad=float(rng.uniform(-3, 3)))
        grid = hn.OccupancyGrid(occupied, frame, robot_radius_m=0.0)
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))
        floors.append(hn.ext.fleet.Floor(name, hn.HybridPlanner(topology)))
    places = [free_places(floor, links, rng) for floor in floors]
    lifts = []
    for number in range(links):
        ends = tuple(
            hn.ext.fleet.LinkEnd(floor.name, tuple(of[number]))
            for floor, of in zip(floors, places, strict=True)
        )
        lifts.append(hn.ext.fleet.Link(name=f"lift {number}", kind="lift", ends=ends))
    return hn.ext.fleet.Building(floors, lifts)


def free_places(floor: hn.ext.fleet.Floor, count: int, rng: np.random.Generator) -> list[Any]:
    """Centres of free cells, no two of them within 3 m."""
    grid = floor.planner.grid
    labels, sizes = np.unique(_parts(grid), return_counts=True)
    largest = labels[1:][sizes[1:].argmax()]
    cells = rng.permutation(np.argwhere(_parts(grid) == largest))
    found: list[Any] = []
    for point in grid.frame.points_of(cells).tolist():
        if all(math.dist(point, other) > 3 for other in found):
            found.append(point)
    return found[:count]


def _parts(grid: hn.OccupancyGrid) -> Any:
    from scipy import ndimage

    return ndimage.label(grid.enterable())[0]


def drawn_over(building: hn.ext.fleet.Building) -> BuildingGraph:
    """A sound graph: nodes in free cells, edges between cells side by side, and the links."""
    floors = []
    for floor in building.floors:
        grid = floor.planner.grid
        plain: nx.Graph[str] = nx.Graph()
        for row, col in np.argwhere(grid.enterable()).tolist():
            x, y = grid.frame.points_of(np.array([row, col])).tolist()
            plain.add_node(f"{row} {col}", x=x, y=y)
            for other in (f"{row - 1} {col}", f"{row} {col - 1}"):
                if other in plain:
                    plain.add_edge(f"{row} {col}", other)
        floors.append(
            FloorGraph(name=floor.name, graph=hn.graphs.WaypointGraph.from_networkx(plain))
        )
    return BuildingGraph(name="drawn", floors=tuple(floors), links=building.links)


def with_stray(graph: BuildingGraph, off: tuple[float, float]) -> BuildingGraph:
    """The graph with the end of its last lift on floor 2 drawn elsewhere."""
    *others, last = graph.links
    one, other = last.ends
    x, y = other.position_m
    stray = replace(last, ends=(one, hn.ext.fleet.LinkEnd("2", (x + off[0], y + off[1]))))
    return replace(graph, links=(*others, stray))


def in_frame(graph: BuildingGraph, pose: tuple[float, float, float]) -> BuildingGraph:
    """The graph with its second floor drawn in another frame."""
    x, y, yaw = pose
    cosine, sine = math.cos(yaw), math.sin(yaw)
    links = []
    for link in graph.links:
        one, other = link.ends
        u, v = other.position_m
        at = x + cosine * u - sine * v, y + sine * u + cosine * v
        links.append(replace(link, ends=(one, hn.ext.fleet.LinkEnd("2", at))))
    floors = graph.floors[0], moved_floor(graph.floors[1], pose)
    return replace(graph, floors=floors, links=tuple(links))


def drawn_away(graph: BuildingGraph, rng: np.random.Generator) -> tuple[float, float]:
    """An error of 1.5 to 6 m of the last lift on floor 2.

    Two lifts agree if each is within 0.1 m, so the error changes the distance of two by more.
    """
    one, other = (np.array(link.ends[1].position_m) for link in graph.links[-2:])
    while True:
        angle, by = rng.uniform(-math.pi, math.pi), rng.uniform(1.5, 6)
        off = by * math.cos(angle), by * math.sin(angle)
        if len(graph.links) > 2 or abs(math.dist(one, other + off) - math.dist(one, other)) > 0.25:
            return off


def stray_lifts(matched: MatchedGraph) -> list[str]:
    whole = check_building_graph(matched).findings
    found = [each.where for one in whole if one.kind == "stop-elsewhere" for each in one.examples]
    return [text.split(" at ")[0].removeprefix("lift ") for text in found]


@pytest.mark.parametrize("links", [2, 3, 5])
@PLAIN
@given(SEEDS)
@example(459)  # the link is drawn in a wall, out of which a turn of the floor would bring it
@example(936)
def test_a_link_that_is_drawn_elsewhere_is_reported_and_not_followed(links: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    building = floors_with(links, rng)
    sound = drawn_over(building)
    stray = with_stray(sound, drawn_away(sound, rng))
    # Two links leave the turn of a floor open where one of them is wrong.
    yaw = float(rng.uniform(-3, 3)) if links > 2 else 0.0
    pose = (*rng.uniform(-30, 30, 2).tolist(), yaw)
    matched = match_graph(building, in_frame(stray, pose), align=True)
    n = sound.floors[1].graph.n_nodes
    assert np.allclose(
        matched.floors["2"].graph.points[:n], sound.floors[1].graph.points, atol=1e-6
    )
    assert stray_lifts(matched) == [f"lift {links - 1}"]


@PLAIN
@given(SEEDS)
def test_small_errors_are_shared_by_all_links(seed: int) -> None:
    rng = np.random.default_rng(seed)
    building = floors_with(4, rng)
    sound = drawn_over(building)
    links = []
    for link in sound.links:
        x, y = link.ends[1].position_m
        by = rng.uniform(-0.2, 0.2, 2).tolist()
        links.append(
            replace(link, ends=(link.ends[0], hn.ext.fleet.LinkEnd("2", (x + by[0], y + by[1]))))
        )
    pose = (*rng.uniform(-30, 30, 2).tolist(), float(rng.uniform(-3, 3)))
    matched = match_graph(building, in_frame(replace(sound, links=tuple(links)), pose), align=True)
    assert 0.0 < matched.away_m < 0.6
