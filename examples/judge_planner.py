"""How far from the optimum is a planner of your own? Here: A* that trusts its guess too much."""

import networkx as nx
import numpy as np

import hybridnav as hn
from hybridnav.viz import plot_losses, save_figure

grid = hn.example_map("figure1", robot_radius_m=0)
is_free = grid.classes == hn.CellClass.FREE
free = np.argwhere(is_free)
graph = nx.grid_2d_graph(*grid.shape).subgraph(map(tuple, free.tolist())).copy()
nx.set_edge_attributes(graph, 1.0, "weight")
for row, col in np.argwhere(is_free[:-1, :-1] & is_free[1:, 1:]).tolist():  # diagonal moves ...
    if is_free[row, col + 1] and is_free[row + 1, col]:  # ... that cut no corner
        graph.add_edge((row, col), (row + 1, col + 1), weight=2**0.5)
        graph.add_edge((row, col + 1), (row + 1, col), weight=2**0.5)


def greedy(start, goal, trust):
    """Return the length in metres of the path of A* with `trust` times the distance as a guess."""

    def guess(one, other):
        return trust * np.hypot(one[0] - other[0], one[1] - other[1])

    return nx.astar_path_length(graph, start, goal, guess) * grid.resolution_m


planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
random, losses = np.random.default_rng(0), {"trusts": [], "trusts threefold": []}
for start, goal in random.choice(free, (200, 2)):
    points = grid.frame.points_of(np.array([start, goal]))
    best = planner.plan(*points)  # proved: no path is shorter
    if best.solved and best.cost > 1:
        for name, trust in (("trusts", 1.0), ("trusts threefold", 3.0)):
            losses[name].append(greedy(tuple(start), tuple(goal), trust) / best.lower_bound - 1)
for name, loss in losses.items():
    print(f"{name}: {np.mean(loss):.1%} above the optimum in the mean, {max(loss):.1%} at worst")
save_figure(plot_losses(losses), "out/judge_planner.png")
