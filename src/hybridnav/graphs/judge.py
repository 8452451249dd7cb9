"""How much longer the routes on a graph are than shortest paths. Public: `Excess`, `GraphReport`
and `judge_route_graph`.
"""

from dataclasses import dataclass, replace

import numpy as np

from hybridnav._base.typing import FloatArray
from hybridnav.closures.one_way import directions_on
from hybridnav.errors import InvalidValueError, brief
from hybridnav.graphs.attach import MANY_CANDIDATES, Network
from hybridnav.graphs.free_space import FreeSpace
from hybridnav.graphs.waypoint_graph import RouteGraph
from hybridnav.maps.checks import checked_between, checked_type
from hybridnav.topology import TopologicalMap


@dataclass(frozen=True)
class Excess:
    """By how much routes are longer than shortest paths: length / optimum - 1.

    Examples
    --------
    >>> from hybridnav.graphs import Excess
    >>> Excess(mean=0.01, p95=0.03, greatest=0.08, solved=1.0).mean
    0.01
    """

    mean: float
    p95: float
    greatest: float
    solved: float
    """Share of the pairs that have a route."""


@dataclass(frozen=True)
class GraphReport:
    """Lengths of the routes on a graph between random pairs of free points with a path.

    The optimum is the shortest any-angle path, with directions the shortest legal one. Ends that
    see each other need no graph.

    Examples
    --------
    >>> from hybridnav.graphs import Excess, GraphReport
    >>> excess = Excess(mean=0.01, p95=0.03, greatest=0.08, solved=1.0)
    >>> GraphReport(pairs=1000, in_sight=0.4, best=excess, nearest=excess).best.p95
    0.03
    """

    pairs: int
    in_sight: float
    """Share of the pairs whose ends see each other."""
    best: Excess
    """With the best of the nodes in sight of each end, of the 1,500 nearest."""
    nearest: Excess
    """With the nearest node in sight of each end, and edges left out as Nav2 prunes them."""


def judge_route_graph(
    graph: RouteGraph,
    *,
    pairs: int = 1000,
    least_m: float = 0.0,
    seed: int = 1,
    topology: TopologicalMap | None = None,
) -> GraphReport:
    """Compare routes on a graph with shortest paths.

    Parameters
    ----------
    graph
        The graph.
    pairs
        Number of random pairs of free cells of one part of free space, of 1 m² or more, and
        inside the building.
    least_m
        Length of the shortest path in metres below which a pair does not count.
    seed
        Seed of the pairs; other than that of the graph, so that they are new to it.
    topology
        The map with rooms: shortest paths obey their one-way rules. None for none.

    Raises
    ------
    InvalidValueError
        When there is no pair.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph, judge_route_graph
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=12.0)
    >>> graph = build_lane_graph(hn.TopologicalMap(pyramid))
    >>> judge_route_graph(graph, pairs=10).best.solved
    1.0
    """
    checked_type("graph", graph, RouteGraph)
    checked_between("pairs", pairs, 1, 1e6)
    space = FreeSpace.of(graph.grid)
    starts, goals = space.random_pairs(pairs, np.random.default_rng(seed), space.kept())
    one_way = None if topology is None else directions_on(topology)
    optimum = space.lengths(starts, goals, one_way)
    counts = (optimum * graph.grid.resolution_m >= least_m) & np.isfinite(optimum)
    starts, goals, optimum = starts[counts], goals[counts], optimum[counts]
    if not len(starts):
        raise InvalidValueError(
            f"map {brief(graph.grid.name)} has no pair of free points {least_m:g} m apart: "
            "lower least_m or the robot's radius"
        )
    network = Network.of(space.sight, graph.positions, graph.edges)
    attached = replace(network, candidates=MANY_CANDIDATES).join(starts, goals)
    return GraphReport(
        pairs=len(starts),
        in_sight=float(attached.direct.mean()),
        best=excess_of(attached.best(), optimum),
        nearest=excess_of(attached.nearest(), optimum),
    )


def excess_of(lengths: FloatArray, optimum: FloatArray) -> Excess:
    """Return by how much routes are longer than the optimum.

    `lengths`: float64 (n,), the routes, infinite for none; `optimum`: float64 (n,), the shortest
    paths, above 0.
    """
    solved = np.isfinite(lengths)
    excess = np.maximum(lengths[solved] / optimum[solved] - 1.0, 0.0)
    if not len(excess):
        return Excess(np.inf, np.inf, np.inf, 0.0)
    return Excess(
        float(excess.mean()),
        float(np.percentile(excess, 95)),
        float(excess.max()),
        float(solved.mean()),
    )
