"""Paths of different homotopy classes between two points."""

from __future__ import annotations

import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

from hybridnav.errors import InvalidValueError
from hybridnav.homotopy.search import MOST_STATES, alternative_search
from hybridnav.planner.named import At, check_names, points_of_waypoints
from hybridnav.result import Path
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.moves import path_length_in_cells

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._typing import LongArray
    from hybridnav.homotopy.classes import Word
    from hybridnav.planner.blocked import Closable
    from hybridnav.planner.planner import HybridPlanner
    from hybridnav.topology import TopologicalMap

MOST = 20
"""Most alternatives of one query."""


@dataclass(frozen=True, eq=False)
class Alternative:
    """A path and its class.

    Examples
    --------
    >>> probability = np.zeros((5, 5))
    >>> probability[1:4, 1:4] = 1.0
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(probability, robot_radius_m=0))
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(pyramid))
    >>> found = hn.plan_alternatives(planner, (0.5, 0.5), (4.5, 4.5), 3)
    >>> found[0].word == found[1].word
    False
    """

    path: Path
    word: Word
    """Reduced word of its homotopy class; equal for paths that differ only by cells."""


@dataclass(frozen=True, eq=False)
class Alternatives(Sequence[Alternative]):
    """Paths of different classes, the shortest first, and whether they are complete.

    Examples
    --------
    >>> probability = np.zeros((5, 5))
    >>> probability[1:4, 1:4] = 1.0
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(probability, robot_radius_m=0))
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(pyramid))
    >>> found = hn.plan_alternatives(planner, (0.5, 0.5), (4.5, 4.5), 3)
    >>> len(found), found.complete
    (2, True)
    """

    found: tuple[Alternative, ...]
    """The paths; none if no path exists."""
    complete: bool
    """Whether these are as many as requested, or all that exist; False if the search gave up, so
    that there may be more."""

    @overload
    def __getitem__(self, index: int) -> Alternative: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Alternative, ...]: ...

    def __getitem__(self, index: int | slice) -> Alternative | tuple[Alternative, ...]:
        """Return one alternative, or some."""
        return self.found[index]

    def __len__(self) -> int:
        """Return the number of paths found."""
        return len(self.found)


def plan_alternatives(  # noqa: PLR0913 - the last four have defaults
    planner: HybridPlanner,
    start: ArrayLike | str,
    goal: ArrayLike | str,
    count: int,
    *,
    least_hole_m2: float = 1.0,
    at: At = "point",
    blocked: Closable | None = None,
    most_states: int = MOST_STATES,
) -> Alternatives:
    """Plan paths of different homotopy classes: by another door, on the other side of an obstacle.

    The paths are octile for every preset, because only the lengths of cell paths are known for
    classes. The first is a shortest one, the planner's own if that is octile and shortest. The
    others follow by length, each a shortest path of its class. Winding paths are left out: after a
    circle round a hole they return to an earlier point, or within sight of it along a row or a
    column, nearer than the side of a square hole of the least area (at least one cell, at most 1 m
    and half the shortest path).

    Parameters
    ----------
    planner
        Planner of the first path; not with OMPL.
    start, goal
        Points `(x, y)` in metres, or names as in `HybridPlanner.plan`.
    count
        Most alternatives, the first included, from 1 to 20.
    least_hole_m2
        Holes of a smaller area do not count: obstacles and, unless they may be entered, unexplored
        islands, with all that they surround, in square metres.
    at
        Position in a named room. With `"anywhere"`, all alternatives start and end at the cells
        that suit the shortest path.
    blocked
        Closures for this query, as in `HybridPlanner.plan`. They make no holes: paths on both sides
        of a closed area are of one class if nothing else lies between them.
    most_states
        Pairs of a cell and a class that are looked at before the search gives up, from 1 to 2^26;
        more take more time and memory.

    Returns
    -------
    Alternatives
        Paths of different classes, the shortest first; none if no path exists. Fewer than `count`
        if there are no more, or, with `complete` False, if the search gave up.

    Raises
    ------
    InvalidValueError
        When the count or the area is out of range, an end is not valid, a closed item is not on the
        map, the planner refines with OMPL or plans by costs, or its grid allows corner cutting.

    Examples
    --------
    >>> probability = np.zeros((5, 5))
    >>> probability[1:4, 1:4] = 1.0
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(probability, robot_radius_m=0))
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(pyramid))
    >>> found = hn.plan_alternatives(planner, (0.5, 0.5), (4.5, 4.5), 3)
    >>> [one.path.length_m for one in found]
    [8.0, 8.0]
    """
    wanted = _checked(count)
    if planner.preset.planner.refine == "ompl":
        raise InvalidValueError(
            "alternatives are paths of the grid: ask a preset without OMPL for them, "
            f"not {planner.preset.name}"
        )
    if planner.costs is not None:
        raise InvalidValueError(
            "alternatives are shortest paths, and this planner plans by costs: ask one without"
        )
    check_names(planner.topology, [start, goal])
    closed = planner.closed(blocked)
    endpoints = points_of_waypoints(
        planner.topology, planner.preset.planner, [start, goal], at=at, closed=closed
    )
    topology = planner.topology
    allowed = planner.preset.planner.allow_unexplored
    search = alternative_search(topology, allow_unexplored=allowed, least_hole_m2=least_hole_m2)
    result = planner.plan(*endpoints, smooth="none", blocked=closed)
    own = result.path
    if own is None:
        return Alternatives((), complete=True)
    first, last = (tuple(own.cells[i].tolist()) for i in (0, -1))
    flat = None if closed is None else closed.flat
    found = search.paths(first, last, wanted, closed=flat, most_states=most_states)
    alternatives = {}
    length_cells = path_length_in_cells(own.cells)
    if result.metric == "octile" and length_cells <= found.shortest_cells * (1 + 1e-12):
        alternatives[search.classes.word_of_path(own.cells)] = own
    elif not found.paths:  # the search gave up before it reached the goal
        enterable = topology.grid.enterable(allow_unexplored=allowed)
        grid_search = GridSearch(enterable, corner_cutting=False)
        cells = grid_search.search(first, last, blocked=flat).cells
        if cells is not None:  # always: the planner found a path
            word = search.classes.word_of_path(cells)
            alternatives[word] = _path(topology, cells, found.shortest_cells)
    for other in found.paths:
        if len(alternatives) < wanted and other.word not in alternatives:
            alternatives[other.word] = _path(topology, other.cells, other.length_cells)
    return Alternatives(
        tuple(Alternative(path, word) for word, path in alternatives.items()),
        complete=found.complete or len(alternatives) == wanted,
    )


def _checked(count: int) -> int:
    try:
        wanted = operator.index(count)
    except TypeError:
        wanted = 0
    if not 1 <= wanted <= MOST:
        raise InvalidValueError(
            f"alternatives must be a whole number from 1 to {MOST}, got {count!r:.80}"
        )
    return wanted


def _path(topology: TopologicalMap, cells: LongArray, length_cells: float) -> Path:
    grid = topology.grid
    return Path(cells, grid.frame.points_of(cells), length_cells * grid.resolution_m)
