"""A robot's path by costs: it keeps its distance, with arcs, poses and a bound."""

import hybridnav as hn
from hybridnav.maps.costs import cost_along
from hybridnav.viz import plot_costs, save_figure

grid = hn.example_map("office", robot_radius_m=0.25)
topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
layer = hn.CostLayer.clearance(grid)  # what Nav2's inflation layer costs; `robot` has it by default
start, goal = (1.0, 13.2), (40.6, 19.4)

shortest = hn.HybridPlanner(topology).plan(start, goal)
robot = hn.HybridPlanner(topology, preset="robot").plan(start, goal)
dear = cost_along(grid, layer, shortest.path.points)
print(f"shortest  {shortest.path.length_m:.2f} m, costs {dear:.2f}")
print(f"robot     {robot.path.length_m:.2f} m, costs {robot.cost:.2f}, gap {robot.gap:.1%}")
poses = robot.path.poses()  # x, y, yaw, at most 5 cm apart
print(f"{len(poses)} poses, {robot.duration_s:.0f} s at the limits of the preset")

paths = {"shortest": shortest.path.points, "robot": robot.path.points}
save_figure(plot_costs(grid, layer, paths=paths), "out/robot_costs.png")
