"""Methods of the user's own, which a preset names as `module:Class`."""

import math
import threading
from dataclasses import replace
from typing import Any

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.moves import path_length_in_cells
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.trig import dist
from hybridnav.errors import PresetError, brief
from hybridnav.maps.geometry import polyline_length
from hybridnav.planning import PlannerSettings
from hybridnav.planning.methods.grid import KnownMap, round_closed
from hybridnav.planning.methods.own_refiner import class_of, one_line, refused
from hybridnav.planning.path import is_length
from hybridnav.refine import GridRefiner
from hybridnav.search.found import Found, Method, Query


def own_method(known: KnownMap, settings: PlannerSettings) -> Method:
    """Import the class that settings name as their method, and make a method of it.

    The class is called with the grid, the keywords `costs` and `allow_unexplored`, and those of
    `settings`. It needs `metric` and `find`; `prepare`, if it has one, is called once, before the
    first query.

    Raises `PresetError` when the module cannot be imported, has no such class, or the class makes
    no method.
    """
    own = class_of(settings.method, "planner.method")
    keywords = {"costs": known.costs, "allow_unexplored": settings.allow_unexplored}
    try:
        made = own(known.grid, **keywords, **settings.settings)
        metric, find = made.metric, made.find
    except Exception as error:
        why = (
            f"it makes no method of the map, {one_line(error)}: expected a class of (grid, *, "
            "costs, allow_unexplored) with metric and find(query)"
        )
        raise refused(settings.method, why, "planner.method") from error
    if metric not in _METRICS or not callable(find):
        why = f"its metric is {brief(metric)}, expected one of {', '.join(_METRICS)}"
        raise refused(settings.method, why, "planner.method")
    return OwnMethod(settings.method, made, known.refiner(settings))


_METRICS = ("octile", "weighted", "any-angle")
"""Metrics in which methods find paths."""


class OwnMethod(Method):
    """A method of the user's own, whose answers are checked before a result shows them."""

    def __init__(self, name: str, own: Any, refiner: GridRefiner) -> None:
        self._name, self._own, self._refiner = name, own, refiner
        self.metric = own.metric
        self._is_prepared = not callable(getattr(own, "prepare", None))
        self._preparing = threading.RLock()  # a progress callback may plan

    def prepare(self, progress: Progress = no_progress) -> object:
        """Prepare the user's method, once, if it has that ability; see `Method`."""
        with self._preparing:
            if not self._is_prepared:
                self._own.prepare()
                self._is_prepared = True
        return super().prepare(progress)

    def find(self, query: Query) -> Found:
        """Find a path, and time it if the method does not; see `Method`.

        The bound is never below the straight line. Raises `PresetError` when the answer is no
        `Found`, or its path does not lead from start to goal, is not as long as stated, or states
        no bound.
        """
        if not self._is_prepared:
            self.prepare()
        began = clock()
        found = self._own.find(query)
        if not isinstance(found, Found):
            raise self._wrong(f"a {type(found).__name__}")
        if not found.stats.seconds:
            found.stats.seconds["find"] = clock() - began
        if not found.has_path:
            return found
        ends = [tuple(cell) for cell in np.asarray(found.cells)[[0, -1]].tolist()]
        if ends != [tuple(cell) for cell in query.cells]:
            raise self._wrong(f"a path from {ends[0]} to {ends[1]}")
        if self.metric != "weighted" and not is_length(found.cost_m, self._driven_m(found)):
            raise self._wrong(f"{found.cost_m:.6g} m for a path of {self._driven_m(found):.6g} m")
        found = replace(found, lower_bound_m=max(self._bound_m(found), self._straight_m(query)))
        if self.metric != "any-angle":
            return round_closed(found, query, self._refiner)
        if query.closed is not None and query.closed.meets(found.cells, self._refiner.grid):
            raise self._wrong("a path through closed cells")
        return found

    def _bound_m(self, found: Found) -> float:
        if found.optimum is None and not math.isfinite(found.lower_bound_m):
            raise self._wrong(f"a path whose lower_bound_m is {found.lower_bound_m}")
        return found.lower_bound_m

    def _straight_m(self, query: Query) -> float:
        """Return the straight line, between the centres of cells for paths of cells."""
        if self.metric == "any-angle":
            return query.straight_m
        return dist(*query.cells) * self._refiner.grid.resolution_m

    def _driven_m(self, found: Found) -> float:
        if found.points is not None:
            return polyline_length(np.array(found.points, np.float64))
        return path_length_in_cells(np.asarray(found.cells)) * self._refiner.grid.resolution_m

    def _wrong(self, what: str) -> PresetError:
        return PresetError(
            f"planner.method: {self._name}: find returned {what}, expected a Found with a path "
            "from the first cell of the query to the last, its length and a bound on that of all "
            "paths (0 for none), or without a path"
        )
