"""Alternatives by homotopy classes: shortest paths of cells on other sides of obstacles."""

from __future__ import annotations

import math
from dataclasses import replace
from numbers import Real
from time import perf_counter
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._base.moves import path_length_in_cells
from hybridnav.errors import InvalidValueError
from hybridnav.ext.classes import alternative_search
from hybridnav.ext.classes.search import MOST_STATES, TIME_LIMIT_S, check_limits
from hybridnav.maps.geometry import cells_of_line, polyline_length
from hybridnav.planner import Path
from hybridnav.planner.by_doors import Chosen, Track, admissible
from hybridnav.planner.tour import tour_of
from hybridnav.refine import LineOfSight
from hybridnav.route.route import RouteFinder, RouteOfCells
from hybridnav.search.grid_search import GridSearch

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from hybridnav._base.typing import LongArray
    from hybridnav.ext.classes import AlternativeSearch, ClassPath, ClassPaths
    from hybridnav.ext.classes.classes import Word
    from hybridnav.planner import PlanResult
    from hybridnav.planner.by_doors import DoorTours, RouteLimits
    from hybridnav.planner.planner import HybridPlanner
    from hybridnav.planner.tour import Tour
    from hybridnav.search.found import ClosedCells

Cell = tuple[int, int]
_LEAST_S = 1e-3
"""Seconds of a search whose call is late already: it looks at the clock and stops."""


class ClassEffort(NamedTuple):
    """What counts as an obstacle, and when a search for classes gives up."""

    least_hole_m2: float
    """Holes of a smaller area do not count."""
    most_states: int
    """Pairs of a cell and a word."""
    time_limit_s: float
    """Seconds."""


_LEAST_HOLE_M2 = 1.0


def effort_of(
    least_hole_m2: float | None, most_states: int | None, time_limit_s: float | None
) -> ClassEffort:
    """Return what a search for classes takes if it is in range; None stands for the default."""
    hole = _LEAST_HOLE_M2 if least_hole_m2 is None else least_hole_m2
    states = MOST_STATES if most_states is None else most_states
    seconds = TIME_LIMIT_S if time_limit_s is None else time_limit_s
    check_limits(states, seconds)
    if not (isinstance(hole, Real) and 0 <= hole < math.inf):
        raise InvalidValueError(
            f"least hole must be a finite number of square metres >= 0, got {hole!r:.80}"
        )
    return ClassEffort(hole, states, seconds)


