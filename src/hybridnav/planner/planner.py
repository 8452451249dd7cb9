"""The hybrid planner: paths between points by a preset, with their routes."""

from __future__ import annotations

import time
from dataclasses import replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, cast

from hybridnav._copies import copies_alike
from hybridnav._progress import no_progress
from hybridnav.config import Preset, load_preset
from hybridnav.errors import InvalidValueError
from hybridnav.grid.areas import box_of_area
from hybridnav.planner.batch import plan_many
from hybridnav.planner.cell_planner import Carried, CellQuery, Updatable
from hybridnav.planner.closed import ClosedCells, Closures
from hybridnav.planner.costs import PlannerCosts
from hybridnav.planner.drafts import PlanDraft, draft_on_mesh
from hybridnav.planner.endpoints import cells_of_endpoints, read_end, read_point, read_points
from hybridnav.planner.finish import Finish, Smooth
from hybridnav.planner.follow import MapChange, change_of, followed, is_stale
from hybridnav.planner.outcome import Outcomes
from hybridnav.planner.radius import check_radius
from hybridnav.planner.select import cell_planner
from hybridnav.result import PlanStatus
from hybridnav.search.turns import Turns

if TYPE_CHECKING:
    from collections.abc import Callable
    from contextlib import AbstractContextManager

    from numpy.typing import ArrayLike
    from shapely.geometry.base import BaseGeometry

    from hybridnav._progress import Progress
    from hybridnav._typing import FloatArray, PathLike
    from hybridnav.costs import CostLayer
    from hybridnav.grid import OccupancyGrid
    from hybridnav.grid.areas import Box
    from hybridnav.planner.blocked import Closable
    from hybridnav.planner.cell_planner import CellPlan, CellPlanner, Prepared
    from hybridnav.planner.itinerary import Guide
    from hybridnav.planner.mesh_plans import OverMesh
    from hybridnav.planner.named import At
    from hybridnav.planner.ompl_plans import OmplPlanner
    from hybridnav.result import PlanBatch, PlanResult
    from hybridnav.topology import TopologicalMap


