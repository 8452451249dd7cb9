"""Routes: the topological answer to a query."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Route:
    """The topological answer: the places passed and the arcs between them.

    Examples
    --------
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(pyramid))
    >>> planner.plan((0.5, 0.5), (2.0, 2.5)).route
    Route(places=(2, 0, 5, 9), arcs=(0, 3, 11))
    """

    places: tuple[int, ...]
    """Ids of the places, from that of the start to that of the goal."""
    arcs: tuple[int, ...]
    """Ids of the arcs, one fewer than places; -1 for a step between two occupied cells, if corners
    may be cut."""
