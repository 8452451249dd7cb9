"""Reasons: why there is no path, what would have to change, and where a path is tightest. Public:
`Explanation` and `explain`.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.trig import dist
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.closures import Blocked
from hybridnav.closures.blocked import Closable, as_blocked
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.widest import Bottleneck, WidestPaths
from hybridnav.planning import HybridPlanner, PlanStatus
from hybridnav.planning.endpoints import places_of_endpoints
from hybridnav.planning.planning import Planning
from hybridnav.pyramid import LevelArc
from hybridnav.reasons.fewest import OpenGround, fewest_to_open
from hybridnav.reasons.why_words import BlockedEnd, Closure, TightPlace, sentences
from hybridnav.rooms import Door
from hybridnav.search.directed import DirectedSides
from hybridnav.search.found import ClosedCells
from hybridnav.topology import TopologicalMap


@dataclass(frozen=True, eq=False)
class Explanation:
    """Why a robot can or cannot go from a start to a goal; see `HybridPlanner.explain`.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> why = hn.explain(
    ...     hn.HybridPlanner(topology), (0.5, 0.5), (2.0, 2.5), radius_m=0.6
    ... )
    >>> why.has_path, why.widest_m
    (False, 0.4)
    """

    radius_m: float
    """The radius asked about."""
    blocked_ends: tuple[BlockedEnd, ...]
    """The ends that the robot cannot stand on."""
    closed: Bottleneck
    opened: Bottleneck
    """The bottleneck with nothing closed."""
    tight: TightPlace | None
    """Where the widest path is tightest: with the closures, or, if they leave no path at any
    radius, without. None without a path."""
    to_open: tuple[Closure, ...]
    """The fewest closures that have to open for a path of this radius; none if there is one, or if
    opening does not help."""
    through_unexplored: bool
    """Whether there is a path of this radius, with the closures, that enters unexplored cells."""
    reached_m2: tuple[float, float]
    """Square metres that can be reached from the start, and from the goal."""
    unfit_end: str = ""
    """`start` or `goal`, where the planner's footprint does not fit with the heading there."""
    cut: FloatArray | None = field(default=None, repr=False)
    """float64 (n, 2), `(x, y)` in metres, map frame: a closed chain of cells that cannot be
    entered, each beside the next one. It goes round one of the ends; beyond the map it is its rim.
    None where the ends are joined, an end is blocked, or corners may be cut."""
    against: tuple[Closure, ...] = ()
    """Where directions alone part the ends: what may only be crossed the other way. It leads out of
    all that is reached from the start, or into all from which the goal is reached."""
    parts_start: bool = False
    """Whether those are the ways away from the start, else the ways to the goal."""

    @property
    def has_path(self) -> bool:
        """Whether there is a path of this radius, with the closures."""
        is_wide = self.radius_m < self.closed.radius_m
        return is_wide and not self.blocked_ends and not self.against

    @property
    def widest_m(self) -> float:
        """The radius below which every disc has a path, with the closures, metres; 0 for none."""
        return self.closed.radius_m

    @property
    def reason(self) -> str:
        """The reason in one line, in English."""
        return " ".join(self.words())

    def words(self, language: str = "en") -> list[str]:
        """Return the reason in sentences, and what would have to change.

        Parameters
        ----------
        language
            A code: `en` or `de`.

        Raises
        ------
        InvalidValueError
            When there are no words in the language.
        """
        return sentences(self, language)

    def to_dict(self) -> dict[str, Any]:
        """Return the explanation with plain values, for JSON."""
        tight = self.tight
        return {
            "has_path": self.has_path,
            "reason": self.reason,
            "radius_m": self.radius_m,
            "widest_m": self.widest_m if math.isfinite(self.widest_m) else None,
            "widest_opened_m": self.opened.radius_m
            if math.isfinite(self.opened.radius_m)
            else None,
            "tight": None if tight is None else list(tight.point),
            "door": None if tight is None or tight.door is None else tight.door.number,
            "to_open": [list(one) for one in self.to_open],
            "against": [list(one) for one in self.against],
            "through_unexplored": self.through_unexplored,
            "reached_m2": list(self.reached_m2),
        }


