"""A route between rooms, in words: find rooms, name two, and ask."""

import hybridnav as hn
from hybridnav.viz import plot_tour, save_figure

grid = hn.example_map("office", robot_radius_m=0.25)
rooms = hn.find_rooms(grid)
topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
print(len(topology.rooms.names), "rooms,", len(topology.rooms.listed_doors), "doors")

here, there = (topology.rooms.at((x, y)) for x, y in ((1.0, 13.2), (40.6, 19.4)))
tour = hn.plan_tour(hn.HybridPlanner(topology), [here, there])
print(f"from {here} to {there}: {tour.length_m:.1f} m, none shorter")
print(*tour.words(), sep="\n")
save_figure(plot_tour(topology, tour), "out/rooms_route.png")