class ClassTours:
    """The search for tours of other homotopy classes than a first one.

    Parameters
    ----------
    planner
        Planner of the first tour, without OMPL.
    waypoints
        Start and goal, as the caller named them.
    closed
        Cells closed for the query; None for none.
    effort
        Obstacles and limits of the search.
    """

    def __init__(
        self,
        planner: HybridPlanner,
        waypoints: Sequence[ArrayLike | str],
        closed: ClosedCells | None,
        effort: ClassEffort,
    ) -> None:
        if planner.preset.planner.method == "ompl":
            raise InvalidValueError(
                "homotopy classes are of paths of the grid: ask a preset without OMPL for them, "
                f'or by="doors", not {planner.preset.name}'
            )
        self._planner, self._waypoints = planner, waypoints
        self._closed, self._effort = closed, effort
        self._allowed = planner.preset.planner.allow_unexplored
        self._until: float | None = None
        self._search: AlternativeSearch = alternative_search(
            planner.topology,
            allow_unexplored=self._allowed,
            least_hole_m2=effort.least_hole_m2,
        )
        self.stopped = ""
        """Description of the limit at which the search stopped, empty if it did not."""

    def find(self, first: Tour, count: int) -> list[tuple[Tour, Word]]:
        """Find paths of cells of different classes, the shortest first.

        Parameters
        ----------
        first
            The plain plan, solved.
        count
            Most paths.
        """
        whole = first.results[0]
        own = whole
        if whole.metric != "octile":
            assert whole.start is not None  # noqa: S101 - the plan is solved
            assert whole.goal is not None  # noqa: S101
            own = self._planner.plan(whole.start, whole.goal, smooth="none", blocked=self._closed)
        assert own.path is not None  # noqa: S101 - the first is solved
        endpoints = _endpoints(own)
        found = self._paths(endpoints, count, None if self._closed is None else self._closed.flat)
        per_cell = self._planner.grid.resolution_m
        bound_m = found.shortest_cells * per_cell
        results: dict[Word, PlanResult] = {}
        length_cells = path_length_in_cells(own.path.cells)
        word_of = self._search.classes.word_of_path
        if own.metric == "octile" and length_cells <= found.shortest_cells * (1 + 1e-12):
            results[word_of(own.path.cells)] = own
        elif not found.paths:  # the search gave up before it reached the goal
            cells = self._shortest(endpoints)
            results[word_of(cells)] = self._result(own, cells, bound_m, bound_m)
        for other in found.paths:
            if len(results) < count and other.word not in results:
                length_m = other.length_cells * per_cell
                results[other.word] = self._result(own, other.cells, length_m, bound_m)
        if len(results) == count:
            self.stopped = ""
        return [(self._tour(result), word) for word, result in results.items()]

    def inside(self, search: DoorTours, chosen: list[Chosen], limits: RouteLimits) -> list[Chosen]:
        """Return tours by doors with others by the same doors, on other sides of obstacles.

        Parameters
        ----------
        search
            The search that found them.
        chosen
            Tours by doors, the first one first.
        limits
            RouteLimits of all of them; here only what lies near a shorter path is in common.
        """
        whole = chosen[0].tour
        planned = [(one, Track(one.tour, search.near_m, by_legs=False)) for one in chosen]
        for one in chosen:
            closed = search.closed_round(one.tour)
            if closed is None:
                continue
            result = one.tour.results[0]
            own = None if result.path is None else self._word_of(result.path.cells)
            for other in self._paths(_endpoints(result), limits.count, closed).paths:
                if other.word == own:
                    continue
                tour = self._tour(self._like(result, other, closed, whole.lower_bound))
                if tour.length_m <= limits.max_stretch * whole.length_m:
                    track = Track(tour, search.near_m, by_legs=False)
                    planned.append((Chosen(tour), track))
        return [one for one, _ in admissible(planned, limits)]

    def _paths(
        self, endpoints: tuple[Cell, Cell], count: int, closed: LongArray | None
    ) -> ClassPaths:
        effort = self._effort
        if self._until is None:  # all searches of a call share its time
            self._until = perf_counter() + effort.time_limit_s
        left_s = max(self._until - perf_counter(), _LEAST_S)
        found = self._search.paths(
            *endpoints,
            count,
            closed=closed,
            most_states=effort.most_states,
            time_limit_s=min(left_s, effort.time_limit_s),
        )
        if not found.complete:
            limit = f"{effort.most_states:,} states (most_states)"
            if found.is_late:
                limit = f"{effort.time_limit_s:g} s (time_limit_s)"
            self.stopped = f"the search stopped after {limit}: there may be more"
        return found

    def _shortest(self, endpoints: tuple[Cell, Cell]) -> LongArray:
        """Return a shortest path of cells."""
        grid = self._planner.grid
        search = GridSearch(grid.enterable(allow_unexplored=self._allowed), corner_cutting=False)
        flat = None if self._closed is None else self._closed.flat
        cells = search.search(*endpoints, blocked=flat).cells
        assert cells is not None  # noqa: S101 - the planner found a path
        return cells

    def _result(
        self, like: PlanResult, cells: LongArray, length_m: float, bound_m: float
    ) -> PlanResult:
        """Return the result of a path of cells."""
        topology = self._planner.topology
        assert like.start is not None  # noqa: S101 - the plan is solved
        assert like.goal is not None  # noqa: S101
        path = Path(cells, topology.grid.frame.points_of(cells), length_m)
        return replace(
            like,
            metric="octile",
            path=path.turned_at_ends(like.start, like.goal),
            route_source=RouteOfCells(topology, RouteFinder(topology), cells),
            instruction_source=(),
            bound_source=bound_m,
        )

    def _like(
        self, result: PlanResult, other: ClassPath, closed: LongArray, bound_m: float
    ) -> PlanResult:
        """Return the result of a path of cells in the metric of another result."""
        grid = self._planner.grid
        length_m = other.length_cells * grid.resolution_m
        found = self._result(result, other.cells, length_m, min(bound_m, length_m))
        if result.metric == "octile":
            return found
        assert result.start is not None  # noqa: S101 - the plan is solved
        assert result.goal is not None  # noqa: S101
        sight = LineOfSight(grid, allow_unexplored=self._allowed, closed=closed)
        start, goal = (np.array(end[:2]) for end in (result.start, result.goal))
        points = sight.shorten(other.cells, start, goal)
        passed = cells_of_line(
            self._search.classes.enterable_cells, grid.frame.positions_of(points)
        )
        if self._word_of(passed) != other.word:
            return found  # shortened, it passes the obstacle on another side
        length_m = polyline_length(points)
        return replace(
            found,
            metric=result.metric,
            path=Path(other.cells, points, length_m).turned_at_ends(result.start, result.goal),
            bound_source=min(bound_m, length_m),
        )

    def _word_of(self, cells: LongArray) -> Word:
        """Return the class of the cells of a line, which may touch corners of what is closed."""
        classes = self._search.classes
        is_diagonal = (np.diff(cells, axis=0) != 0).all(axis=1)
        side = np.stack([cells[:-1, 0], cells[1:, 1]], axis=1)
        other = np.stack([cells[1:, 0], cells[:-1, 1]], axis=1)
        side = np.where(classes.enterable_cells[tuple(side.T)][:, None], side, other)
        at = np.flatnonzero(is_diagonal)
        return classes.word_of_path(np.insert(cells, at + 1, side[at], axis=0))

    def _tour(self, result: PlanResult) -> Tour:
        return tour_of(self._planner, [result], self._waypoints)


def _endpoints(result: PlanResult) -> tuple[Cell, Cell]:
    """Return the cells of start and goal of a solved result."""
    assert result.path is not None  # noqa: S101 - it is solved
    (row, col), (to_row, to_col) = result.path.cells[[0, -1]].tolist()
    return (row, col), (to_row, to_col)
