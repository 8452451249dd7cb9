"""A table of exact distances: which robot takes which task, and in what order one visits all."""

import networkx as nx
import numpy as np
from scipy.optimize import linear_sum_assignment

import hybridnav as hn
from hybridnav.viz import plot_map, save_figure

grid = hn.example_map("office", robot_radius_m=0.25)
planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
random = np.random.default_rng(4)
free = np.argwhere(grid.classes == hn.CellClass.FREE)
robots, tasks = grid.frame.points_of(random.choice(free, (2, 8)).reshape(-1, 2)).reshape(2, 8, 2)

costs = np.nan_to_num(planner.distances(robots, tasks), posinf=1e6)
pairs = list(zip(*linear_sum_assignment(costs), strict=True))
print(f"{len(pairs)} tasks in {sum(costs[pair] for pair in pairs):.1f} m")

between = nx.from_numpy_array(np.nan_to_num(planner.distances(tasks, tasks), posinf=1e6))
order = nx.approximation.traveling_salesman_problem(between, cycle=False)
print("one robot visits them in the order", *order)

ax = plot_map(grid, title="from each robot to its task")
ax.plot(*robots.T, "ko", ms=6)
for robot, task in pairs:
    path = planner.plan(robots[robot], tasks[task]).path
    if path is not None:
        ax.plot(*path.points.T, lw=2)
save_figure(ax, "out/distances.png")
