"""The hybrid planner: paths between points by a preset, with their routes. Public: `under`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from copy import copy
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from hybridnav._base.copies import copies_alike
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.threads import Turns
from hybridnav._base.typing import PathLike
from hybridnav.errors import InvalidValueError, renamed
from hybridnav.maps import OccupancyGrid, RoomLabels
from hybridnav.maps.areas import box_of_area
from hybridnav.maps.costs import CostLayer
from hybridnav.planning import PlanBatch, PlanResult, PlanStatus, Preset, load_preset
from hybridnav.planning.costs import PlannerCosts
from hybridnav.planning.endpoints import directed, read_points
from hybridnav.planning.follow import PlannerUpdate, begun, opened, update_of
from hybridnav.planning.methods import make_method
from hybridnav.planning.methods.grid import KnownMap
from hybridnav.planning.planning import Planning
from hybridnav.planning.preset import check_radius
from hybridnav.planning.questions import Questions, Unanswered
from hybridnav.planning.result import plan_many
from hybridnav.planning.settings import OmplPlannerSettings, Smooth
from hybridnav.search.found import ClosedCells, Method
from hybridnav.topology import TopologicalMap
from hybridnav.topology.map import Version, no_places

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from hybridnav.closures.blocked import Closable
    from hybridnav.closures.one_way import OneWayLike
    from hybridnav.planning.named import At
    from hybridnav.planning.private_rooms import Privacy
    from hybridnav.planning.profile import Profile


@copies_alike
class HybridPlanner(Questions):
    """Planner of paths between points of one map by a preset.

    Threads may share a planner; queries with OMPL run one after the other. The structures of a
    preset are built at the first query, or by `prepare`; with OMPL they are built at once, so that
    no query's time includes them. On large maps a thread builds what only speed needs: the one of
    several paths of equal length may be another after that.

    Parameters
    ----------
    topology
        The topological map with its grid. It may have been built with other settings than the
        preset's `pyramid` section: results record the actual ones. Or the grid alone: then results
        have no route, and names, places and doors are refused.
    preset
        Name of a preset, path to a preset file, or a `Preset`.
    prepared
        `prepared` of another planner of the same map and preset, to use; None to build anew.
    costs
        A factor for each cell, by which a metre in it costs more, joined with the costs that the
        preset names. The path is the cheapest one, and its result has the metric `weighted`. Only
        for methods `cheapest`, `grid-astar` and `paper`.

    Raises
    ------
    PresetError
        When the preset does not exist or is not valid, or names a refiner that cannot be used.
    InvalidValueError
        When the map has the default radius, not chosen by the caller, and the preset names another.
        When the preset needs places, and a grid alone is given.
        When the costs are those of another map, or the preset cannot plan by costs. When the map
        allows corner cutting, and the preset plans on the mesh (`shortest`, `ompl`).

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
        topology: TopologicalMap | OccupancyGrid,
        *,
        preset: PathLike | Preset = "shortest",
        prepared: object | None = None,
        costs: CostLayer | None = None,
    ) -> None:
        self.preset = load_preset(preset)
        built = topology if isinstance(topology, TopologicalMap) else None
        grid = topology if isinstance(topology, OccupancyGrid) else topology.grid
        settings = self.preset.planner
        check_radius(grid, self.preset)
        if built is None and settings.underlying.needs_places:
            raise InvalidValueError(
                f"preset {self.preset.name} plans on the places of its map, and only a grid is "
                "given: build its topological map, or take preset shortest"
            )
        by = PlannerCosts.of(grid, self.preset, costs)
        known = KnownMap(grid, built, by.layer, prepared)
        method, ompl = make_method(known, settings), None
        if isinstance(settings, OmplPlannerSettings):
            # Loads modules for these presets only, or reports which one to install.
            from hybridnav.planning.methods.ompl import ompl_planner  # noqa: PLC0415

            ompl = ompl_planner(known, method, settings)
        self._now = Planning(self.preset, grid, built, method, by, ompl)
        self._turns, self._preparing = Turns(), Turns()
        self._profiled: dict[Profile, tuple[Planning, HybridPlanner]] = {}
        self._privacy: Privacy | None = None
        self._begun: Callable[[], Planning] | None = None
        """The update that has begun and not ended; an interrupt leaves it here."""

    @property
    def grid(self) -> OccupancyGrid:
        """The map now."""
        return self._now.grid

    @property
    def topology(self) -> TopologicalMap:
        """The places of the map now.

        Raises
        ------
        InvalidValueError
            When the planner was made of a grid alone, or the map changed, by an `update` with a
            grid alone, after its places were built.
        """
        topology = self._now.topology
        return no_places() if topology is None else topology

    @property
    def pyramid_rooms(self) -> RoomLabels | None:
        """The rooms of the map; None without rooms, or while its places are not built."""
        own = self._now.topology
        return None if own is None else own.room_labels

    @property
    def costs(self) -> CostLayer | None:
        """The costs that it plans by, None for lengths."""
        return self._now.costs.layer

    @property
    def method(self) -> Method:
        """The search that its preset names, on the map now."""
        return self._now.method

    def profiled(self, profile: Profile | str) -> HybridPlanner:
        """Return a planner of the same map under a profile; see `hybridnav.under`."""
        from hybridnav.planning.private_rooms import Privacy  # noqa: PLC0415 - rare
        from hybridnav.planning.profile import ProfiledFloor, profile_of, under_profile  # noqa: PLC0415

        chosen, now = profile_of(profile), self._now
        kept = self._profiled.get(chosen)
        if kept is None or kept[0] is not now:
            own, given = self.topology, self.given_costs
            by_costs, made = chosen.by_costs(own.rooms.labels), copy(self)
            found = under_profile(own, self.preset, given, chosen, by_costs=by_costs)
            if (found[0], found[2]) != (own, given):
                made = HybridPlanner(found[0], preset=found[1], costs=found[2])
            floor = ProfiledFloor.of(found[0], chosen, found[1].planner)
            made._privacy, made._profiled = Privacy(chosen, [floor], whole=self), {}
            kept = self._profiled[chosen] = now, made
        return kept[1]

    def under(self, profile: Profile | str) -> HybridPlanner:
        """Return `hybridnav.under(planner, profile)`: write that."""
        renamed("HybridPlanner.under(...)", "hybridnav.under(planner, ...)")
        return self.profiled(profile)

    def _closing(
        self, waypoints: Sequence[ArrayLike | str], blocked: Closable | ClosedCells | None
    ) -> Closable | ClosedCells | None:
        """Return what is closed for a query, with the private rooms of the profile."""
        own = self._privacy
        return blocked if own is None else own.closed(self._now, waypoints, blocked)

    @property
    def prepared(self) -> object | None:
        """The structure built for queries: a mesh or a jump-point graph. None before that, with
        presets that build none, and for the lattice, which changes with the costs."""
        return self._now.method.prepared

    @property
    def needs_headings(self) -> bool:
        """Whether endpoints must be `(x, y, yaw)`, as with OMPL in a space with headings."""
        return self._now.needs_headings

    def plan(  # noqa: PLR0913 - all but two have defaults
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        *,
        smooth: Smooth | None = None,
        blocked: Closable | ClosedCells | None = None,
        one_way: OneWayLike | None = None,
        at: At = "anywhere",
        keep: PlanResult | None = None,
        within_m: float | None = None,
        leave_zone: bool = False,
    ) -> PlanResult:
        """Plan a path between two points, or rooms.

        Parameters
        ----------
        start, goal
            `(x, y)` in metres, map frame. The path runs between the centres of their cells, an
            any-angle one between the points; nothing is snapped to free space. On a map with rooms
            also the name of a room or of a named point. Or `(x, y, yaw)`, radians counter-clockwise
            from the x axis. The robot turns on the spot: at the start from its yaw into the path,
            at the goal to that of the goal. OMPL in a space with headings needs the yaw, and plans
            with it; there named endpoints face along the path.
        smooth
            `"line-of-sight"` shortens the path to an any-angle one, by costs without raising them.
            `"arcs"`, for planners by costs, rounds the bends of such a path too. None as in the
            preset. `"line-of-sight"` has no effect with `shortest` and OMPL, whose paths are
            any-angle ones.
        blocked
            Closures for this query: a `Blocked`, a `Door`, a shapely geometry in metres, or a
            mapping with keys of `Blocked`, such as `{"doors": [39], "rooms": ["kitchen"]}`. If they
            meet the path, the whole map is searched.
        one_way
            What may be crossed in one direction only in this query: a `OneWay`, a line, or a
            mapping with keys of `OneWay`, such as `{"doors": [(5, "hall")]}`. The rules of the
            rooms of the map hold for every query.
        at
            Position in a named room: `"anywhere"`, at the cells that make the cell path shortest,
            or at its `"point"`.
        keep
            With methods `cheapest`, `shortest` and `octile`: an earlier result, on whose path the
            robot stays. From `start` beside it, its rest is returned, while no cell of it is closed
            and it costs little more than a new path: 2 %, or `keep_within` of `cheapest`. For
            another goal nothing is kept.
        within_m
            Where the goal cannot be reached, plan to the nearest point that can be, if it lies at
            most so many metres from the goal, by the crow. The status is then `near the goal`,
            `short_m` is the distance, and cost and bound are those of that point. Not with OMPL.
        leave_zone
            Whether a start that `blocked` or the costs close may leave the closed cells by the
            shortest way. The cells of that way are open for this plan, cost and bound are those
            with them open, and `leaves_m` is the length of the way. Not with OMPL, nor `within_m`.

        Returns
        -------
        PlanResult
            A solved result, or one whose status states the reason.

        Raises
        ------
        InvalidValueError
            When a point is not two or three finite numbers, a name is not known, or a closed item
            is not on the map. When `smooth` is `"arcs"` and the planner plans by lengths, or
            another method is given `keep`. When `leave_zone` is given with OMPL or `within_m`.
        """
        blocked = directed(blocked, one_way)
        with self._query():
            now, own = self._now, self._privacy
            closed = self._closing([start, goal], blocked)
            if smooth is not None:
                now = now.finishing(smooth)
            query, leaves_m = now.read(start, goal, closed, at, keep), None
            if leave_zone:
                query, leaves_m, cells = now.leaving(query, within_m)
                now = opened(now, cells) if cells else now
            result = now.plan(query)
            if leaves_m is not None:
                closed, result = query.closed, replace(result, leaves_m=leaves_m)
            if within_m is not None:
                result = now.near(query, result, within_m)
        if result.path is None or result.status is PlanStatus.NEAR_GOAL:
            ends = result.start, result.goal
            result = replace(result, explanation_source=Unanswered(now, ends, closed))
        return result if own is None else own.stated(result, (start, goal), blocked)

    def _query(self) -> AbstractContextManager[bool]:
        """Return the lock to hold while the map and the costs must stay as they are."""
        if self._begun is not None:
            self._turns.alone(self._complete)
        return self._turns.shared()

    def plan_many(
        self,
        starts: ArrayLike,
        goals: ArrayLike,
        *,
        smooth: Smooth | None = None,
        blocked: Closable | ClosedCells | None = None,
        one_way: OneWayLike | None = None,
    ) -> PlanBatch:
        """Plan paths between many pairs of points, with the answers of `plan` in arrays.

        All are planned by the costs that hold when the first one is: an `update` in another thread
        waits for the last one.

        Parameters
        ----------
        starts, goals
            `(x, y)` in metres, map frame, shape (n, 2) each, or `(x, y, yaw)`, shape (n, 3). OMPL
            in a space with headings needs the yaw; with others it changes no point of a path, and
            arrays of points do not hold it.
        smooth, blocked, one_way
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
        blocked = directed(blocked, one_way)
        if self._privacy is not None:  # each has private rooms of its own
            alone = partial(self.plan, smooth=smooth, blocked=blocked)
            return plan_many(self.grid, None, (first, last), None, alone)
        with self._query():
            return self._now.plan_many((first, last), smooth, blocked)

    def prepare(self, *, progress: Progress = no_progress) -> None:
        """Build all structures, each once, and renew stale ones; threads may plan meanwhile.

        Parameters
        ----------
        progress
            Called after each step with the number of steps done and of all steps.
        """
        self._preparing.alone(lambda: self._now.method.prepare(progress))

    def update(
        self,
        *,
        costs: CostLayer | None = None,
        grid: OccupancyGrid | Version | None = None,
        topology: TopologicalMap | None = None,
        changed: BaseGeometry | ArrayLike | None = None,
    ) -> None:
        """Plan by other costs, or on a changed map, from now on, exactly and with proofs.

        Queries of other threads that run already finish by the state before; the update waits for
        them, and for `prepare`. An interrupt leaves the planner as it was, or changed.

        `shortest`, `octile`, `grid-astar` and `robot` follow a changed grid alone. Their results
        have no route, and names, places and doors are refused, until an update brings the places of
        the map now. All other presets need these at once. `paper` takes them from the version of an
        `OnlinePyramid`. What it packed of the version before is repaired where the map changed.
        Then its plans are those of a planner made anew. Costs that were given stay with
        their cells on a changed map; costs that the preset computes from it are computed anew.

        Parameters
        ----------
        costs
            The new costs, in place of those given before; those of the preset stay joined with
            them. Closed cells are closed from now on, and open again if they were closed before.
        grid
            The map now, with the shape and the frame of the one before; its classes count. Or a
            version of an `OnlinePyramid`, which has the places too; they are made when read.
        topology
            The places of the map now; its grid is taken if no `grid` is given.
        changed
            The area of all changes. It is a shapely geometry in metres, map frame, whose bounds are
            taken, or `(x_min, y_min, x_max, y_max)`, or a mask, bool (rows, cols). None for the
            whole map. Costs outside of it stay as they were. For a grid it holds the changed
            measurements; the robot's radius is added.

        Raises
        ------
        InvalidValueError
            When nothing is given, the preset cannot plan by costs, or it needs places. When costs
            or grid are those of another map, cells of the grid changed outside the area, or the
            area is not described like that. Then nothing has changed.

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
        before = self.grid
        box = box_of_area(changed, before.frame, before.shape)
        update = update_of(costs, grid, topology, box)
        self._preparing.alone(partial(self._update, update))

    def _update(self, update: PlannerUpdate) -> None:
        """Check all of an update, then make it."""
        self._turns.alone(self._complete)
        if self._privacy is not None:
            raise InvalidValueError("a planner under a profile follows its own: update that one")
        self._begun = begun(self._now, update)
        self._turns.alone(self._complete)

    def _complete(self) -> None:
        """Make an update that has begun, also one that was interrupted."""
        if self._begun is not None:
            self._now = self._begun()
            self._begun = None

    def close(self) -> None:
        """End the OMPL process of a preset; the next query waits for another one."""
        if self._now.ompl is not None:
            self._now.ompl.close()

    def closed(
        self,
        blocked: Closable | ClosedCells | None,
        waypoints: Sequence[ArrayLike | str] | None = None,
    ) -> ClosedCells | None:
        """Return the cells of a closure and, with waypoints, of the profile; None for none."""
        return self._now.closed(self._closing(waypoints, blocked) if waypoints else blocked)

    def points_of(
        self,
        waypoints: Sequence[ArrayLike | str],
        *,
        at: At = "anywhere",
        blocked: Closable | ClosedCells | None = None,
    ) -> list[ArrayLike]:
        """Return a point for each waypoint, so that the path through all of them is cheapest."""
        return self._now.points_of(waypoints, at, self._closing(waypoints, blocked))

    def closed_for_all(self, closed: ClosedCells | None) -> ClosedCells | None:
        """Return closed cells with cells that the costs close for all queries."""
        return self._now.costs.closing(closed)


def under(planner: HybridPlanner, profile: Profile | str) -> HybridPlanner:
    """Return a planner of the same map under a profile, also for tours and alternatives.

    Results are proved for its problem. It is made once, and again after an `update`.

    Parameters
    ----------
    planner
        A planner on a map with rooms.
    profile
        A `Profile`, or the name of one of `PROFILES`: visitor, staff, wheelchair, cart.

    Returns
    -------
    HybridPlanner
        A planner of its own; `update` is for the one without the profile.

    Raises
    ------
    InvalidValueError
        When there is none of the name, or the map has no rooms.

    Examples
    --------
    >>> grid, uses = hn.example_map("figure1"), {"ward": hn.RoomUse(private=True)}
    >>> rooms = hn.RoomLabels(("hall", "ward"), np.indices(grid.shape)[1] // 20, uses=uses)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    >>> visitor = hn.under(hn.HybridPlanner(topology), "visitor")
    >>> print(visitor.plan("hall", "ward").status)
    solved
    """
    return planner.profiled(profile)
