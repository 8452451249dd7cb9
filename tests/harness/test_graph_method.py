"""Graphs of others as methods: the stated policy, by brute force, and runs of the harness."""

import math
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.graphs.method import GraphMethod
from hybridnav.harness import RunSettings, load_study, write_records
from hybridnav.harness.judges import segment_faults
from hybridnav.harness.records import read_records
from tests.drawn_rooms import HOUSE, topology_of
from tests.harness.small_runs import ROOMS, write_map
from tests.strategies import class_grids, occupancy_grid, tried


def sees(grid, one, other):
    return not segment_faults(grid, [one, other])


def by_brute_force(grid, graph, start, goal):
    """The route of the policy as points, or why there is none; from its words alone."""
    plain: nx.DiGraph[int] = nx.DiGraph()
    points = [tuple(point) for point in graph.points.tolist()]
    plain.add_nodes_from(range(len(points)))
    for tail, head in graph.edges.tolist():
        plain.add_edge(tail, head, m=math.dist(points[tail], points[head]))
    if sees(grid, start, goal):
        return [start, goal]
    nearest: list[int] = []
    for end in (start, goal):
        near = [n for n, at in enumerate(points) if sees(grid, end, at)]
        if not near:
            return "no node in sight of the " + ("goal" if nearest else "start")
        nearest.append(min(near, key=lambda node: (math.dist(end, points[node]), node)))
    if not nx.has_path(plain, nearest[0], nearest[1]):
        return ""
    nodes = [points[node] for node in nx.shortest_path(plain, nearest[0], nearest[1], weight="m")]
    nodes = without_passed(grid, start, nodes)
    nodes = without_passed(grid, goal, nodes[::-1])[::-1]
    return [start, *nodes, goal]


def without_passed(grid, end, nodes):
    if len(nodes) < 2:
        return nodes
    along = np.subtract(nodes[1], nodes[0]) @ np.subtract(end, nodes[0])
    return nodes[1:] if along > 0 and sees(grid, end, nodes[1]) else nodes


@tried(100, class_grids(14), st.data())
def test_routes_are_those_of_the_policy(classes, data):
    free = np.argwhere(classes == hn.CellClass.FREE)
    if not len(free):
        return
    grid = occupancy_grid(classes)
    rows, cols = classes.shape
    # Irregular points: no two nodes are equally near.
    seed = data.draw(st.integers(0, 2**32))
    rng = np.random.default_rng(seed)
    count = data.draw(st.integers(1, 8))
    plain: nx.DiGraph[int] = nx.DiGraph()
    for node, (x, y) in enumerate(rng.uniform(0, [cols, rows], (count, 2)).tolist()):
        plain.add_node(node, x=x, y=y)
    pairs = st.tuples(st.integers(0, count - 1), st.integers(0, count - 1))
    plain.add_edges_from(data.draw(st.lists(pairs, max_size=20)))
    graph = hn.graphs.WaypointGraph.from_networkx(plain)
    method = GraphMethod(grid, graph)
    for _ in range(4):
        start, goal = (tuple(free[rng.integers(len(free))].tolist()) for _ in range(2))
        ends = [tuple(grid.frame.points_of(np.array(cell)).tolist()) for cell in (start, goal)]
        wanted = by_brute_force(grid, graph, *ends)
        answer = method.solve(start, goal)
        if isinstance(wanted, str):
            assert (answer.any_angle, answer.gave_up) == (None, wanted)
            continue
        assert np.allclose(answer.any_angle.points, wanted, atol=1e-6)
        length_m = sum(map(math.dist, wanted, wanted[1:]))
        assert answer.any_angle.length_m == pytest.approx(length_m)


def house_graph():
    return hn.graphs.WaypointGraph.from_networkx(
        _points(hn.graphs.build_lane_graph(topology_of(HOUSE))), name="house"
    )


def _points(built):
    plain: nx.DiGraph[Any] = nx.DiGraph()
    for node, (x, y) in enumerate(built.points.tolist()):
        plain.add_node(node, x=x, y=y)
    plain.add_edges_from(built.edges.tolist())
    return plain


def letters(lines):
    """Lines of a drawing, as a MovingAI map shows them: cells of one metre."""
    return ["".join("#" if letter == "#" else "." for letter in line) for line in lines]


