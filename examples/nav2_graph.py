"""A route graph for Nav2: lanes as a person draws them, and what routes on them lose."""

import hybridnav as hn
from hybridnav.graphs import build_lane_graph, export_nav2, judge_route_graph, plot_route_graph
from hybridnav.viz import save_figure

grid = hn.example_map("office", robot_radius_m=0.25)
topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid)))
graph = build_lane_graph(topology)
export_nav2(graph, "out/office.geojson")

report = judge_route_graph(graph, pairs=200)
print(f"{len(graph.points)} nodes; routes are {report.nearest.mean:.0%} longer than shortest paths")
save_figure(plot_route_graph(graph), "out/nav2_graph.png")
