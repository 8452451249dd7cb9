"""Graphs of several floors: joined by links, and brought into one frame."""

import math
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import hybridnav as hn
from hybridnav.ext.fleet import (
    BuildingGraph,
    DoorLine,
    FloorArea,
    FloorGraph,
    Link,
    LinkEnd,
    align_floors,
    join_links,
    moved_floor,
    to_networkx,
)
from tests.drawn_rooms import topology_of
from tests.ext.fleet.files.drawn_buildings import buildings
from tests.ext.fleet.scenes import random_building
from tests.strategies import tried

COORDINATES = st.integers(-2000, 2000).map(lambda value: value / 100)
POINTS = st.tuples(COORDINATES, COORDINATES)
LIFT = Link(name="a", kind="lift", ends=(LinkEnd("1", (0, 0)), LinkEnd("2", (0, 0))))
POSES = st.tuples(COORDINATES, COORDINATES, st.floats(-math.pi, math.pi))


def graph_at(*points):
    plain: nx.DiGraph[Any] = nx.DiGraph()
    for node, (x, y) in enumerate(points):
        plain.add_node(node, x=x, y=y)
    return hn.graphs.WaypointGraph.from_networkx(plain)


def floor(name, *points):
    return FloorGraph(name=name, graph=graph_at(*points or [(0, 0)]))


def moved(points, pose):
    x, y, yaw = pose
    turned = Rotation.from_euler("z", yaw).apply(np.column_stack([points, np.zeros(len(points))]))
    return turned[:, :2] + (x, y)


@tried(100, st.lists(POINTS, min_size=1, max_size=5), POSES)
def test_a_floor_moves_with_all_that_lies_on_it(points, pose):
    own = FloorGraph(
        name="1",
        graph=graph_at(*points),
        doors=(DoorLine("d", (points[0], points[-1]), ("a", None)),),
        areas=(FloorArea("a", "room", np.array([[0, 0], [4, 0], [4, 3.0]])),),
    )
    there = moved_floor(own, pose)
    assert there.graph.points == pytest.approx(moved(np.array(points), pose), abs=1e-9)
    assert np.array(there.doors[0].ends) == pytest.approx(
        moved(np.array([points[0], points[-1]]), pose), abs=1e-9
    )
    assert there.areas[0].outline == pytest.approx(moved(own.areas[0].outline, pose), abs=1e-9)
    assert there.doors[0].rooms == ("a", None)
    with pytest.raises(hn.errors.InvalidValueError, match="finite numbers"):
        moved_floor(own, (0.0, math.nan, 0.0))


@tried(
    100,
    st.lists(POINTS, min_size=2, max_size=4, unique=True),
    st.lists(POSES, min_size=1, max_size=3),
)
def test_floors_of_one_building_fall_on_each_other_again(points, poses):
    """Floors whose lifts lie above each other, each drawn in a frame of its own."""
    assume(np.ptp(np.array(points), axis=0).max() > 0.5)
    names = ["0", *map(str, range(1, len(poses) + 1))]
    frames = [np.array(points)] + [moved(np.array(points), pose) for pose in poses]
    links = [
        Link(
            name=f"lift {k}",
            kind="lift",
            ends=tuple(
                LinkEnd(name, (float(at[k][0]), float(at[k][1])))
                for name, at in zip(names, frames, strict=True)
            ),
        )
        for k in range(len(points))
    ]
    floors = [floor(name, *at.tolist()) for name, at in zip(names, frames, strict=True)]
    building = BuildingGraph(name="b", floors=tuple(floors), links=tuple(links))
    aligned = align_floors(building)
    for each in aligned.floors:
        assert each.graph.points == pytest.approx(np.array(points), abs=1e-6)
    for link, at in zip(aligned.links, points, strict=True):
        assert all(end.position_m == pytest.approx(at, abs=1e-6) for end in link.ends)


@tried(100, st.lists(st.tuples(POINTS, POINTS), min_size=3, max_size=6))
def test_what_does_not_fit_is_fitted_as_by_least_squares(pairs):
    low, high = (np.array(each) for each in zip(*pairs, strict=True))
    rough = np.column_stack([high - high.mean(axis=0), np.zeros(len(high))])
    wanted = np.column_stack([low - low.mean(axis=0), np.zeros(len(low))])
    links = [
        Link(name=str(k), kind="lift", ends=(LinkEnd("0", a), LinkEnd("1", b)))
        for k, (a, b) in enumerate(pairs)
    ]
    building = BuildingGraph(name="b", floors=(floor("0"), floor("1")), links=tuple(links))
    aligned = align_floors(building)
    ours = math.fsum(
        math.dist(*(end.position_m for end in link.ends)) ** 2 for link in aligned.links
    )
    best = min(
        float(((Rotation.from_euler("z", yaw).apply(rough) - wanted) ** 2).sum())
        for yaw in np.linspace(-math.pi, math.pi, 721)
    )
    assert ours <= best * (1 + 1e-9) + 1e-9


def test_one_link_shifts_a_floor_and_none_leaves_it():
    lift = Link(name="a", kind="lift", ends=(LinkEnd("0", (1, 1)), LinkEnd("1", (3, 4))))
    floors = (floor("0"), floor("1"), floor("2", (7, 7)))
    aligned = align_floors(BuildingGraph(name="b", floors=floors, links=(lift,)))
    assert aligned.floor("1").graph.points.tolist() == [[-2.0, -3.0]]
    assert aligned.floor("2") is floors[2]


