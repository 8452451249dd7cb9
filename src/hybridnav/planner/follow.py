"""Changes of the map under a planner: which cells changed, and what stands for stale places."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.areas import class_reach, class_rules
from hybridnav.maps.checks import checked_type
from hybridnav.planner import PlanResult, PlanStatus
from hybridnav.planner.cell_planner import Carried, Following
from hybridnav.planner.select import cell_planner
from hybridnav.route.route_finder import RouteFinder, RouteOfCells
from hybridnav.topology import TopologicalMap

if TYPE_CHECKING:
    from typing import NoReturn

    from hybridnav._base.typing import FloatArray, LongArray
    from hybridnav.maps.areas import Box
    from hybridnav.maps.costs import CostLayer
    from hybridnav.planner import Metric, Path, Preset
    from hybridnav.planner.cell_planner import CellPlan, CellPlanner
    from hybridnav.planner.costs import PlannerCosts
    from hybridnav.planner.ompl_plans import OmplPlan
    from hybridnav.pyramid import DualGraphPyramid


_ON_CELLS = "none", "mesh", "jumps"
"""Values of `coarse` that need no places."""


class StalePlaces:
    """Stands for the topological map of a grid that changed after its places were built.

    It has the grid. Whatever else is asked of it is refused, so that no place of the map before is
    taken for one of the map now.
    """

    def __init__(self, grid: OccupancyGrid, built: DualGraphPyramid) -> None:
        self.grid = grid
        self.built = built
        """The pyramid of the map before, for the record of how it was built."""

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("_"):  # what copies and pickles look for
            raise AttributeError(name)
        raise InvalidValueError(
            f"the map changed after its places were built, and {name} belongs to them: call "
            "update with topology, the topological map of the grid now"
        )


def is_stale(topology: TopologicalMap) -> bool:
    """Return whether this stands for a topological map whose grid changed."""
    return isinstance(topology, StalePlaces)


def built_of(topology: TopologicalMap) -> DualGraphPyramid:
    """Return the pyramid of a topological map, or of the one that it was before its grid
    changed."""
    return topology.built if isinstance(topology, StalePlaces) else topology.pyramid


class PlannerChange(NamedTuple):
    """What an update gives to a planner: at least one of the first three."""

    costs: CostLayer | None
    """The new costs, None to keep those given before."""
    grid: OccupancyGrid | None
    """The map now, None to take that of `topology`."""
    topology: TopologicalMap | None
    """The places of the map now, None for a grid alone."""
    box: Box
    """First row, last row + 1, first column, last column + 1 of the cells that may have changed."""

    @property
    def is_of_map(self) -> bool:
        """Whether the map changes, and not the costs alone."""
        return self.grid is not None or self.topology is not None


def change_of(
    costs: CostLayer | None, grid: OccupancyGrid | None, topology: TopologicalMap | None, box: Box
) -> PlannerChange:
    """Return the change that an update was given.

    Raises
    ------
    InvalidValueError
        When nothing is given, or something of another type.
    """
    if topology is not None:
        checked_type("topology", topology, TopologicalMap)
    if grid is not None:
        checked_type("grid", grid, OccupancyGrid)
    if costs is None and topology is None and grid is None:
        raise InvalidValueError(
            "update was given no costs, grid or topology, expected one of them: pass what changed"
        )
    return PlannerChange(costs, grid, topology, box)


def followed(
    topology: TopologicalMap,
    preset: Preset,
    cells: CellPlanner,
    costs: PlannerCosts,
    change: PlannerChange,
) -> tuple[TopologicalMap, CellPlanner, PlannerCosts]:
    """Return the places, the planner of cell paths, and the costs after a change of the map.

    Parameters
    ----------
    topology, preset, cells, costs
        Those of a planner; unchanged.
    change
        The map now, and new costs on it if there are any.

    Raises
    ------
    InvalidValueError
        When the planner cannot follow, or the grid or the costs are those of another map.
    """
    settings, places, grid = preset.planner, change.topology, change.grid
    if settings.refine == "ompl":
        raise InvalidValueError(
            f"preset {preset.name} cannot follow a change, because OMPL's process has the map: "
            "make a new planner of the map now"
        )
    if places is None and settings.coarse not in _ON_CELLS:
        raise InvalidValueError(
            f"preset {preset.name} plans on the places of its map, and only a grid is given: call "
            "update with topology too, or take preset shortest, octile or grid-astar"
        )
    if places is not None:
        if grid is not None and not np.array_equal(grid.classes, places.grid.classes):
            raise InvalidValueError(
                "grid and topology are those of different maps, expected the places of the grid: "
                "build them of it"
            )
        grid = places.grid
    assert grid is not None  # noqa: S101 - one of both is given
    changed = changed_cells(topology.grid, grid, change.box)
    if places is None:
        places = cast("TopologicalMap", StalePlaces(grid, built_of(topology)))
    costs = costs.on(grid)
    if change.costs is not None:
        costs, _ = costs.changed(change.costs, change.box)
    if isinstance(cells, Following):
        return places, cells.followed(grid, changed), costs
    if isinstance(cells, Carried):
        return places, cast("CellPlanner", cells.carried(places, costs.layer)), costs
    return places, cell_planner(places, settings, None, costs.layer), costs


def changed_cells(before: OccupancyGrid, now: OccupancyGrid, box: Box) -> LongArray:
    """Return the cells whose class changed, int64 (m, 2), (row, col), in the order of rows.

    Parameters
    ----------
    before, now
        The map before and after.
    box
        First row, last row + 1, first column, last column + 1 of the cells whose measurements may
        have changed; the robot's radius is added here.

    Raises
    ------
    InvalidValueError
        When the grids differ in shape, frame, or in what is legal, or outside the box.
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