@copies_alike
class HybridPlanner:
    """Planner of paths between points of one map by a preset.

    Threads may share a planner; queries with OMPL run one after the other. The structures of a
    preset are built at the first query, or by `prepare`; with OMPL they are built at once, so that
    no query's time includes them.

    Parameters
    ----------
    topology
        The topological map with its grid. It may have been built with other settings than the
        preset's `pyramid` section: results record the actual ones.
    preset
        Name of a preset, path to a preset file, or a `Preset`.
    prepared
        `prepared` of another planner of the same map and preset, to use; None to build anew.
    costs
        A factor for each cell, by which a metre in it costs more, joined with the costs that the
        preset names. The path is the cheapest one, and its result has the metric `weighted`. Only
        for presets with `refine: grid-astar`, or with `coarse: overlay` or `portals`.

    Raises
    ------
    PresetError
        When the preset does not exist or is not valid, or names a refiner that cannot be used.
    InvalidValueError
        When the map has the default radius, not chosen by the caller, and the preset names another;
        when the costs are those of another map, or the preset cannot plan by costs.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> planner = hn.HybridPlanner(topology, preset="shortest")
    >>> result = planner.plan((0.5, 0.5), (2.0, 2.5))
    >>> print(result.status, round(result.cost, 3), result.gap)
    solved 2.546 0.0
    """

    def __init__(
        self,
        topology: TopologicalMap,
        *,
        preset: PathLike | Preset = "shortest",
        prepared: Prepared | None = None,
        costs: CostLayer | None = None,
    ) -> None:
        self.topology = topology
        self.preset = load_preset(preset)
        check_radius(topology.grid, self.preset)
        settings = self.preset.planner
        self._costs = PlannerCosts(topology.grid, self.preset, costs)
        self._cells = cell_planner(topology, settings, prepared, self.costs)
        self._closures = Closures(topology)
        self._turns = Turns()
        self._begun: Callable[[], None] | None = None
        """The update that has begun and not ended; an interrupt leaves it here."""
        self._preparing = Turns()
        self._make_answers()
        self._ompl: OmplPlanner | None = None
        if settings.refine == "ompl":
            # Loads modules for these presets only, or reports which one to install.
            from hybridnav.planner.ompl_plans import ompl_planner  # noqa: PLC0415

            self._ompl = ompl_planner(topology, self._cells, settings)

    def _make_answers(self) -> None:
        """Make what turns the paths of `_cells` into results, by the costs of now."""
        grid = self.topology.grid
        self._outcomes = Outcomes(self.topology, self.preset, self.costs)
        self._finish = Finish(
            grid, self._cells, self._outcomes, self.preset.planner, costs=self.costs
        )

    @property
    def costs(self) -> CostLayer | None:
        """The costs that it plans by, None for lengths."""
        return self._costs.layer

    @property
    def prepared(self) -> Prepared | None:
        """The structure built for queries: a mesh, a jump-point graph or portals; None before that,
        and with presets that build none or, as the overlay does, one that changes with the
        costs."""
        return self._cells.prepared

    @cached_property
    def guide(self) -> Guide | None:
        """The source of descriptions for a person; None on a map without rooms."""
        if is_stale(self.topology) or self.topology.pyramid.rooms is None:
            return None
        # Loads modules that plans without rooms do not need.
        from hybridnav.planner.itinerary import Guide  # noqa: PLC0415

        return Guide(self.topology.rooms)

    @property
    def needs_headings(self) -> bool:
        """Whether endpoints are `(x, y, yaw)`, as with OMPL in a space with headings."""
        return self._ompl is not None and self._ompl.ompl.has_heading

    def plan(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        *,
        smooth: Smooth | None = None,
        blocked: Closable | ClosedCells | None = None,
        at: At = "anywhere",
    ) -> PlanResult:
        """Plan a path between two points, or rooms.

        Parameters
        ----------
        start, goal
            `(x, y)` in metres, map frame. The path runs between the centres of their cells, an
            any-angle one between the points; nothing is snapped to free space. On a map with rooms
            also the name of a room or of a named point. With OMPL in a space with headings `(x, y,
            yaw)`, radians counter-clockwise from the x axis, and named endpoints face along the
            path; in other spaces the third number is ignored.
        smooth
            `"line-of-sight"` shortens the path to an any-angle one, by costs without raising them;
            `"arcs"` rounds the bends of such a path by costs too; None as in the preset. Without
            effect for `shortest` and OMPL, whose paths are any-angle ones.
        blocked
            Closures for this query: a `Blocked`, a `Door`, a shapely geometry in metres, or a
            mapping with keys of `Blocked`, such as `{"doors": [39], "rooms": ["kitchen"]}`. If they
            meet the path, the whole map is searched.
        at
            Position in a named room: `"anywhere"`, at the cells that make the cell path shortest,
            or at its `"point"`.

        Returns
        -------
        PlanResult
            A solved result, or one whose status states the reason.

        Raises
        ------
        InvalidValueError
            When a point is not two finite numbers, a name is not known, or a closed item is not on
            the map.
        """
        with self._query():
            return self._plan(start, goal, smooth, blocked, at)

    def _query(self) -> AbstractContextManager[bool]:
        """Return the lock to hold while the costs must stay as they are."""
        if self._begun is not None:
            self._turns.alone(self._complete)
        return self._turns.shared()

    def _plan(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        smooth: Smooth | None,
        blocked: Closable | ClosedCells | None,
        at: At,
    ) -> PlanResult:
        """Plan a path while the costs stay as they are; see `plan`."""
        began = time.perf_counter()
        waypoint = goal
        if isinstance(start, str) or isinstance(goal, str):
            from hybridnav.planner.named import check_names, points_of_waypoints  # noqa: PLC0415 - on demand

            check_names(self.topology, [start, goal])
            blocked = self.closed(blocked)
            start, goal = points_of_waypoints(
                self.topology,
                self.preset.planner,
                [start, goal],
                at=at,
                closed=self.closed_for_all(blocked),
                costs=self.costs,
            )
        headings = None if self._ompl is None else self.needs_headings
        read = partial(read_end, needs_heading=headings)
        poses = read("start", start), read("goal", goal)
        finish = self._finish.checked(smooth, self.preset.planner.smooth)
        result = self._between(poses, finish, self.closed(blocked), began)
        return self._described(result, poses, waypoint)

    def _described(
        self, result: PlanResult, poses: tuple[FloatArray, FloatArray], waypoint: ArrayLike | str
    ) -> PlanResult:
        """Return a result with what its instructions are found from."""
        if result.path is None or not result.solved or self.guide is None:
            return result
        source = self.guide.of(result.path, waypoint, poses[0].tolist())
        return replace(result, instruction_source=source)

    def _between(
        self,
        poses: tuple[FloatArray, FloatArray],
        finish: Smooth,
        closed: ClosedCells | None,
        began: float,
    ) -> PlanResult:
        """Plan between two points, or poses."""
        query = self._query_of(poses, closed)
        if isinstance(query, PlanStatus):
            return self._outcomes.answer(query, poses)
        endpoints, plan = query.points, self._cells.plan(query)
        if plan.cells is None:
            return self._outcomes.no_path(plan, poses, self._cells.metric)
        if self._ompl is not None:
            now, flat = time.perf_counter(), None if closed is None else closed.flat
            found = self._ompl.plan(plan.cells, poses, flat, spent_s=now - began)
            plan.stats.seconds["ompl"] = time.perf_counter() - now
            bound = self._cells.bound(plan, endpoints)
            return self._outcomes.by_ompl(found, plan, poses, bound)
        return self._finish.result(plan, poses, finish, closed)

    def _query_of(
        self, poses: tuple[FloatArray, FloatArray], closed: ClosedCells | None
    ) -> CellQuery | PlanStatus:
        """Return the query between two points, or the status that refuses one of them."""
        endpoints = poses[0][:2], poses[1][:2]
        grid, allowed = self.topology.grid, self.preset.planner.allow_unexplored
        cells = cells_of_endpoints(grid, endpoints, allow_unexplored=allowed)
        if isinstance(cells, PlanStatus):
            return cells
        shut = self.closed_for_all(closed)
        if shut is not None and (refused := shut.refusal(cells, grid.shape)):
            return refused
        return CellQuery(cells, endpoints, closed)

    def draft(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        *,
        blocked: Closable | ClosedCells | None = None,
        at: At = "anywhere",
    ) -> PlanDraft:
        """Plan a path as `plan` does, and make its result only if it is wanted.

        With `shortest` that saves half of the time, for a caller who compares many plans.

        Parameters
        ----------
        start, goal, blocked, at
            As in `plan`.
        """
        named = isinstance(start, str) or isinstance(goal, str)
        with self._query():
            if named or self._ompl is not None or self.preset.planner.coarse != "mesh":
                return PlanDraft.of(self._plan(start, goal, None, blocked, at))
            poses = read_point("start", start), read_point("goal", goal)
            closed = self.closed(blocked)
            query = self._query_of(poses, closed)
            if isinstance(query, PlanStatus):
                return PlanDraft.of(self._outcomes.answer(query, poses))
            finish, outcomes, metric = self._finish, self._outcomes, self._cells.metric

            def result_of(plan: CellPlan) -> PlanResult:
                if plan.cells is None:
                    return outcomes.no_path(plan, poses, metric)
                return self._described(finish.result(plan, poses, "none", closed), poses, goal)

            return draft_on_mesh(cast("OverMesh", self._cells), query, result_of)

    def plan_many(
        self,
        starts: ArrayLike,
        goals: ArrayLike,
        *,
        smooth: Smooth | None = None,
        blocked: Closable | ClosedCells | None = None,
    ) -> PlanBatch:
        """Plan paths between many pairs of points, with the answers of `plan` in arrays.

        All are planned by the costs that hold when the first one is: an `update` in another thread
        waits for the last one.

        Parameters
        ----------
        starts, goals
            `(x, y)` in metres, map frame, shape (n, 2) each; with OMPL in a space with headings
            `(x, y, yaw)`, shape (n, 3).
        smooth, blocked
            As in `plan`.

        Raises
        ------
        InvalidValueError
            When the shapes differ, a coordinate is not finite, or a closed item is not on the map.
        """
        first = read_points("starts", starts, needs_heading=self.needs_headings)
        last = read_points("goals", goals, needs_heading=self.needs_headings)
        if len(first) != len(last):
            raise InvalidValueError(
                f"there are {len(first)} starts and {len(last)} goals, expected as many of both: "
                "give each start its goal"
            )
        with self._query():
            finish = self._finish.checked(smooth, self.preset.planner.smooth)
            closed = self.closed(blocked)
            is_kept = finish == "none" or self._cells.metric == "any-angle"
            at_once = self._cells if self._ompl is None and is_kept else None

            def alone(start: FloatArray, goal: FloatArray) -> PlanResult:
                return self._plan(start, goal, finish, closed, "anywhere")

            return plan_many(self.topology.grid, at_once, (first, last), closed, alone)

    def prepare(self, *, progress: Progress = no_progress) -> None:
        """Build the structures for queries now: mesh and graph of corners, jump-point graph,
        portals, or overlay.

        Structures that exist already are kept; what `update` has made stale is renewed. Threads may
        call this, and plan meanwhile: each structure is built once.

        Parameters
        ----------
        progress
            Called after each step with the number of steps done and of all steps, as for a progress
            bar.
        """
        self._preparing.alone(lambda: self._cells.prepare(progress))

    def update(
        self,
        *,
        costs: CostLayer | None = None,
        grid: OccupancyGrid | None = None,
        topology: TopologicalMap | None = None,
        changed: BaseGeometry | ArrayLike | None = None,
    ) -> None:
        """Plan by other costs, or on a changed map, from now on, exactly and with proofs.

        Queries of other threads that run already finish by what was before; the update waits for
        them, and for `prepare`. An interrupt leaves the planner as it was, or changed.

        With an overlay (`coarse: overlay`, or `portals` with costs) the changed fields get their
        costs at once; searches leave stale tables above these out until `prepare` renews them.
        `shortest`, `octile` and `grid-astar` follow a changed grid alone. Their results have no
        route, and names, places and doors are refused, until an update brings the places of the map
        now. All other presets need these at once.

        Parameters
        ----------
        costs
            The new costs, in place of those given before; those of the preset stay joined with
            them. Closed cells are closed from now on, and open again if they were closed before.
        grid
            The map now, with the shape and the frame of the one before; its classes count.
        topology
            The places of the map now; its grid is taken if no `grid` is given.
        changed
            The area outside of which nothing is read, and nothing has changed: a shapely geometry
            in metres, map frame, whose bounds are taken, or `(x_min, y_min, x_max, y_max)`, or a
            mask, bool (rows, cols); None for the whole map. For a grid it holds the changed
            measurements; the robot's radius is added.

        Raises
        ------
        InvalidValueError
            When nothing is given, the preset cannot plan by costs, costs or grid are those of
            another map, the preset needs places, or the area is not described like that; then
            nothing has changed.

        Examples
        --------
        >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
        >>> layer = hn.CostLayer(np.ones(topology.grid.shape))
        >>> planner = hn.HybridPlanner(topology, preset="grid-astar", costs=layer)
        >>> print(round(planner.plan((0.5, 0.5), (1.5, 0.5)).cost, 3))
        1.0
        >>> slow = hn.CostLayer(np.full(topology.grid.shape, 3.0))
        >>> planner.update(costs=slow, changed=(0.8, 0.0, 1.2, 3.0))
        >>> print(round(planner.plan((0.5, 0.5), (1.5, 0.5)).cost, 3))
        1.8
        """
        before = self.topology.grid
        box = box_of_area(changed, before.frame, before.shape)
        change = change_of(costs, grid, topology, box)
        if change is not None:
            self._preparing.alone(partial(self._follow, change))
        if costs is not None:
            self._preparing.alone(partial(self._update, costs, box))

    def _follow(self, change: MapChange) -> None:
        self._turns.alone(self._complete)
        made = followed(self.topology, self.preset, self._cells, self._costs, change)
        self._begun = partial(self._take_map, *made)
        self._turns.alone(self._complete)

    def _take_map(self, topology: TopologicalMap, cells: CellPlanner, costs: PlannerCosts) -> None:
        self.topology, self._cells, self._costs = topology, cells, costs
        if isinstance(cells, Carried):
            cells.catch_up()
        self._closures = Closures(topology)
        self.__dict__.pop("guide", None)
        self._make_answers()

    def _update(self, costs: CostLayer, box: Box) -> None:
        self._turns.alone(self._complete)
        self._begun = partial(self._take_costs, self._costs.changed(costs, box), box)
        self._turns.alone(self._complete)

    def _complete(self) -> None:
        """Make an update that has begun, also one that was interrupted."""
        if self._begun is not None:
            self._begun()
            self._begun = None

    def _take_costs(self, layer: CostLayer, box: Box) -> None:
        self._costs.layer = layer
        if isinstance(self._cells, Updatable):
            self._cells.update(layer, box)
        else:
            self._cells = cell_planner(self.topology, self.preset.planner, None, layer)
        self._make_answers()

    def close(self) -> None:
        """End the OMPL process of a preset; the next query waits for another one."""
        if self._ompl is not None:
            self._ompl.close()

    def closed(self, blocked: Closable | ClosedCells | None) -> ClosedCells | None:
        """Return the cells of a closure, None for no closure."""
        if blocked is None or isinstance(blocked, ClosedCells):
            return blocked
        return self._closures.of(blocked)

    def closed_for_all(self, closed: ClosedCells | None) -> ClosedCells | None:
        """Return the closed cells of a query with those that the costs close for all queries."""
        return self._finish.with_closed(closed)