@dataclass(frozen=True, eq=False)
class Case:
    """A query to explain: a map, its ends, and what is closed."""

    grid: OccupancyGrid
    """The map, with the radius asked about."""
    topology: TopologicalMap | None
    """Its places; None if they are not built."""
    points: tuple[FloatArray, FloatArray]
    blocked: Blocked | ClosedCells | None
    costs: ClosedCells | None
    """What the planner's costs close."""
    allow_unexplored: bool
    one_way: DirectedSides | None = None
    """Sides that may be crossed in one direction only."""

    def explained(self) -> Explanation:
        """Find the explanation."""
        ends = self._blocked_ends()
        closed = opened = Bottleneck(0.0, None)
        unexplored = False
        to_open: tuple[Closure, ...] = ()
        if not any("outside" in end.status for end in ends):
            opened = self._widest().between(*self._cells)
            closed = self._widest(self._shut).between(*self._cells) if self._closures else opened
            if not ends and closed.radius_m <= self.grid.robot_radius_m:
                if self.grid.robot_radius_m < opened.radius_m:
                    ground = OpenGround(self._enterable, self.grid.corner_cutting)
                    to_open = fewest_to_open(ground, self._closures, self._cells)
                unexplored = not self.allow_unexplored and self._is_joined(
                    self.grid.enterable(allow_unexplored=True) & ~self._shut
                )
        against: tuple[tuple[Closure, ...], bool] = (), False
        if not ends and self.one_way is not None and closed.radius_m > self.grid.robot_radius_m:
            against = self._against(self.one_way)
        at = closed.cell or opened.cell
        return Explanation(
            radius_m=self.grid.robot_radius_m,
            blocked_ends=ends,
            closed=closed,
            opened=opened,
            tight=None if at is None else self._place(at),
            to_open=to_open,
            through_unexplored=unexplored,
            reached_m2=self._reached_m2(),
            cut=None if ends else self._cut(),
            against=against[0],
            parts_start=against[1],
        )

    def _against(self, one_way: DirectedSides) -> tuple[tuple[Closure, ...], bool]:
        """Return what has a direction that parts the ends, and whether it is round the start."""
        from hybridnav.search.proofs import parting_sides  # noqa: PLC0415 - loads kernels

        parting = parting_sides(self._open, one_way, self._cells)
        return ((), False) if parting is None else (tuple(map(_directed, parting[0])), parting[1])

    def _cut(self) -> FloatArray | None:
        """Return the chain of walls that parts the two ends."""
        from hybridnav.search.proofs import parting_chain  # noqa: PLC0415 - loads kernels

        if self.grid.corner_cutting:
            return None
        chain = parting_chain(self._open, *self._cells)
        return None if chain is None else self.grid.frame.points_of(chain)

    # What is closed: cells and moves, and by what.

    @cached_property
    def _cells(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """The cells of the ends, which may lie outside the map."""
        one, other = (self.grid.frame.cell_of(*point.tolist()) for point in self.points)
        return one, other

    @cached_property
    def _enterable(self) -> BoolArray:
        return self.grid.enterable(allow_unexplored=self.allow_unexplored)

    @cached_property
    def _open(self) -> BoolArray:
        """The cells that may be entered and are not closed."""
        return self._enterable & ~self._shut

    @cached_property
    def _closures(self) -> dict[Closure, LongArray]:
        """What each closure closes: flat cells, or moves between two where it is a boundary."""
        closures = {} if self.costs is None else {Closure("costs", None): self.costs.flat}
        if isinstance(self.blocked, Blocked):
            closures |= {
                closure: self._closed_by(one) for closure, one in each_closure(self.blocked)
            }
        elif self.blocked is not None:
            closures[Closure("cells", None)] = self.blocked.flat
        return closures

    def _closed_by(self, one: Blocked) -> LongArray:
        """Return the cells that one closure closes; of a boundary the moves across it."""
        if self.topology is None or self.grid.corner_cutting or not (one.doors or one.arcs):
            return one.cells_on(self.grid, self.topology)
        if one.doors:
            return self.topology.rooms.moves_through(_number_of(one.doors[0]))
        arc, topology = one.arcs[0], self.topology
        if not isinstance(arc, LevelArc):
            index = int(np.searchsorted(topology.arc_ids, arc))
            arc = LevelArc(topology.pyramid.place_level, index)
        pairs = topology.pyramid[arc.level].boundary(arc.index)
        return pairs @ np.array([self.grid.shape[1], 1])

    @cached_property
    def _shut(self) -> BoolArray:
        """All cells that are closed, as bool.

        They are closed for this robot as its planner closes them. For smaller robots also those in
        closed doors are that the planner spares, since this one cannot enter them.
        """
        shut = np.zeros(self.grid.shape, np.bool_)
        for cells in self._closures.values():
            if cells.ndim == 1:
                shut.ravel()[cells] = True
        if isinstance(self.blocked, Blocked):
            shut.ravel()[self.blocked.cells_on(self.grid, self.topology)] = True
        if self.topology is not None:
            able = self.topology.grid.enterable(allow_unexplored=self.allow_unexplored).ravel()
            for cells in self._closures.values():
                shut.ravel()[cells[~able[cells]]] = True
        return shut

    # The ends.

    def _blocked_ends(self) -> tuple[BlockedEnd, ...]:
        """Return the ends that the robot cannot stand on, the start first."""
        blocked = []
        for is_start, point, cell in zip((True, False), self.points, self._cells, strict=True):
            pose, allowed = tuple(point.tolist()), self.allow_unexplored
            *_, status = places_of_endpoints(self.grid, (pose, pose), allow_unexplored=allowed)
            by: tuple[Closure, ...] = ()
            if status is None:
                if not self._shut[cell]:
                    continue
                flat = cell[0] * self.grid.shape[1] + cell[1]
                by = tuple(one for one, cells in self._closures.items() if flat in cells)
                status = PlanStatus.START_BLOCKED
            name = status.value.split(" ", 1)[1]
            status = PlanStatus(f"{'start' if is_start else 'goal'} {name}")
            end = BlockedEnd(is_start, status, self._clear(cell), by, *self._nearest(point))
            blocked.append(end)
        return tuple(blocked)

    def _clear(self, cell: tuple[int, int]) -> float:
        """Return the distance from a cell to the nearest occupied one, 0 outside the map."""
        rows, cols = self.grid.shape
        if not (0 <= cell[0] < rows and 0 <= cell[1] < cols):
            return 0.0
        occupied = np.argwhere(self.grid.measured == CellClass.OCCUPIED)
        if not len(occupied):
            return math.inf
        squared = ((occupied - cell) ** 2).sum(axis=1).min()
        return math.sqrt(squared) * self.grid.resolution_m

    def _nearest(self, point: FloatArray) -> tuple[tuple[float, float] | None, float]:
        """Return the centre of the nearest cell that the robot can stand on, and how far it is."""
        cells = np.argwhere(self._open)
        if not len(cells):
            return None, math.inf
        at = self.grid.frame.position_of(*point[:2].tolist())
        apart = ((cells + 0.5 - at) ** 2).sum(axis=1)
        x, y = self.grid.frame.points_of(cells[apart.argmin()]).tolist()
        return (x, y), math.sqrt(apart.min()) * self.grid.resolution_m

    # Widths, and what can be reached.

    def _widest(self, shut: BoolArray | None = None) -> WidestPaths:
        return WidestPaths(self.grid, closed=shut, allow_unexplored=self.allow_unexplored)

    def _place(self, cell: tuple[int, int]) -> TightPlace:
        """Return a cell as a point, with the door whose boundary its free disc meets."""
        x, y = self.grid.frame.points_of(cell).tolist()
        topology = self.topology
        if topology is None or not topology.has_rooms:
            return TightPlace((x, y))
        reach_m = self._clear(cell)
        best: tuple[float, Door | None] = (reach_m / self.grid.resolution_m, None)
        for door in topology.rooms.doors:
            if dist(door.position, (x, y)) > door.width_m + reach_m:
                continue
            beside = topology.rooms.cells_beside(door.number)
            cells = np.stack(divmod(beside, self.grid.shape[1]), axis=1)
            apart = math.sqrt(((cells - cell) ** 2).sum(axis=1).min())
            if apart < best[0]:
                best = apart, door
        return TightPlace((x, y), best[1])

    def _regions(self, cells: BoolArray) -> IntArray:
        """Label the connected sets of cells from 1, by the moves of planners."""
        from scipy import ndimage  # noqa: PLC0415 - half a second that plans do not need

        structure = np.ones((3, 3)) if self.grid.corner_cutting else None
        labels, _ = ndimage.label(cells, structure)
        return labels.astype(np.int32, copy=False)

    def _is_joined(self, cells: BoolArray) -> bool:
        labels = self._regions(cells)
        one, other = self._cells
        return bool(labels[one] == labels[other] != 0)

    def _reached_m2(self) -> tuple[float, float]:
        labels = self._regions(self._open)
        areas = np.bincount(labels.ravel())
        areas[0] = 0
        rows, cols = self.grid.shape
        one, other = (
            float(areas[labels[cell]]) * self.grid.cell_area_m2
            if 0 <= cell[0] < rows and 0 <= cell[1] < cols
            else 0.0
            for cell in self._cells
        )
        return one, other


def each_closure(blocked: Blocked) -> Iterator[tuple[Closure, Blocked]]:
    """Yield each closure with a `Blocked` of it alone."""
    for one in fields(blocked):
        items = getattr(blocked, one.name)
        if one.name == "one_way":
            continue  # it closes no cells
        if one.name == "cells":
            if len(items):
                yield Closure("cells", None), Blocked(cells=items)
            continue
        if one.name == "named":
            yield from ((Closure("named", name), closure) for name, closure in items.items())
            continue
        for k, item in enumerate(items):
            is_area = one.name in {"polygons", "keepout"}
            which = k if is_area else _number_of(item) if one.name == "doors" else item
            alone: Any = {one.name: (item,)}
            yield Closure(one.name, which), Blocked(**alone)


def _directed(name: str) -> Closure:
    """Return what `DirectedSides` calls `door 5`, `line 1` or by another name."""
    kind, _, number = name.partition(" ")
    if kind in {"door", "opening", "arc", "line"} and number.isdecimal():
        return Closure(f"{kind}s", int(number))
    return Closure("sides", None) if name == "sides" else Closure("named", name)


def _number_of(door: int | Door) -> int:
    return door.number if isinstance(door, Door) else door


def explain(
    planner: HybridPlanner,
    start: ArrayLike | str,
    goal: ArrayLike | str,
    *,
    blocked: Closable | ClosedCells | None = None,
    radius_m: float | None = None,
) -> Explanation:
    """Explain why there is a path between two points or none, and what would have to change.

    It finds the widest path, the fewest closures to open, and whether unexplored cells could
    help: exactly, for a disc on the cells of the map. Dropped islands count as free.

    Parameters
    ----------
    planner
        The planner, whose map, preset and costs count.
    start, goal, blocked
        As in `HybridPlanner.plan`; a room stands for its point.
    radius_m
        The robot's radius in metres, >= 0; None for the map's.

    Raises
    ------
    InvalidValueError
        As in `HybridPlanner.plan`, and when the radius is no number >= 0.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> planner = hn.HybridPlanner(topology)
    >>> print(hn.explain(planner, (0.5, 0.5), (-2.0, 2.5)).words("de")[0])
    Das Ziel liegt außerhalb der Karte.
    """
    return planner.asked(start, goal, blocked)(radius_m)


def reasons_of(
    now: Planning,
    ends: Any,
    blocked: Closable | ClosedCells | None,
    *,
    radius_m: float | None = None,
) -> Explanation:
    """Explain a query from and to `ends`, `(x, y)` or `(x, y, yaw)`, metres, map frame; see
    `explain`."""
    grid = now.grid if radius_m is None else replace(now.grid, robot_radius_m=radius_m)
    if blocked is not None and not isinstance(blocked, ClosedCells):
        blocked = as_blocked(blocked)
    closed = now.closed(blocked)
    unfit = None
    if now.ompl is not None and radius_m is None:
        query = now.read(ends[0], ends[1], blocked, "point")
        start, goal = map(np.array, query.poses)
        unfit = now.ompl.refused((start, goal), query.closed)
    case = Case(
        grid=grid,
        topology=now.topology,
        points=(np.asarray(ends[0])[:2], np.asarray(ends[1])[:2]),
        blocked=blocked,
        costs=now.costs.closed,
        allow_unexplored=now.preset.planner.allow_unexplored,
        one_way=None if closed is None else closed.one_way,
    )
    return replace(case.explained(), unfit_end="" if unfit is None else unfit.split()[0])


def explain_solved(
    planner: HybridPlanner,
    points: Sequence[Any],
    waypoints: Sequence[Any],
    **how: Any,
) -> Explanation:
    """Explain how wide a path that is there can be; `how`: as of `explain`.

    A path to a named room ends beside the jambs of its door, where little fits: the widest to its
    own point may be wider, and the wider one of both is told. `points`: the ends of the path;
    `waypoints`: those that were given, points or names.
    """
    explanations = [explain(planner, *points, **how)]
    if any(isinstance(one, str) for one in waypoints):
        ends = [
            one if isinstance(one, str) else point
            for one, point in zip(waypoints, points, strict=True)
        ]
        explanations.append(explain(planner, *ends, **how))
    return max(explanations, key=lambda one: one.widest_m)
