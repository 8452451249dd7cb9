"""Routes on drawn graphs of buildings: the stated policy by networkx, and the answers counted."""

import itertools
import math
from dataclasses import dataclass, field, replace
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.fleet import (
    BuildingGraph,
    FloorGraph,
    align_floors,
    check_building_graph,
    judge_building_graph,
    match_graph,
)
from hybridnav.ext.fleet.graph_check import drawn_pairs
from hybridnav.ext.fleet.graph_network import BuildingNetwork
from hybridnav.harness.judges import segment_faults
from tests.ext.fleet.scenes import Scene, charge, optimum_any_angle, random_building, usable
from tests.plans import PLAIN

SEEDS = st.integers(0, 10**6)
Node = tuple[str, int]


@dataclass
class Drawing:
    """A graph that a careless hand has drawn over a building."""

    scene: Scene
    graph: BuildingGraph
    points: dict[Node, Any] = field(default_factory=dict)
    ends: dict[tuple[str, str], Node] = field(default_factory=dict)
    """The node at the end of each link on each floor."""


def drawn(seed: int) -> Drawing:
    """Random nodes, some in walls, random edges, and the links at points near their own."""
    scene = random_building(seed, most_floors=3, shape=(8, 9))
    rng = scene.rng
    drawing = Drawing(scene, None)  # type: ignore[arg-type]
    links = []
    plain: dict[str, nx.DiGraph[int]] = {f.name: nx.DiGraph() for f in scene.building.floors}
    for floor, grid in zip(scene.building.floors, scene.grids, strict=True):
        for _ in range(rng.integers(2, 9)):
            at = grid.frame.points_of_grid(rng.uniform(0, grid.shape))
            add_node(drawing, plain, floor.name, at)
    for link in scene.building.links:
        ends = []
        for end in link.ends:
            off = rng.uniform(0.02, 0.3, 2) * rng.choice([-1, 1], 2) * rng.choice([1, 1, 1, 6])
            at = np.asarray(end.position_m) + off
            drawing.ends[link.name, end.floor] = add_node(drawing, plain, end.floor, at)
            ends.append(hn.ext.fleet.LinkEnd(end.floor, tuple(at.tolist())))
        links.append(hn.ext.fleet.Link(name=link.name, kind=link.kind, ends=tuple(ends)))
    floors = []
    for name, graph in plain.items():
        for _ in range(3 * len(graph)):
            tail, head = rng.integers(len(graph), size=2).tolist()
            graph.add_edge(tail, head)
        floors.append(FloorGraph(name=name, graph=hn.graphs.WaypointGraph.from_networkx(graph)))
    drawing.graph = BuildingGraph(name="drawn", floors=tuple(floors), links=tuple(links))
    return drawing


def add_node(drawing: Drawing, plain: dict[str, Any], floor: str, at: Any) -> Node:
    node = floor, len(plain[floor])
    plain[floor].add_node(node[1], x=float(at[0]), y=float(at[1]))
    drawing.points[node] = (float(at[0]), float(at[1]))
    return node


@dataclass
class Wanted:
    """What the policy answers: a route, or why there is none."""

    reason: str = ""
    nodes: list[Node] = field(default_factory=list)
    cost: float = math.inf
    is_sound: bool = True


class ByWords:
    """The policy, from its words alone."""

    def __init__(self, drawing: Drawing, *, stairs: bool, clear: bool) -> None:
        self.scene, self.points, self.ends = drawing.scene, drawing.points, drawing.ends
        self.grid_of = dict(
            zip((f.name for f in self.scene.building.floors), self.scene.grids, strict=True)
        )
        self.whole: nx.MultiDiGraph[Node] = nx.MultiDiGraph()
        self.whole.add_nodes_from(self.points)
        for floor in drawing.graph.floors:
            for tail, head in floor.graph.edges.tolist():
                one, other = (floor.name, tail), (floor.name, head)
                cost = math.dist(self.points[one], self.points[other])
                is_sound = self.sees(floor.name, self.points[one], self.points[other])
                if is_sound or not clear:
                    self.whole.add_edge(one, other, cost=cost, is_sound=is_sound)
        for link in usable(self.scene, set(), stairs=stairs):
            for first, last in itertools.permutations(range(len(link.ends)), 2):
                cost, is_sound = charge(link, first, last, self.scene.building.speed_m_s), True
                pair = [link.ends[first], link.ends[last]]
                for end in pair:
                    at = self.points[self.ends[link.name, end.floor]]
                    cost += math.dist(at, end.position_m)
                    is_near = math.dist(at, end.position_m) <= 1
                    is_sound &= is_near and self.sees(end.floor, at, end.position_m)
                if is_sound or not clear:
                    nodes = [self.ends[link.name, end.floor] for end in pair]
                    self.whole.add_edge(*nodes, cost=cost, is_sound=is_sound)

    def sees(self, floor: str, one: Any, other: Any) -> bool:
        """Whether a robot can drive straight from one point to another."""
        return not segment_faults(self.grid_of[floor], [one, other])

    def route(self, start: tuple[str, Any], goal: tuple[str, Any]) -> Wanted:
        if start[0] == goal[0] and self.sees(start[0], start[1], goal[1]):
            return Wanted(cost=math.dist(start[1], goal[1]))
        nearest: list[Node] = []
        for floor, at in (start, goal):
            near = [
                node
                for node, point in self.points.items()
                if node[0] == floor and self.sees(floor, at, point)
            ]
            if not near:
                return Wanted("no node in sight of the " + ("goal" if nearest else "start"))
            nearest.append(min(near, key=lambda node: math.dist(at, self.points[node])))
        if not nx.has_path(self.whole, nearest[0], nearest[1]):
            return Wanted()
        nodes = nx.shortest_path(self.whole, nearest[0], nearest[1], weight="cost")
        nodes = self.without_passed(start, nodes)
        nodes = self.without_passed(goal, nodes[::-1])[::-1]
        parts = [
            min(self.whole.get_edge_data(*pair).values(), key=lambda facts: facts["cost"])
            for pair in itertools.pairwise(nodes)
        ]
        ends = (
            math.dist(start[1], self.points[nodes[0]]),
            math.dist(self.points[nodes[-1]], goal[1]),
        )
        cost = sum(ends) + sum(part["cost"] for part in parts)
        return Wanted("", nodes, cost, all(part["is_sound"] for part in parts))

    def without_passed(self, end: tuple[str, Any], nodes: list[Node]) -> list[Node]:
        """The nodes without the first, if it was passed and the next is seen."""
        if len(nodes) < 2 or nodes[0][0] != nodes[1][0]:
            return nodes
        one, other = (self.points[node] for node in nodes[:2])
        along = np.subtract(other, one) @ np.subtract(end[1], one)
        return nodes[1:] if along > 0 and self.sees(end[0], end[1], other) else nodes