@pytest.mark.usefixtures("here")
def test_a_sound_graph_has_no_counter_examples(tmp_path):
    path = write_map(tmp_path, letters(HOUSE), "house")
    grid = hn.load_map(path, robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=10.0))
    built = hn.graphs.build_lane_graph(topology)
    graph = hn.graphs.WaypointGraph.from_networkx(_points(built), name="house")
    settings_ = RunSettings(maps=(str(path),), presets=(), graphs=(graph,), pairs=60)
    write_records(settings_, tmp_path / "run")
    records = [one for one in read_records(tmp_path / "run") if one["method"] == "graph house"]
    assert records[0]["graph"]["sha256"] == graph.digest
    pairs = [one for one in records if one["type"] == "pair"]
    assert {one["status"] for one in pairs} == {"solved"}
    assert [one["faults"] for one in pairs] == [[]] * 60
    study = load_study(tmp_path / "run")
    (outcome,) = [one for one in study.outcomes if one.label == "graph house"]
    assert study.faults == []
    report = hn.graphs.judge_route_graph(built, pairs=2000)
    assert outcome.any_angle_losses.min() >= -1e-9
    assert outcome.any_angle_losses.mean() == pytest.approx(report.nearest.mean, abs=0.06)


@pytest.mark.usefixtures("here")
def test_edges_through_walls_are_counter_examples_unless_they_are_left_out(tmp_path):
    path = write_map(tmp_path, ROOMS)
    graph: nx.Graph[int] = nx.Graph()
    points = [(4, 6.5), (14, 6.5), (6.5, 4.4), (6.5, 2.5), (14, 2.5), (14.5, 7)]
    for node, (x, y) in enumerate(points):
        graph.add_node(node, x=x, y=y)
    graph.add_edges_from([(0, 1), (0, 2), (2, 3), (3, 4), (1, 5), (4, 5)])
    mine = hn.graphs.WaypointGraph.from_networkx(graph, name="drawn")
    for only, name in ((False, "graph drawn"), (True, "graph drawn (clear edges)")):
        run = tmp_path / f"run{only}"
        settings_ = RunSettings(
            maps=(str(path),), presets=(), graphs=(mine,), clear_edges_only=only, pairs=80
        )
        write_records(settings_, run)
        pairs = [one for one in read_records(run) if (one["type"], one["method"]) == ("pair", name)]
        assert len(pairs) >= 80
        walls = [
            one for one in pairs if any("enters a blocked cell" in text for text in one["faults"])
        ]
        assert bool(walls) != only
        if only:
            # No path on a graph is no proof of none.
            faults = [text for one in pairs for text in one["faults"]]
            assert all("solvability" in text for text in faults)
    assert {one["status"] for one in pairs} >= {"solved", "no path"}
    study = load_study(run)
    assert any("solvability" in str(fault) for _, _, fault in study.faults)


@pytest.mark.usefixtures("here")
def test_settings_that_do_not_go_together(tmp_path):
    path = str(write_map(tmp_path, ROOMS))
    mine = house_graph()
    with pytest.raises(hn.errors.InvalidValueError, match="one map"):
        write_records(RunSettings(maps=(path, path), graphs=(mine,)), tmp_path / "run")
    with pytest.raises(hn.errors.InvalidValueError, match="graph house: an any-angle path never"):
        write_records(
            RunSettings(maps=(path,), presets=(), graphs=(mine,), corner_cutting=True),
            tmp_path / "run",
        )
    route_graph = hn.graphs.build_lane_graph(topology_of(HOUSE))
    wrong: Any = (route_graph,)
    with pytest.raises(hn.errors.InvalidValueError, match="expected a WaypointGraph"):
        write_records(RunSettings(maps=(path,), presets=(), graphs=wrong), tmp_path / "run")
    with pytest.raises(hn.errors.MapNotFoundError, match=r"none\.geojson: no such file"):
        write_records(RunSettings(maps=(path,), graphs=("none.geojson",)), tmp_path / "run")
    grid = hn.OccupancyGrid(np.zeros((4, 4), np.float32), robot_radius_m=0, corner_cutting=True)
    with pytest.raises(hn.errors.InvalidValueError, match="corner cutting"):
        GraphMethod(grid, mine)


def test_a_graph_goes_to_a_process_of_its_own_and_its_records_are_kept(tmp_path):
    path = str(write_map(tmp_path, ROOMS))
    plain: nx.Graph[int] = nx.Graph()
    plain.add_node(0, x=4, y=7)
    plain.add_node(1, x=9.5, y=7.5)
    plain.add_node(2, x=14, y=7)
    nx.add_path(plain, [0, 1, 2])
    mine = hn.graphs.WaypointGraph.from_networkx(plain, name="mine")
    settings_ = RunSettings(maps=(path,), presets=(), graphs=(mine,), pairs=5)
    records = write_records(settings_, tmp_path / "run")
    assert records >= 12
    assert write_records(settings_, tmp_path / "run") == 0
    plain.add_edge(0, 2)
    more = hn.graphs.WaypointGraph.from_networkx(plain, name="mine")
    again = RunSettings(maps=(path,), presets=(), graphs=(more,), pairs=5)
    assert write_records(again, tmp_path / "run") == records // 2