# Results of queries: with their routes, and with the settings that they were planned by.

Poses = tuple["FloatArray", "FloatArray"]


class Outcomes:
    """Makes the results of one planner.

    Parameters
    ----------
    topology
        The map; with stale places results have no routes.
    preset
        The preset of the planner.
    costs
        The costs that it plans by; None for lengths.
    """

    def __init__(
        self, topology: TopologicalMap, preset: Preset, costs: CostLayer | None = None
    ) -> None:
        self._topology = topology
        self._preset = preset
        self._costs = costs
        self._built = built_of(topology)
        self._route_finder = None if is_stale(topology) else RouteFinder(topology)

    def answer(self, status: PlanStatus, poses: Poses, **outcome: Any) -> PlanResult:
        """Return a result that records the endpoints, the preset and the settings of the
        pyramid."""
        # Each result has its own settings, so that a change of one does not affect the next.
        settings = {
            key: dict(value) if isinstance(value, dict) else value
            for key, value in self._settings.items()
        }
        start, goal = tuple(poses[0].tolist()), tuple(poses[1].tolist())
        return PlanResult(status, settings=settings, start=start, goal=goal, **outcome)

    def no_path(self, plan: CellPlan, poses: Poses, metric: Metric) -> PlanResult:
        """Return the result of a plan without a path."""
        bound = plan.bound_cells * self._topology.grid.resolution_m
        return self.answer(
            PlanStatus.NO_PATH, poses, metric=metric, lower_bound=bound, stats=plan.stats
        )

    def solved(  # noqa: PLR0913 - the last has a default
        self,
        plan: CellPlan,
        poses: Poses,
        path: Path,
        metric: Metric,
        bound_m: float,
        *,
        weighted_cost: float | None = None,
    ) -> PlanResult:
        """Return the result of a plan with a path."""
        return self.answer(
            PlanStatus.SOLVED,
            poses,
            metric=metric,
            path=path.turned_at_ends(*poses),
            route_source=plan.route or self.route_of(path),
            lower_bound=bound_m,
            weighted_cost=weighted_cost,
            stats=plan.stats,
        )

    def by_ompl(self, found: OmplPlan, plan: CellPlan, poses: Poses, bound_m: float) -> PlanResult:
        """Return the result of a coarse plan refined by OMPL, with the bound of the coarse one."""
        bound = max(found.lower_bound, bound_m)
        if found.path is not None and found.status is PlanStatus.SOLVED:
            bound = min(bound, found.weighted_cost or found.path.length_m)
        path = found.path
        if path is not None and path.headings_rad is None and found.status is PlanStatus.SOLVED:
            path = path.turned_at_ends(*poses)
        return self.answer(
            found.status,
            poses,
            metric=found.metric,
            path=path,
            route_source=self.route_of(found.path),
            lower_bound=bound,
            weighted_cost=found.weighted_cost,
            refinement=found.refinement,
            stats=plan.stats,
        )

    def route_of(self, path: Path | None) -> RouteOfCells | None:
        """Return what the route of a path is found from, None for no path or stale places."""
        if path is None or self._route_finder is None:
            return None
        return RouteOfCells(self._topology, self._route_finder, path.cells)

    @cached_property
    def _settings(self) -> dict[str, Any]:
        pyramid = self._built
        costs = {} if self._costs is None else {"costs": self._costs.source}
        return {
            "preset": self._preset.name,
            "planner": self._preset.planner.model_dump(),
            "pyramid": {
                "merge_distance_m": pyramid.merge_distance_m,
                "linkage": pyramid.linkage,
                "seed": pyramid.seed,
                "robot_radius_m": self._topology.grid.robot_radius_m,
            },
            **costs,
        }
