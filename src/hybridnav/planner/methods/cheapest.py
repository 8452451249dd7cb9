"""Method `cheapest`: cheapest cell paths on the multilevel overlay of the map."""

from __future__ import annotations

import time
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.progress import no_progress
from hybridnav._base.threads import Turns
from hybridnav.planner.methods.grid import KnownMap, WholeMap, on_cells, round_closed
from hybridnav.search.found import Method, PlanStats
from hybridnav.search.overlay import OverlaySearch, PathsTooLongError, prepare_overlay

if TYPE_CHECKING:
    from hybridnav._base.progress import Progress
    from hybridnav._base.typing import AnyArray, BoolArray, LongArray
    from hybridnav.maps.areas import Box
    from hybridnav.maps.costs import CostLayer
    from hybridnav.planner.settings import CheapestSettings
    from hybridnav.search.found import Found, MapChange, Metric, Query
    from hybridnav.search.overlay import Overlay


_WORTH = 20
"""Times that queries expand all cells before the overlay is built: building it takes 3 to 7 us a
cell, A* 0.2 us for each cell that it expands."""


@copies_alike
class OverOverlay(Method):
    """Cheapest paths of cells; the overlay is built once queries have spent as much time without.

    Until then, and if corners may be cut, A* searches the whole map. Without costs the paths are
    the shortest ones. It is not kept with a model: it belongs to costs, and these may change.

    Parameters
    ----------
    known
        The map with its places, whose pyramid has the fields of the overlay, and its costs.
    settings
        Whether unexplored cells may be entered, and the accepted distance from the optimum.
    """

    def __init__(self, known: KnownMap, settings: CheapestSettings) -> None:
        assert known.topology is not None  # noqa: S101 - no method of places is made without
        self._topology, self._settings = known.topology, settings
        self._allow_unexplored = settings.allow_unexplored
        self._epsilon = settings.epsilon or 0.0
        self._take(known)
        self._built: tuple[Overlay, OverlaySearch] | None = None
        self._is_too_long = False
        """Whether the costs of paths inside a field do not fit, as with factors of hundreds."""
        self._overdue: Box | None = None
        """Box of the cells that are other ones than in the overlay."""
        self._expanded = 0
        self._building = Turns()

    @cached_property
    def _worth(self) -> int:
        """Number of expanded cells after which the overlay is built."""
        free = self._topology.grid.enterable(allow_unexplored=self._allow_unexplored)
        return _WORTH * int(free.sum())

    def _take(self, known: KnownMap) -> None:
        self._whole_map = WholeMap(known, self._settings)
        self._refiner, _ = self._whole_map.refiners
        self.metric: Metric = self._whole_map.metric

    def prepare(self, progress: Progress = no_progress) -> None:
        """Build the overlay, or renew what updates have made stale; see `Method`."""
        self._building.alone(partial(self._build_or_renew, progress))
        progress(1, 1)

    def _build_or_renew(self, progress: Progress) -> None:
        if self._built is not None:
            self._built[0].renew(progress)
        elif self._can_build:
            self._build(progress)

    @property
    def _can_build(self) -> bool:
        """Whether an overlay of the map could be built: one needs a cell that may be entered."""
        grid = self._topology.grid
        is_open = grid.enterable(allow_unexplored=self._allow_unexplored)
        return not (self._is_too_long or grid.corner_cutting) and bool(is_open.any())

    def _build(self, progress: Progress) -> None:
        costs, allowed = self._refiner.costs, self._allow_unexplored
        factor: Any = None if costs is None else costs.factors
        try:
            overlay = prepare_overlay(
                self._topology, factor, allow_unexplored=allowed, progress=progress
            )
            if costs is not None and len(costs.closed_flat):
                overlay.update(
                    factor, closed=costs.keepout, changed=_box_of(costs.closed_flat, costs.shape)
                )
                overlay.renew()
            now = self._refiner.costs
            if now is not costs and now is not None:  # a progress callback has changed them
                new: Any = now.factors
                overlay.update(new, closed=now.keepout)
        except PathsTooLongError:
            self._is_too_long = True
            return
        self._built = overlay, OverlaySearch(overlay)

    def take_costs(self, costs: CostLayer, box: Box) -> bool:
        """Plan by other costs from now on; see `Method`."""
        self._building.alone(partial(self._take_costs, costs, box))
        return True

    def _take_costs(self, costs: CostLayer, box: Box) -> None:
        self._take(KnownMap(self._topology.grid, self._topology, costs))
        if self._built is None:
            self._is_too_long = False
            return
        factor: Any = costs.factors
        try:
            self._built[0].update(factor, closed=costs.keepout, changed=box)
        except PathsTooLongError:
            self._built, self._is_too_long = None, True

    def changed(self, change: MapChange) -> OverOverlay:
        """Return the method of a changed map, which takes the overlay over; see `Method`."""
        other = OverOverlay(KnownMap(*change[:3]), self._settings)
        other._built, other._expanded = self._built, self._expanded
        if self._built is not None:
            before, now = self._state(), other._state()
            differs = np.logical_or.reduce([a != b for a, b in zip(before, now, strict=True)])
            other._overdue = _box_of(np.flatnonzero(differs), differs.shape)
        return other

    def _state(self) -> tuple[AnyArray, BoolArray, BoolArray]:
        """Return the factors of the cells, which may be entered, and which of these are closed."""
        costs, grid = self._refiner.costs, self._topology.grid
        enterable = grid.enterable(allow_unexplored=self._allow_unexplored)
        closed = None if costs is None else costs.keepout
        factors = np.ones(grid.shape, np.float32) if costs is None else costs.factors
        return factors, enterable, np.zeros(grid.shape, np.bool_) if closed is None else closed

    def catch_up(self) -> None:
        """Take the changed cells into the overlay; see `Method`."""
        self._building.alone(self._catch_up)

    def _catch_up(self) -> None:
        if self._built is None or self._overdue is None:
            return
        factors, enterable, closed = self._state()
        factor: Any = factors
        try:
            self._built[0].update(factor, enterable=enterable, closed=closed, changed=self._overdue)
        except PathsTooLongError:
            self._built, self._is_too_long = None, True
        self._overdue = None

    def find(self, query: Query) -> Found:
        """Find a cheapest path, or one within epsilon of it; see `Method`."""
        began = time.perf_counter()
        seconds = {}
        if self._built is None and self._expanded >= self._worth:
            self.prepare()
            seconds["overlay"] = time.perf_counter() - began
        built = self._built
        if built is None:
            found = self._whole_map.find(query)
            self._expanded += found.stats.expanded
            return found
        now = time.perf_counter()
        path = built[1].path(*query.cells, epsilon=self._epsilon)
        seconds["search"] = time.perf_counter() - now
        stats = PlanStats(
            expanded=path.expanded,
            expanded_border_cells=path.expanded_border_cells,
            seconds=seconds,
        )
        bound = path.lower_bound_cells
        found = on_cells(self._refiner, path.cells, bound_cells=bound, stats=stats)
        return round_closed(found, query, self._refiner)


def _box_of(flat: LongArray, shape: tuple[int, ...]) -> Box:
    """Return the box that holds some flat cells, an empty one for none."""
    if not len(flat):
        return 0, 0, 0, 0
    rows, cols = np.divmod(flat, shape[1])
    return int(rows.min()), int(rows.max()) + 1, int(cols.min()), int(cols.max()) + 1
