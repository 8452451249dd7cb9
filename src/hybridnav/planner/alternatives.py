"""Paths of different homotopy classes between two points."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.planner.blocked import Blocked
from hybridnav.planner.named import At, stop_points
from hybridnav.refine import GridRefiner
from hybridnav.result import Path
from hybridnav.route import Walks
from hybridnav.route.alternatives import AlternativeSearch
from hybridnav.search.octile import path_length_in_cells

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._typing import LongArray
    from hybridnav.planner.planner import HybridPlanner
    from hybridnav.route.alternatives import ClassRoute
    from hybridnav.topology.homotopy import Word

MOST = 20
"""Alternatives that may be asked for."""
_TRIED = 5
"""Classes that are tried for each alternative asked for: a route on places may have no path."""


@dataclass(frozen=True, eq=False)
class Alternative:
    """A path and its class."""

    path: Path
    word: Word
    """Reduced word of its homotopy class; the same for paths that differ by cells alone."""


def plan_alternatives(  # noqa: PLR0913 - the last two have defaults
    planner: HybridPlanner,
    start: ArrayLike | str,
    goal: ArrayLike | str,
    count: int,
    *,
    least_hole_m2: float = 1.0,
    at: At = "anywhere",
) -> list[Alternative]:
    """Plan paths of different homotopy classes: by another door, on the other side of an obstacle.

    The first is the planner's own. For the others routes of other classes are searched on the
    places, and the shortest path is found in the places of each that crosses none of their other
    boundaries; it need not be the shortest of its class on the whole map. Obstacles that one place
    encloses all by itself make no class.

    Parameters
    ----------
    planner
        Plans the first path; its octile metric is that of all.
    start, goal
        Points `(x, y)` in metres, or names as in `HybridPlanner.plan`.
    count
        Alternatives at most, the first included, from 1 to 20.
    least_hole_m2
        Holes of a smaller area do not count.
    at
        Where in a named room.

    Returns
    -------
    list of Alternative
        Of different classes, the shortest first; none where no path exists.

    Raises
    ------
    InvalidValueError
        When the count or the area is out of range, or an end is not valid.
    """
    if not 1 <= count <= MOST:
        raise InvalidValueError(f"alternatives must be from 1 to {MOST}, got {count}")
    ends = stop_points(planner, [start, goal], at=at)
    topology = planner.topology
    first = planner.plan(*ends, smooth="none")
    if first.path is None:
        return []
    allowed = planner.preset.planner.allow_unexplored
    search = AlternativeSearch(topology, allow_unexplored=allowed, least_hole_m2=least_hole_m2)
    maker = _PathMaker(planner, search, first.path)
    found = {maker.word_of(first.path.cells): first.path}
    places = [topology.place_at(tuple(first.path.cells[i].tolist())) for i in (0, -1)]
    for route in islice(search.routes(places[0], places[1]), _TRIED * count):
        if len(found) == count:
            break
        if route.word in found:
            continue
        cells = maker.cells_of(route)
        if cells is not None:
            word = maker.word_of(cells)
            found.setdefault(word, maker.path_of(cells))
    alternatives = [Alternative(path, word) for word, path in found.items()]
    return sorted(alternatives, key=lambda alternative: alternative.path.length_m)


class _PathMaker:
    """Makes cell paths of routes on places, and tells the class of cell paths."""

    def __init__(self, planner: HybridPlanner, search: AlternativeSearch, first: Path) -> None:
        self._topology = planner.topology
        self._classes = search.classes
        allowed = planner.preset.planner.allow_unexplored
        self._refiner = GridRefiner(planner.topology.grid, allow_unexplored=allowed)
        self._walks = Walks(planner.topology)
        self._ends = tuple(first.cells[0].tolist()), tuple(first.cells[-1].tolist())

    def word_of(self, cells: LongArray) -> Word:
        places, arcs = self._walks.of(cells)
        return self._classes.word_of_route(places[0], arcs, self._topology.arcs.astype(np.int64))

    def path_of(self, cells: LongArray) -> Path:
        grid = self._topology.grid
        length_m = path_length_in_cells(cells) * grid.resolution_m
        return Path(cells, grid.frame.points_of(cells), length_m)

    def cells_of(self, route: ClassRoute) -> LongArray | None:
        """The shortest path in the places of a route; where that takes another way among them, the
        shortest that crosses none of their other arcs."""
        topology = self._topology
        inside = np.zeros(topology.n_places, dtype=np.bool_)
        inside[list(route.places)] = True
        other = inside[topology.arcs].all(axis=1) & ~topology.level.is_self_loop
        other[list(route.arcs)] = False
        arcs = topology.arc_ids[np.flatnonzero(other)].tolist()
        search, field_of = self._refiner.search, topology.level.field_of
        found = search.search(*self._ends, field_of=field_of, in_corridor=inside)
        if found.cells is None or self.word_of(found.cells) == route.word:
            return found.cells
        closed = Blocked(arcs=arcs).cells_of(topology)
        return search.search(
            *self._ends, field_of=field_of, in_corridor=inside, blocked=closed
        ).cells
