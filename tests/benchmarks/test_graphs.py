"""The graphs of waypoints of the study: free edges, what is covered, faults that are planted."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import networkx as nx
import numpy as np
import pytest
from scipy import ndimage

import hybridnav as hn
from benchmarks.subjects import _study_graphs
from benchmarks.subjects._study_graphs import MOST_SKELETON, RouteGraphMethod, SwaggerLike
from benchmarks.subjects._study_run import GRAPHS
from benchmarks.subjects._swagger_like import (
    BOUNDARY_M,
    SKELETON_M,
    SPACE_M,
    Distances,
    branches,
    skeleton_of,
    swagger_like,
)
from hybridnav.graphs.method import GraphMethod
from hybridnav.harness.analysis import load_study
from hybridnav.harness.columns import consistency_row
from hybridnav.harness.judges import segment_faults
from hybridnav.harness.output import rows_of_methods
from hybridnav.harness.records import read_records
from hybridnav.harness.run import RunSettings, write_records
from tests.benchmarks.test_rival_faults import LIES, nothing, short
from tests.harness.small_runs import ROOMS, ROOT, run_here, write_map
from tests.strategies import class_grids, occupancy_grid, tried

N_PAIRS = 12
BY_NAME: dict[str, Any] = {"route graph": RouteGraphMethod, "swagger-like": SwaggerLike}


@pytest.fixture(autouse=True)
def _here(monkeypatch):
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
    monkeypatch.setattr("hybridnav.harness.judging._WARM", set())


def run(folder, lines=ROOMS, **options):
    # Rooms of the study's games are ten times as large.
    grown = ["".join(5 * letter for letter in line) for line in lines for _ in range(5)]
    settings_ = RunSettings(
        maps=(str(write_map(folder, grown)),), presets=(), methods=GRAPHS, pairs=N_PAIRS, **options
    )
    write_records(settings_, folder / "run")
    return load_study(folder / "run")


def office():
    return hn.load_map("maps/office/office.yaml", robot_radius_m=0.25)


# --- the graph in the manner of SWAGGER -----------------------------------------------------------


@tried(60, class_grids(20))
def test_every_edge_is_free_and_every_node_has_one(classes):
    grid = occupancy_grid(classes)
    free = grid.enterable(allow_unexplored=False)
    nodes, edges = swagger_like(free, skeleton_of(free), Distances(0.25, 0.0))
    assert free[tuple(nodes.T)].all()
    assert set(edges.ravel().tolist()) == set(range(len(nodes)))
    points = grid.frame.points_of(nodes)
    for edge in edges.tolist():
        assert not segment_faults(grid, points[edge])


@tried(60, class_grids(16))
def test_branches_have_every_step_of_the_skeleton_once(classes):
    skeleton = skeleton_of(classes == hn.CellClass.FREE)
    cells = [tuple(cell) for cell in np.argwhere(skeleton).tolist()]
    steps = {
        frozenset((one, other))
        for one in cells
        for other in cells
        if one != other and max(abs(one[0] - other[0]), abs(one[1] - other[1])) == 1
    }
    found = branches(skeleton)
    taken = [frozenset(pair) for run_ in found for pair in pairwise(run_)]
    assert len(taken) == len(set(taken))
    assert set(taken) == steps
    assert {cell for run_ in found for cell in run_} == set(cells)


def test_nodes_are_as_near_as_the_distances_say():
    grid = office()
    free = grid.enterable(allow_unexplored=False)
    skeleton = skeleton_of(free)
    sizes = Distances(grid.resolution_m, grid.robot_radius_m)
    nodes, edges = swagger_like(free, skeleton, sizes)
    no_node = np.ones_like(free)
    no_node[tuple(nodes.T)] = False
    away_m = ndimage.distance_transform_edt(no_node) * grid.resolution_m
    # A merged node is up to 0.25 m away from where it was.
    assert away_m[skeleton].max() <= SKELETON_M / 2 + 0.3
    wall_m = ndimage.distance_transform_edt(free) * grid.resolution_m
    assert np.minimum(away_m, wall_m)[free].max() <= SPACE_M + 0.3
    # Contours: nodes at half the robot's radius from the cells that are closed to it.
    on_contour = np.abs(wall_m[tuple(nodes.T)] - 0.5 * grid.robot_radius_m) < 2 * grid.resolution_m
    assert on_contour.sum() > 20 / BOUNDARY_M
    graph: nx.Graph[int] = nx.Graph(edges.tolist())
    label, _ = ndimage.label(free, np.ones((3, 3)))
    large = int(np.bincount(label[free]).argmax())
    inside = {at for at, cell in enumerate(nodes.tolist()) if label[tuple(cell)] == large}
    assert max(len(part & inside) for part in nx.connected_components(graph)) == len(inside)


# --- both as methods of the harness ---------------------------------------------------------------


def test_routes_are_those_of_the_exported_file(tmp_path):
    path = write_map(tmp_path, ["".join(5 * x for x in line) for line in ROOMS for _ in range(5)])
    grid = hn.load_map(path, robot_radius_m=0)
    made = RouteGraphMethod(grid)
    scaled = replace(grid, frame=replace(grid.frame, resolution_m=0.1))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(scaled, merge_distance_m=4.0))
    built = hn.graphs.build_lane_graph(topology)
    assert made.n_nodes == built.n_nodes
    hn.graphs.export_nav2(built, tmp_path / "graph.geojson")
    graph = hn.ext.fleet.load_graph(tmp_path / "graph.geojson")
    by_file = GraphMethod(scaled, graph)
    rng = np.random.default_rng(1)
    free = np.argwhere(grid.classes == hn.CellClass.FREE)
    for _ in range(10):
        start, goal = (tuple(free[at].tolist()) for at in rng.integers(0, len(free), 2))
        one, other = made.solve(start, goal).any_angle, by_file.solve(start, goal).any_angle
        assert (one is None) == (other is None)
        if one is not None and other is not None:
            assert one.length_m == pytest.approx(10 * other.length_m)


def test_as_they_are_they_have_no_fault(tmp_path):
    study = run(tmp_path)
    assert study.faults == []
    for name in BY_NAME:
        outcome = study.of_method(name)[0]
        assert outcome.is_any_angle
        assert np.isfinite(outcome.lengths_m).sum() == N_PAIRS
        assert 0 <= outcome.any_angle_losses.max() < 2
        assert outcome.preparation["n_edges"] >= outcome.preparation["n_nodes"] - 1 > 2
        row = next(row for row in rows_of_methods(study) if row["method"] == name)
        assert row["settings"]
        assert str(row["version"]).startswith("file ")


@pytest.mark.parametrize("lie", LIES)
@pytest.mark.parametrize("name", BY_NAME)
def test_a_planted_fault_of_a_route_is_found(name, lie, tmp_path, monkeypatch):
    made_of = BY_NAME[name]
    honest = made_of.solve
    monkeypatch.setattr(made_of, "solve", lambda method, *pair: lie(honest(method, *pair)))
    study = run(tmp_path)
    outcome = study.of_method(name)[0]
    row = consistency_row([outcome])
    assert int(row[f"{LIES[lie]} wrong"]) > 0
    assert len(outcome.faults) > 3
    if lie in (short, nothing):
        assert not np.isfinite(outcome.lengths_m).any()
    others = [one for one in study.outcomes if one.label != name]
    assert not any(one.faults for one in others)


def spoiled(spoil, monkeypatch):
    honest = _study_graphs._graph_of
    monkeypatch.setattr(_study_graphs, "_graph_of", lambda *given_: spoil(honest(*given_)))


@pytest.mark.parametrize("name", BY_NAME)
def test_an_edge_through_walls_is_found(name, tmp_path, monkeypatch):
    def joined_to_all(graph):
        n_nodes = graph.n_nodes
        extra = np.array([(tail, head) for tail in range(n_nodes) for head in range(n_nodes)])
        return replace(
            graph, edges=extra, edge_names=(None,) * len(extra), costs=np.full(len(extra), np.nan)
        )

    spoiled(joined_to_all, monkeypatch)
    outcome = run(tmp_path).of_method(name)[0]
    assert int(consistency_row([outcome])["paths wrong"]) > 0


def test_a_graph_that_is_cut_gives_up_or_claims_what_is_wrong(tmp_path, monkeypatch):
    def cut(graph):
        return replace(graph, edges=graph.edges[:0], edge_names=(), costs=np.empty(0))

    spoiled(cut, monkeypatch)
    study = run(tmp_path)
    ours, like = (consistency_row(study.of_method(name)) for name in BY_NAME)
    # Ours is connected where free space is, so its answer "no path" is a claim.
    assert int(ours["no path wrong"]) > 3
    assert int(like["no path wrong"]) == 0
    assert int(str(like["without an answer"])) > 3
    reasons = {one["status"] for one in read_records(tmp_path / "run") if one["type"] == "pair"}
    assert "no edges from one node to the other" in reasons


def test_a_map_that_is_all_skeleton_is_not_asked(tmp_path, monkeypatch):
    monkeypatch.setattr(_study_graphs, "MOST_SKELETON", 40)
    study = run(tmp_path)
    assert (study.faults, study.failures) == ([], 0)
    for name in BY_NAME:
        (outcome,) = study.of_method(name)
        assert not outcome.is_asked
        row = next(row for row in rows_of_methods(study) if row["method"] == name)
        assert "up to 40 cells, this map has" in str(row["not asked"])


def test_cells_of_a_metre_are_taken_for_those_of_a_building():
    lines = np.zeros((60, 90), np.float32)
    lines[30, 10:80] = 1
    small = hn.OccupancyGrid(lines, hn.Frame(0.1), robot_radius_m=0)
    large = hn.OccupancyGrid(lines, hn.Frame(1.0), robot_radius_m=0)
    for made_of in BY_NAME.values():
        one, other = made_of(small), made_of(large)
        assert (one.n_nodes, one.n_edges) == (other.n_nodes, other.n_edges)
        lengths = [method.solve((5, 45), (50, 40)).any_angle.length_m for method in (one, other)]
        assert lengths[1] == pytest.approx(10 * lengths[0])


def test_the_page_on_the_harness_states_their_limits():
    page = (
        (ROOT / "docs" / "reference" / "harness-methods.md")
        .read_text(encoding="utf-8")
        .replace("\n", " ")
    )
    assert f"has more than {MOST_SKELETON:,} cells" in page
