"""Directions of graphs and of maps: edges against one-way boundaries, and rules that edges state.
Public: `one_way_rules`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.rows import unique_rows
from hybridnav._base.trig import hypots
from hybridnav.closures.one_way import directions_on
from hybridnav.graphs.waypoint_graph import WaypointGraph
from hybridnav.maps import CellClass, OccupancyGrid, OneWayRule
from hybridnav.maps.checks import checked_type
from hybridnav.maps.geometry import cells_of_line

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._base.typing import BoolArray, FloatArray
    from hybridnav.topology import TopologicalMap

_STEP = 0.5
"""Steps in cells by which a line across an edge is led to the walls."""
_SHARES = np.linspace(-1.0, 2.0, 25)
_TURNS = np.array([0.0, 0.25, -0.25, 0.5, -0.5])
"""Places on an edge and beyond it, and slants at which a line across it is tried: aside, and so
much along it."""
_NARROWER = 0.8
"""Share of the widths before and behind a place below which it is a door."""


def against(topology: TopologicalMap, lines: Iterable[FloatArray], free: BoolArray) -> BoolArray:
    """Return which lines, float64 (n, 2) in grid units on free cells, cross a one-way door or line
    of the rooms of a map against its direction."""
    directed, each = directions_on(topology), list(lines)
    if directed is None:
        return np.zeros(len(each), dtype=np.bool_)
    found = [directed.meets(cells_of_line(free, line)) for line in each]
    return np.array(found, dtype=np.bool_)


def one_way_rules(graph: WaypointGraph, grid: OccupancyGrid) -> tuple[OneWayRule, ...]:
    """Return what the edges that lead one way state of a map, as lines for a planner.

    A line runs across each such edge from wall to wall, where they are nearest, as in a door; in
    its middle if they are as near there. It ends halfway to an edge that leads the other way.

    Parameters
    ----------
    graph
        The graph; an edge leads one way if none joins its nodes the other way round.
    grid
        The map. Edges whose middle lies in no free cell, as measured, state nothing.

    Returns
    -------
    tuple of OneWayRule
        For `RoomLabels(one_way=)`, `OneWay.of` and files.

    Examples
    --------
    >>> from hybridnav.graphs import WaypointGraph, one_way_rules
    >>> import networkx as nx
    >>> plain = nx.DiGraph()
    >>> plain.add_node("in", x=1.0, y=1.5)
    >>> plain.add_node("out", x=9.0, y=1.5)
    >>> plain.add_edge("in", "out")
    >>> grid = hn.OccupancyGrid(np.zeros((3, 10)), robot_radius_m=0)
    >>> [str(rule) for rule in one_way_rules(WaypointGraph.from_networkx(plain), grid)]
    ['line:5,-0.5:5,3']
    """
    checked_type("graph", graph, WaypointGraph)
    checked_type("grid", grid, OccupancyGrid)
    edges = unique_rows(graph.edges).rows.astype(np.int64)
    edges = edges[edges[:, 0] != edges[:, 1]]
    keys = edges @ np.array([graph.n_nodes, 1])
    is_single = ~np.isin(edges[:, ::-1] @ np.array([graph.n_nodes, 1]), keys)
    positions = grid.frame.positions_of(graph.points)
    free = grid.measured == CellClass.FREE
    tails, steps = positions[edges[:, 0]], positions[edges[:, 1]] - positions[edges[:, 0]]
    lengths = hypots(steps[:, 0], steps[:, 1])
    rules = []
    for edge in np.flatnonzero(is_single & (lengths > 0)).tolist():
        along = steps[edge] / lengths[edge]
        at, aside, walls = _narrowest(free, tails[edge], steps[edge], along)
        others = np.flatnonzero(steps @ along < 0)
        met = _met(at, aside, tails[others], steps[others])
        reach = [
            min(wall, (sign * met[sign * met > 0]).min(initial=np.inf) / 2)
            for sign, wall in zip((-1, 1), walls, strict=True)
        ]
        if min(reach) > 0:
            ends = np.stack([at - reach[0] * aside, at + reach[1] * aside])
            points = np.round(grid.frame.points_of_grid(ends), 4).tolist()
            rules.append(OneWayRule(line=tuple((x, y) for x, y in points)))
    return tuple(rules)


def _narrowest(
    free: BoolArray, tail: FloatArray, step: FloatArray, along: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return where the line across an edge lies, its direction, and the cells from there to the
    walls: against the direction, and in it."""
    straight = np.array([along[1], -along[0]])  # rows run upwards: the left of the edge
    slanted = straight + _TURNS[:, None] * along
    asides = np.tile(slanted / hypots(*slanted.T)[:, None], (len(_SHARES), 1))
    starts = tail + np.repeat(_SHARES, len(_TURNS))[:, None] * step
    middle, most = len(_SHARES) // 2 * len(_TURNS), float(sum(free.shape))
    for at in ([middle], slice(None)):  # elsewhere no farther than at the middle
        walls = np.stack([_to_wall(free, starts[at], s * asides[at], most) for s in (-1, 1)])
        most = min(most, float(walls[:, 0].sum()))
    widths = np.where(walls.min(axis=0) > 0, walls.sum(axis=0), np.inf).reshape(-1, len(_TURNS))
    least = np.where(np.isinf(widths).all(axis=1), 0.0, widths.min(axis=1))
    on_it = np.flatnonzero(np.abs(_SHARES - 0.5) <= 0.5).tolist()  # noqa: PLR2004 - ends at halves
    doors = [k for k in on_it if _is_door(least, k)] if most > 0 else []
    best = min(doors, key=least.__getitem__) * len(_TURNS) if doors else middle
    best += int(widths[best // len(_TURNS)].argmin()) if doors else 0
    return starts[best], asides[best], walls[:, best]


def _is_door(widths: FloatArray, at: int) -> bool:
    """Return whether one comes to wider places from a place along a line, both ways."""
    for side in (widths[:at][::-1], widths[at + 1 :]):
        open_to = side[: (side == 0).argmax()] if (side == 0).any() else side
        if not (widths[at] < _NARROWER * open_to).any():
            return False
    return True


def _to_wall(free: BoolArray, starts: FloatArray, asides: FloatArray, most: float) -> FloatArray:
    """Return the cells from positions, float64 (n, 2), to the first one that is not free, and its
    depth; `most` of them are looked at."""
    at = starts[:, None] + _STEP * np.arange(int(most / _STEP) + 2)[:, None] * asides[:, None]
    cells = np.floor(at).astype(np.int64)
    inside = np.asarray(((cells >= 0) & (cells < free.shape)).all(axis=2), dtype=np.bool_)
    inside[inside] = free[tuple(cells[inside].T)]
    inside[:, -1] = False
    return _STEP * inside.argmin(axis=1)


def _met(start: FloatArray, aside: FloatArray, tails: FloatArray, steps: FloatArray) -> FloatArray:
    """Return where a line through a position meets edges, in cells along it."""
    cross = aside[0] * steps[:, 1] - aside[1] * steps[:, 0]
    to = tails - start
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (to[:, 0] * aside[1] - to[:, 1] * aside[0]) / cross
        at = (to[:, 0] * steps[:, 1] - to[:, 1] * steps[:, 0]) / cross
    return at[(cross != 0) & (share >= 0) & (share <= 1)]