@tried(100, buildings())
def test_links_join_floors_at_their_ends(building):
    joined = join_links(building)
    assert join_links(joined) is joined
    for before, after in zip(building.floors, joined.floors, strict=True):
        n, m = before.graph.n_nodes, before.graph.n_edges
        assert (after.graph.points[:n] == before.graph.points).all()
        assert (after.graph.edges[:m] == before.graph.edges).all()
        assert len(set(after.graph.names)) == after.graph.n_nodes
        new = range(n, after.graph.n_nodes)
        for node in new:
            away = np.hypot(*(before.graph.points - after.graph.points[node]).T)
            (to,) = {int(a) for a, b in after.graph.edges if b == node}
            assert away[to] == away.min()
    whole = to_networkx(building)
    assert len(whole) == sum(each.graph.n_nodes for each in joined.floors)
    crossing = [facts for a, b, facts in whole.edges(data=True) if a[0] != b[0]]
    ways = [1 if link.one_way else 2 for link in building.links]
    pairs = [len(link.ends) - 1 for link in building.links]
    assert len(crossing) == sum(np.multiply(ways, pairs))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"floors": ()}, "has the floors none"),
        ({"floors": (floor("1"), floor("1"))}, "expected one or more of different names"),
        ({"floors": (floor("1"),)}, "has an end on floor '2', expected one of 1"),
        ({"floors": (3,)}, "expected a FloorGraph"),
        ({"links": (LIFT, LIFT)}, "two links of one name"),
    ],
)  # fmt: skip
def test_floors_and_links_that_do_not_fit_are_refused(change, words):
    given = {"floors": (floor("1"), floor("2")), "links": (LIFT,)}
    with pytest.raises(hn.errors.InvalidValueError, match=words):
        BuildingGraph(name="b", **(given | change))


def test_a_floor_that_is_not_there():
    with pytest.raises(hn.errors.InvalidValueError, match="no floor is called '3': there are 1, 2"):
        BuildingGraph(name="b", floors=(floor("1"), floor("2"))).floor("3")
    with pytest.raises(hn.errors.InvalidValueError, match=r"'grond': did you mean ground\?"):
        BuildingGraph(name="b", floors=(floor("ground"), floor("1"))).floor("grond")


def test_stairs_count_where_no_lift_leads_to_the_floor():
    """A flight of stairs leads sideways."""
    lift = Link(name="a", kind="lift", ends=(LinkEnd("0", (1, 1)), LinkEnd("1", (3, 4))))
    stairs = Link(name="b", kind="stairs", ends=(LinkEnd("0", (9, 1)), LinkEnd("1", (9, 9))))
    floors = (floor("0"), floor("1", (7, 7)))
    aligned = align_floors(BuildingGraph(name="b", floors=floors, links=(lift, stairs)))
    assert aligned.floor("1").graph.points.tolist() == [[5.0, 4.0]]
    assert aligned.links[1].ends[1].position_m == (7.0, 6.0)
    alone = align_floors(BuildingGraph(name="b", floors=floors, links=(stairs,)))
    assert alone.floor("1").graph.points.tolist() == [[7.0, -1.0]]


@tried(8, st.integers(0, 10**6))
def test_nodes_of_a_layout_are_joined_exactly_where_the_building_has_a_route(
    tmp_path_factory, seed
):
    """The file of a building, read again: components of nodes against plans over floors."""
    building = random_building(seed, most_floors=3).building
    try:
        graph = hn.ext.fleet.building_graph(building)
    except hn.errors.InvalidValueError:
        assume(False)
    file = tmp_path_factory.mktemp("lif") / "layout.json"
    hn.ext.fleet.export_lif(graph, file, vehicle_types=["Maker.Carrier"])
    whole = to_networkx(hn.ext.fleet.load_building_graph(file))
    piece_of = {
        node: number
        for number, piece in enumerate(nx.strongly_connected_components(whole))
        for node in piece
    }
    nodes = list(whole)
    rng = np.random.default_rng(seed)
    for start, goal in rng.integers(len(nodes), size=(20, 2)).tolist():
        ends = [
            (nodes[at][0], (whole.nodes[nodes[at]]["x"], whole.nodes[nodes[at]]["y"]))
            for at in (start, goal)
        ]
        plan = building.plan(*ends)
        assert plan.solved == (piece_of[nodes[start]] == piece_of[nodes[goal]])


# The bath has a door as wide as a cell; an archway of the kitchen leads into a nameless nook.
NOOK = (
    "####################",
    "#kkkkkkkkk#aaaaaaaa#",
    "#kkkkkkkkkaaaaaaaaa#",
    "#kkkkkkkkkaaaaaaaaa#",
    "#kkkkkkkkkaaaaaaaaa#",
    "#kkkkkkkkk#aaaaaaaa#",
    "####k####.####a#####",
    "#bbbbbbb#.#ddddddd##",
    "#bbbbbbb###ddddddd##",
    "####################",
)


def test_doors_that_no_edge_passes_are_not_in_the_graph_of_a_floor():
    rooms = topology_of(NOOK)
    wide = topology_of(NOOK, robot_radius_m=0.6)
    for topology, expected in ((rooms, 3), (wide, 1)):
        floor = hn.ext.fleet.floor_graph(topology, hn.graphs.build_lane_graph(topology), name="1")
        named = {
            facts["door_name"] for facts in floor.graph.edge_facts.values() if "door_name" in facts
        }
        assert {door.name for door in floor.doors if not door.is_opening} == named
        assert len(named) == expected
        assert all(None not in door.rooms for door in floor.doors)