@pytest.mark.parametrize("clear", [False, True])
@PLAIN
@given(SEEDS)
def test_routes_are_those_of_the_policy(clear: bool, seed: int) -> None:
    drawing = drawn(seed)
    scene, building = drawing.scene, drawing.scene.building
    stairs = bool(scene.rng.random() < 0.7)
    matched = match_graph(building, drawing.graph)
    network = BuildingNetwork(matched, stairs=stairs, clear_edges_only=clear)
    words = ByWords(drawing, stairs=stairs, clear=clear)
    for _ in range(4):
        ends = [scene.somewhere() for _ in range(2)]
        at = [(index, scene.grids[index].frame.positions_of(point)) for index, point in ends]
        at = [(index, np.floor(position) + 0.5) for index, position in at]
        found = network.route(at[0], at[1])
        wanted = words.route(scene.named(ends[0]), scene.named(ends[1]))
        if math.isinf(wanted.cost):
            assert found == wanted.reason
            continue
        assert not isinstance(found, str)
        assert found.cost == pytest.approx(wanted.cost)
        assert bool(found.fault) == (not wanted.is_sound)
        floors = [ends[0][0], *(node[0] for node in wanted.nodes)]
        floors[0] = building.floors[ends[0][0]].name
        assert found.floors == tuple(name for name, _ in itertools.groupby(floors))
        inner = np.concatenate(found.lines)[1:-1]
        points = [drawing.points[node] for node in wanted.nodes]
        assert np.allclose(inner, np.reshape(points, (-1, 2)), atol=1e-6)


@PLAIN
@given(SEEDS)
def test_answers_are_counted_and_losses_are_over_the_optimum(seed: int) -> None:
    drawing = drawn(seed)
    scene, building = drawing.scene, drawing.scene.building
    if not any(
        (np.bincount(labels[labels > 0]) * 0.25**2 >= 1).any()
        for labels in (_labelled(grid) for grid in scene.grids)
    ):
        return
    report = judge_building_graph(match_graph(building, drawing.graph), pairs=12, seed=seed)
    words = ByWords(drawing, stairs=True, clear=False)
    links = usable(scene, set(), stairs=True)
    answers: dict[str, int] = {}
    losses = []
    for one, other in drawn_pairs(building, 12, np.random.default_rng(seed)):
        ends = [(at[0], scene.grids[at[0]].frame.points_of_grid(at[1])) for at in (one, other)]
        wanted = words.route(scene.named(ends[0]), scene.named(ends[1]))
        optimum = optimum_any_angle(scene, ends[0], ends[1], links)
        if math.isfinite(wanted.cost):
            answer = "solved" if wanted.is_sound else "contradicted"
        else:
            is_wrong = "wrong" if math.isfinite(optimum) else "right"
            answer = "no node in sight" if wanted.reason else f"no path, {is_wrong}"
        answers[answer] = answers.get(answer, 0) + 1
        if answer == "solved" and optimum > 0:
            losses.append(wanted.cost / optimum - 1)
    whole = report.counts["all"]
    assert whole.answers == answers
    assert whole.pairs == 12
    assert whole.inconsistent == len(report.contradictions)
    assert sum(report.counts[name].pairs for name in report.counts if name != "all") == 12
    assert (whole.loss is None) == (not losses)
    if whole.loss is not None:
        assert whole.loss.mean == pytest.approx(np.mean(losses), abs=1e-6)
        assert whole.loss.greatest == pytest.approx(max(losses), abs=1e-6)
        assert min(losses) > -1e-6


def _labelled(grid: hn.OccupancyGrid) -> Any:
    from scipy import ndimage

    return ndimage.label(grid.enterable())[0]


@PLAIN
@given(SEEDS)
def test_floors_in_one_frame_are_moved_back_to_their_maps(seed: int) -> None:
    drawing = drawn(seed)
    scene, building = drawing.scene, drawing.scene.building
    exact = replace(drawing.graph, links=building.links)
    moved = align_floors(exact)
    here = match_graph(building, exact)
    there = match_graph(building, moved, align=True)
    for name, floor in here.floors.items():
        stops = [link for link in building.links if link.end_on(name) is not None]
        # One stop shifts a floor; how it was turned, nobody can know.
        if len(stops) != 1 and len({link.end_on(name).position_m for link in stops}) > 1:
            assert np.allclose(there.floors[name].graph.points, floor.graph.points, atol=1e-9)
        for link in there.links:
            if len(stops) == 1 and link.drawn == moved.links[building.links.index(stops[0])]:
                assert link.ends[name] == pytest.approx(stops[0].end_on(name).position_m)
    assert scene.building is there.building
    assert check_building_graph(here).matched is here
