"""Graphs that people have drawn for real buildings, on their maps."""

from __future__ import annotations

import pytest

import hybridnav as hn
from hybridnav.ext.graphs.method import GraphMethod
from hybridnav.harness.judges import judge_line, segment_faults
from hybridnav.harness.pairs import sample_pairs

FITS = {
    "nav2/graphs/nav2_bringup/depot_graph.geojson": "nav2/maps/depot.yaml",
    "nav2/graphs/nav2_bringup/turtlebot3_graph.geojson": "nav2/maps/tb3_sandbox.yaml",
    "nav2/graphs/nav2_route/aws_graph.geojson": "aws_small_warehouse/005/map.yaml",
    "strands/g4s/g4s_sim.tplg": "strands/g4s/g4s_sim_cropped.yaml",
    "strands/g4s/g4s_y2.tmap": "strands/g4s/g4s_y2.yaml",
    "strands/tsc_y3/tsc_y3_final.tplg": "strands/tsc_y3/tsc20160523.yaml",
    "strands/tsc_y4/tsc_y4_final.tplg.tpl": "strands/tsc_y4/tsc_1701.yaml",
}


@pytest.mark.filterwarnings("ignore::hybridnav.MapWarning")
@pytest.mark.parametrize("name", FITS)
def test_what_is_clear_and_what_routes_are_is_judged_by_exact_geometry(data, name):
    graph = hn.load_graph(data / name)
    grid = hn.load_map(data / FITS[name], robot_radius_m=0.2)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))
    found = hn.check_graph(topology, graph)
    points = graph.points.tolist()
    for edge, (tail, head) in enumerate(graph.edges.tolist()):
        wrong = segment_faults(grid, [points[tail], points[head]])
        assert found.is_clear[edge] == (not wrong), graph.edge_text(edge)
    assert found.is_clear.sum() > graph.n_edges / 2  # the graph and the map fit
    method = GraphMethod(grid, graph, clear_edges_only=True)
    solved = 0
    for pair in sample_pairs(grid, 40, seed=0):
        answer = method.solve(pair.start, pair.goal)
        if answer.any_angle is not None:
            line = answer.any_angle
            verdict = judge_line(grid, line.points, start=pair.start, goal=pair.goal)
            assert verdict.faults == ()
            assert line.length_m == pytest.approx(verdict.length_m)
            solved += 1
    assert solved
