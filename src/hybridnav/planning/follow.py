"""Changes under a planner: of its costs, or of its map, whose changed cells methods follow."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.areas import class_reach, class_rules
from hybridnav.maps.checks import checked_type
from hybridnav.planning.methods import make_method
from hybridnav.planning.methods.grid import KnownMap
from hybridnav.search.found import MapChange
from hybridnav.topology import TopologicalMap
from hybridnav.topology.map import is_version

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._base.typing import LongArray
    from hybridnav.maps.cells import Box
    from hybridnav.maps.costs import CostLayer
    from hybridnav.planning.costs import PlannerCosts
    from hybridnav.planning.planning import Planning
    from hybridnav.topology.map import Version


class PlannerUpdate(NamedTuple):
    """What an update gives to a planner: at least one of the first three."""

    costs: CostLayer | None
    """The new costs, None to keep those given before."""
    grid: OccupancyGrid | None
    """The map now, None to take that of `topology`."""
    topology: TopologicalMap | None
    """The places of the map now, None for a grid alone."""
    box: Box
    """First row, last row + 1, first column, last column + 1 of the cells that may have changed."""


def update_of(
    costs: CostLayer | None,
    grid: OccupancyGrid | Version | None,
    topology: TopologicalMap | None,
    box: Box,
) -> PlannerUpdate:
    """Return the update that was given; a version stands for its places.

    Raises `InvalidValueError` when nothing is given, or something of another type.
    """
    if topology is not None:
        checked_type("topology", topology, TopologicalMap)
    if is_version(grid):
        topology, grid = topology or TopologicalMap(grid), grid.grid
    map_now = None if grid is None else checked_type("grid", grid, OccupancyGrid)
    if costs is None and topology is None and map_now is None:
        raise InvalidValueError(
            "update was given no costs, grid or topology, expected one of them: pass what changed"
        )
    return PlannerUpdate(costs, map_now, topology, box)


def begun(now: Planning, update: PlannerUpdate) -> Callable[[], Planning]:
    """Check all of an update, and return what ends it while no query runs: how to plan then.

    Raises `InvalidValueError` when the planner cannot follow, or the grid or the costs are those of
    another map.
    """
    if now.ompl is not None:
        raise InvalidValueError(
            f"preset {now.preset.name} cannot follow a change, because OMPL's process has the map: "
            "make a new planner of the map now"
        )
    if update.grid is not None or update.topology is not None:
        followed = _followed(now, update)
        return lambda: followed
    assert update.costs is not None  # noqa: S101 - one of the three is given
    return partial(_recosted, now, *now.costs.changed(update.costs, update.box))


def _recosted(now: Planning, costs: PlannerCosts, box: Box) -> Planning:
    """Return how to plan by other costs, by the method itself where it can take them."""
    method, layer = now.method, costs.layer
    if layer is None or not method.take_costs(layer, box):
        method = make_method(KnownMap(now.grid, now.topology, layer), now.preset.planner)
    return replace(now, method=method, costs=costs)


def _followed(now: Planning, update: PlannerUpdate) -> Planning:
    """Return how to plan on a changed map; what is now stays as it is."""
    settings, places, grid = now.preset.planner, update.topology, update.grid
    if places is None and settings.needs_places:
        raise InvalidValueError(
            f"preset {now.preset.name} plans on the places of its map, and only a grid is given: "
            "call update with a version of an OnlinePyramid as grid, or with topology too"
        )
    if places is not None:
        if grid is not None and not np.array_equal(grid.classes, places.grid.classes):
            raise InvalidValueError(
                "grid and topology are those of different maps, expected the places of the grid: "
                "build them of it"
            )
        grid = places.grid
    assert grid is not None  # noqa: S101 - one of both is given
    cells, costs = changed_cells(now.grid, grid, update.box), now.costs.on(grid)
    if update.costs is not None:
        costs, _ = costs.changed(update.costs, update.box)
    method = now.method.changed(MapChange(grid, places, costs.layer, cells))
    if method is None:
        method = make_method(KnownMap(grid, places, costs.layer), settings)
    built = now.built if places is None else places
    planning = replace(now, grid=grid, built=built, method=method, costs=costs, closures={})
    planning.closed(None)  # warns of one-way doors that are lost
    return planning


def opened(now: Planning, cells: list[int]) -> Planning:
    """Return how to plan with flat cells open that the costs close; what is now stays."""
    costs = now.costs.opened(cells)
    known = KnownMap(now.grid, now.topology, costs.layer)
    method = now.method.changed(MapChange(*known[:3], np.empty((0, 2), np.int64)))
    return replace(now, method=method or make_method(known, now.preset.planner), costs=costs)


def changed_cells(before: OccupancyGrid, now: OccupancyGrid, box: Box) -> LongArray:
    """Return the cells whose class changed, int64 (m, 2), (row, col), in the order of rows.

    `before`, `now`: the map before and after; `box`: first row, last row + 1, first column, last
    column + 1 of the cells whose measurements may have changed; the robot's radius is added here.
    Raises `InvalidValueError` when the grids differ in shape, frame, or in what is legal, or
    outside the box.
    """
    for what, old, new in (
        ("a shape of cells", before.shape, now.shape),
        ("a frame", before.frame, now.frame),
        ("corner_cutting", before.corner_cutting, now.corner_cutting),
    ):
        if old != new:
            raise InvalidValueError(
                f"the grid has {what} {new}, expected {old}: make a new planner for another map"
            )
    flat = np.flatnonzero(before.classes != now.classes)  # argwhere takes 15 times as long
    cells: LongArray = np.stack(np.divmod(flat, now.shape[1]), axis=1)
    if class_rules(before) == class_rules(now) and now.least_island_m2 == 0:
        _check_inside(cells, box, class_reach(now))
    return cells


def _check_inside(cells: LongArray, box: Box, reach: int) -> None:
    """Refuse changed cells beyond what a box of measurements reaches: proofs need all of them."""
    is_box = box[0] < box[1] and box[2] < box[3]
    low, high = np.array(box[::2]) - reach, np.array(box[1::2]) + reach
    outside = ~((cells >= low) & (cells < high)).all(axis=1) | (not is_box)
    if outside.any():
        row, col = cells[outside][0].tolist()
        raise InvalidValueError(
            f"{int(outside.sum())} cells changed outside what changed states, the first at row "
            f"{row}, column {col}: pass changed=None to compare all cells"
        )
