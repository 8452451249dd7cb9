"""Faults planted in the graph of a building are found, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.fleet import (
    BuildingGraph,
    BuildingGraphCheck,
    FloorGraph,
    check_building_graph,
    judge_building_graph,
    match_graph,
)
from hybridnav.ext.fleet.graph_network import BuildingNetwork
from hybridnav.graphs import BUILDING_KINDS
from tests.houses import LIFT, STAIRS, two_rooms

NODES = {"a": (1.5, 1.5), "b": (2.5, 2.5), "c": (4.5, 2.5), "d": (6.5, 2.5), "e": (7.5, 4.5)}
EDGES = [("a", "b"), ("b", "c"), ("c", "d"), ("d", "e")]


def link(name: str, kind: Any, *ends: tuple[str, Any], **more: Any) -> hn.ext.fleet.Link:
    return hn.ext.fleet.Link(
        name=name, kind=kind, ends=tuple(hn.ext.fleet.LinkEnd(*end) for end in ends), **more
    )


LINKS = {
    "lift": link("lift", "lift", ("1", LIFT), ("2", LIFT), ride_s=2),
    "B": link("B", "stairs", ("2", STAIRS), ("3", STAIRS), cost_m=3),
}


@pytest.fixture(scope="module")
def house() -> hn.ext.fleet.Building:
    """Three floors of two rooms, a lift from 1 to 2 and stairs from 2 to 3."""
    floors = []
    for name in ("1", "2", "3"):
        pyramid = hn.DualGraphPyramid.build(two_rooms(name), merge_distance_m=2.0)
        floors.append(hn.ext.fleet.Floor(name, hn.HybridPlanner(hn.TopologicalMap(pyramid))))
    return hn.ext.fleet.Building(floors, list(LINKS.values()))


def floor(name: str, change: Callable[[nx.Graph[str]], object] | None = None) -> FloorGraph:
    plain: nx.Graph[str] = nx.Graph()
    for node, (x, y) in NODES.items():
        plain.add_node(node, x=x, y=y)
    plain.add_edges_from(EDGES)
    if change is not None:
        change(plain)
    return FloorGraph(name=name, graph=hn.graphs.WaypointGraph.from_networkx(plain))


def drawn(
    second: Callable[[nx.Graph[str]], object] | None = None,
    names: tuple[str, ...] = ("1", "2", "3"),
    **links: hn.ext.fleet.Link | None,
) -> BuildingGraph:
    """The graph of the house, with its second floor or some links changed; None leaves one out."""
    chosen = [one for one in (LINKS | links).values() if one is not None]
    floors = tuple(floor(name, second if name == "2" else None) for name in names)
    known = [one for one in chosen if all(end.floor in names for end in one.ends)]
    return BuildingGraph(name="drawn", floors=floors, links=tuple(known))


def found(check: BuildingGraphCheck) -> dict[str, list[str]]:
    whole = {one.kind: [each.where for each in one.examples] for one in check.findings}
    for name, own in check.floors.items():
        whole |= {f"{one.kind} {name}": [str(one.count)] for one in own.findings}
    return whole


def without(*edges: tuple[str, str]) -> Callable[[nx.Graph[str]], object]:
    return lambda plain: plain.remove_edges_from(edges)


def test_a_sound_graph_has_no_findings_and_its_routes_are_followed(house):
    matched = match_graph(house, drawn())
    assert found(check_building_graph(matched)) == {}
    report = judge_building_graph(matched, pairs=60)
    assert set(report.counts["all"].answers) <= {"solved", "no node in sight"}
    assert report.contradictions == ()


def moved_node(plain: nx.Graph[str]) -> None:
    plain.nodes["c"]["x"], plain.nodes["c"]["y"] = 4.5, 4.5


FAULTS: dict[str, tuple[BuildingGraph, dict[str, list[str]], str]] = {
    "an edge through a wall": (
        drawn(lambda plain: plain.add_edge("a", "e")),
        {"edge-through-wall 2": ["2"]},
        "its edge from a to e on floor 2 is blocked",
    ),
    "a node in a wall": (
        drawn(moved_node),
        {"node-in-wall 2": ["1"], "edge-through-wall 2": ["4"]},
        "its edge from b to c on floor 2 is blocked",
    ),
    "a floor that is missing": (
        drawn(names=("1", "2")),
        {"floor-missing": ["floor 3"], "link-missing": ["stairs B"]},
        "",
    ),
    "a floor too many": (drawn(names=("1", "2", "3", "4")), {"floor-unknown": ["floor 4"]}, ""),
    "a lift that stops at another floor": (
        drawn(lift=link("lift", "lift", ("1", LIFT), ("3", LIFT))),
        {
            "stop-missing": ["lift lift at floor 2"],
            "stop-unknown": ["lift lift at floor 3: the building's does not stop there"],
        },
        "its ride by lift is none of the building",
    ),
    "a lift at another place": (
        drawn(lift=link("lift", "lift", ("1", LIFT), ("2", (6.5, 2.5)))),
        {"stop-elsewhere": ["lift lift at floor 2: 5.10 m from that of the building"]},
        "its ride by lift is none of the building",
    ),
    "a lift in a wall": (
        drawn(lift=link("lift", "lift", ("1", LIFT), ("2", (0.9, 0.9)))),
        {
            "node-in-wall 2": ["1"],
            "edge-through-wall 2": ["2"],
            "stop-elsewhere": [
                "lift lift at floor 2: a wall is between it and that of the building"
            ],
        },
        "its ride by lift is none of the building",
    ),
    "a lift that is missing": (
        drawn(lift=None),
        {
            "link-missing": ["lift lift"],
            "pieces": ["5 nodes with node a of floor 1, apart from 10"],
        },
        "the graph has no route, and the building has one by lift",
    ),
    "a lift too many": (
        drawn(C=link("C", "lift", ("1", (6.5, 2.5)), ("3", (6.5, 2.5)))),
        {"link-unknown": ["lift C"]},
        "its ride by C is none of the building",
    ),
    "a lift that is drawn as stairs": (
        drawn(lift=link("lift", "stairs", ("1", LIFT), ("2", LIFT))),
        {"link-kind": ["stairs lift, which is of the kind lift"]},
        "",
    ),
    "stairs that the building has up only, drawn both ways": (
        drawn(B=link("B", "stairs", ("2", STAIRS), ("3", STAIRS))),
        {"link-against": ["stairs B from floor 3 to 2"]},
        "its ride by B is none of the building",
    ),
    "stairs that are drawn up only": (
        drawn(B=replace(LINKS["B"], one_way="up")),
        {"one-way 3": ["5"]},
        "the graph has no route, and the building has one",
    ),
    "a piece that is cut off": (
        drawn(without(("c", "d")), B=None),
        {
            "components 2": ["1"],
            "link-missing": ["stairs B"],
            "pieces": [
                "2 nodes with node d of floor 2, apart from 8",
                "5 nodes with node a of floor 3, apart from 8",
            ],
        },
        "the graph has no route, and the building has one",
    ),
}


@pytest.mark.parametrize("name", FAULTS)
def test_a_planted_fault_is_found(house: hn.ext.fleet.Building, name: str) -> None:
    graph, findings, contradiction = FAULTS[name]
    if "link-against" in findings:
        one_way = replace(LINKS["B"], one_way="up")
        house = hn.ext.fleet.Building(house.floors, [LINKS["lift"], one_way])
    matched = match_graph(house, graph)
    check = check_building_graph(matched)
    assert found(check) == findings
    assert check.count > 0
    texts = judge_building_graph(matched, pairs=200).contradictions
    assert any(contradiction in text for text in texts) if contradiction else not texts


def test_routes_there_and_back_may_lead_over_other_floors(house: hn.ext.fleet.Building) -> None:
    second = link("C", "lift", ("1", STAIRS), ("2", STAIRS))
    building = hn.ext.fleet.Building(house.floors, [*house.links, second])
    plain: nx.DiGraph[str] = nx.DiGraph()
    plain.add_nodes_from((node, {"x": x, "y": y}) for node, (x, y) in NODES.items())
    plain.add_edges_from(EDGES)
    one_way = FloorGraph(name="2", graph=hn.graphs.WaypointGraph.from_networkx(plain))
    whole = drawn(C=second)
    loop = replace(whole, floors=(whole.floors[0], one_way, whole.floors[2]))
    assert found(check_building_graph(match_graph(building, loop))) == {}
    # Without the second lift nothing leads back to the first: not from floor 3 either.
    broken = replace(loop, links=loop.links[:-1])
    assert found(check_building_graph(match_graph(house, broken))) == {
        "one-way 2": ["4"],
        "one-way 3": ["5"],
    }


def test_what_no_robot_can_follow_may_be_left_out(house: hn.ext.fleet.Building) -> None:
    for name in ("an edge through a wall", "a lift too many", "a lift at another place"):
        matched = match_graph(house, FAULTS[name][0])
        report = judge_building_graph(matched, pairs=100, clear_edges_only=True)
        assert "contradicted" not in report.counts["all"].answers


def test_a_node_far_outside_an_open_map_is_never_seen() -> None:
    grid = hn.OccupancyGrid(np.zeros((6, 9), dtype=np.float32), robot_radius_m=0.0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))
    building = hn.ext.fleet.Building([hn.ext.fleet.Floor("1", hn.HybridPlanner(topology))])
    plain: nx.Graph[str] = nx.Graph()
    for node, (x, y) in {"a": (1.5, 1.5), "far": (2e8, 1e8), "b": (7.5, 4.5)}.items():
        plain.add_node(node, x=x, y=y)
    plain.add_edges_from([("a", "far"), ("far", "b")])
    graph = FloorGraph(name="1", graph=hn.graphs.WaypointGraph.from_networkx(plain))
    network = BuildingNetwork(match_graph(building, BuildingGraph(name="open", floors=(graph,))))
    leg = np.array([0, 1, 2])
    for point in ((2.5, 2.5), (3.5, 5.5)):
        kept = network.floors[0].network.without_passed(np.array(point), leg)
        assert kept.tolist() == [0, 1, 2]


def test_nodes_are_put_to_corners_and_centres_alone_and_into_no_wall() -> None:
    blocked = np.zeros((3, 3), dtype=np.float32)
    blocked[1, 1] = 1
    grid = hn.OccupancyGrid(blocked, robot_radius_m=0.0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    building = hn.ext.fleet.Building([hn.ext.fleet.Floor("1", hn.HybridPlanner(topology))])
    stay = [(1.3, 0.9995), (0.9995, 0.9995), (0.5004, 2.3), (0.5004, 0.9995)]
    put = {(2.0004, 1.9996): (2.0, 2.0), (0.5004, 2.4996): (0.5, 2.5)}
    plain: nx.Graph[int] = nx.Graph()
    for node, (x, y) in enumerate([*stay, *put]):
        plain.add_node(node, x=x, y=y)
    graph = FloorGraph(name="1", graph=hn.graphs.WaypointGraph.from_networkx(plain))
    matched = match_graph(building, BuildingGraph(name="drawn", floors=(graph,)))
    points = matched.floors["1"].graph.points
    assert points == pytest.approx(np.array([*stay, *put.values()]), abs=1e-9)


def test_every_kind_of_finding_is_planted_here() -> None:
    text = Path(__file__).read_text(encoding="utf-8")
    assert [kind for kind in BUILDING_KINDS if f'"{kind}"' not in text] == []


def test_links_of_other_names_are_met_by_their_places(house: hn.ext.fleet.Building) -> None:
    near = link("K1", "lift", ("1", (1.5, 1.6)), ("2", (1.5, 1.5)))
    matched = match_graph(house, drawn(lift=near))
    assert [one.own and one.own.name for one in matched.links] == ["lift", "B"]
    assert check_building_graph(matched).findings == ()
    far = link("K1", "lift", ("1", (1.5, 2.9)), ("2", (1.5, 1.5)))
    assert match_graph(house, drawn(lift=far)).links[0].own is None


def test_stairs_are_taken_or_not(house: hn.ext.fleet.Building) -> None:
    matched = match_graph(house, drawn())
    counts = judge_building_graph(matched, pairs=60, stairs=False).counts
    assert counts["two floors"].answers["no path, right"] > 0
    assert "no path, right" not in counts["one floor"].answers


def test_floors_have_other_names(house: hn.ext.fleet.Building) -> None:
    graph = drawn(names=("L1", "L2"))
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"floors L1, L2 and the building has 1, 2, 3"
    ):
        match_graph(house, graph)
    matched = match_graph(house, graph, floors={"L1": "1"})
    assert list(matched.floors) == ["1"]
    assert matched.unknown_floors == ("L2",)
    with pytest.raises(hn.errors.InvalidValueError, match="both floor '1'"):
        match_graph(house, graph, floors={"L1": "1", "L2": "1"})
    with pytest.raises(hn.errors.InvalidValueError, match="did you mean L1"):
        match_graph(house, graph, floors={"l1": "1"})
    with pytest.raises(hn.errors.InvalidValueError, match="no floor is called '7'"):
        match_graph(house, graph, floors={"L1": "7"})


def test_nothing_to_align_by(house: hn.ext.fleet.Building) -> None:
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"links lift and none|has the links none"
    ):
        match_graph(house, drawn(lift=None, B=None), align=True)


def test_planners_that_find_no_shortest_paths_are_refused(house: hn.ext.fleet.Building) -> None:
    floors = [
        replace(one, planner=hn.HybridPlanner(one.planner.topology, preset="octile"))
        for one in house.floors
    ]
    other = hn.ext.fleet.Building(floors, house.links)
    with pytest.raises(hn.errors.InvalidValueError, match="load it with preset shortest"):
        judge_building_graph(match_graph(other, drawn()))
