"""Floors of a building, what is known of the costs on them, and the models that keep both."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field

from hybridnav._base.threads import keep_last
from hybridnav._base.trig import hypots
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet.links import Link
from hybridnav.maps import RoomLabels
from hybridnav.models.container import Part, buffers_of
from hybridnav.models.parts import plain
from hybridnav.models.structures import BUILDING, FLOOR
from hybridnav.planning import HybridPlanner, PlanResult
from hybridnav.planning.profile import PROFILES, Profile
from hybridnav.search.found import ClosedCells

ROUNDED = 1.0 - 1e-12
"""Factor on sums and differences of lengths that serve as bounds, because they are rounded."""
_KEPT = 256
"""Number of plans between ends of links that a floor keeps."""
_MOST_FILLED = 128
"""Number of ends on a floor up to which `fill` computes the costs between all: their square counts,
and queries need few of them."""
_MAX_NAME = 80


@dataclass(frozen=True, eq=False)
class Floor:
    """One floor of a building: a map of its own frame, with its planner.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Floor
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> Floor("3", hn.HybridPlanner(topology), elevation_m=7.2).name
    '3'
    """

    name: str
    """Name, unlike those of other floors of the building."""
    planner: HybridPlanner
    """Planner of the map of this floor."""
    elevation_m: float = 0.0
    """Height in metres: it orders the floors of a picture, the highest one on top."""

    def __post_init__(self) -> None:
        """Refuse names that no line can hold, and heights that are not numbers."""
        name = self.name
        if not isinstance(name, str) or not name.strip() or not name.isprintable():
            raise InvalidValueError(f"a floor needs a name of one printable line, got {name!r:.80}")
        if len(name) > _MAX_NAME:
            raise InvalidValueError(
                f"the name of a floor has at most {_MAX_NAME} characters, got {name!r:.80}"
            )
        if not math.isfinite(self.elevation_m):
            raise InvalidValueError(
                f"floor {name}: elevation_m is {self.elevation_m}, expected a finite number"
            )

    @property
    def rooms(self) -> RoomLabels | None:
        """The rooms of its map; None without rooms, or while its places are stale."""
        return self.planner.pyramid_rooms


class Known(NamedTuple):
    """What is known of the plans between the ends of links on a floor."""

    lower: FloatArray
    """float64 (n, n), proved lower bounds in metres, from each end to each other one."""
    cost: FloatArray
    """float64 (n, n), the costs of plans in metres, NaN where none was made, infinite where there
    is no path."""


class FloorTable:
    """Costs and bounds between the ends of links on a floor, filled in as plans are made.

    It belongs to the map and the costs that its floor's planner had when it was made; after an
    update of the planner it is not `current` any more.

    `positions_m`: float64 (n, 2), the ends of links on it, `(x, y)` in metres; `known`: costs and
    bounds that were computed before, of the same map; None for none; `closed`: cells that are
    closed for all plans between the ends; None for none.
    """

    def __init__(
        self,
        floor: Floor,
        positions_m: FloatArray,
        known: Known | None = None,
        *,
        closed: ClosedCells | None = None,
    ) -> None:
        self.floor, self.closed = floor, closed
        self.positions_m = positions_m
        self._positions: list[tuple[float, float]] = positions_m.tolist()
        planner = floor.planner
        self._of = planner.grid, planner.costs
        is_any_angle = planner.method.metric == "any-angle"
        self._slack_m = 0.0 if is_any_angle else math.sqrt(2) * planner.grid.resolution_m
        """Metres by which a path between two points may be shorter than the line between them:
        paths of cells lead from centre to centre."""
        n = len(positions_m)
        if known is None:
            across = positions_m[:, None] - positions_m[None]
            straight = self._safe(hypots(across[..., 0], across[..., 1]))
            known = Known(straight, np.full((n, n), np.nan))
        self.lower: FloatArray = known.lower.copy()
        """float64 (n, n), proved lower bounds, as in `Known`."""
        self.cost: FloatArray = known.cost.copy()
        """float64 (n, n), the costs of plans."""
        self.expected: FloatArray = np.where(np.isnan(self.cost), self.lower, self.cost)
        """float64 (n, n), the costs where they are known, else the bounds."""
        self._results: dict[tuple[int, int], PlanResult] = {}

    def __getstate__(self) -> dict[str, Any]:
        """Return the state without kept plans, which are made anew."""
        return vars(self) | {"_results": {}}

    @property
    def known(self) -> Known:
        """What is known now, in arrays."""
        return Known(self.lower.copy(), self.cost.copy())

    @property
    def is_current(self) -> bool:
        """Whether the planner still has the map and the costs of the table."""
        planner = self.floor.planner
        return planner.grid is self._of[0] and planner.costs is self._of[1]

    @property
    def is_directed(self) -> bool:
        """Whether a way back may cost more: something is passed in one direction only."""
        closed = self.floor.planner.closed(self.closed)
        return closed is not None and closed.one_way is not None

    def renewed(self) -> FloorTable:
        """Return the table itself while it is current, else an empty one of the map now."""
        return self if self.is_current else FloorTable(self.floor, self.positions_m)

    def closing(self, closed: ClosedCells | None) -> FloorTable:
        """Return an empty table of plans for which some cells are closed."""
        return FloorTable(self.floor, self.positions_m, closed=closed)

    def between(self, start: int, goal: int) -> tuple[PlanResult, bool]:
        """Return the plan from one end of a link to another one, and whether it was kept."""
        kept = self._results.get((start, goal))
        if kept is not None:
            return kept, True
        result = self.floor.planner.plan(
            self.positions_m[start], self.positions_m[goal], blocked=self.closed
        )
        self._learn(start, goal, result.cost, result.lower_bound)
        return keep_last(self._results, (start, goal), result, _KEPT), False

    def fill(self) -> None:
        """Compute all costs that are not known yet, if the ends are at most 128."""
        if len(self.cost) > _MOST_FILLED:
            return
        is_missing = np.isnan(self.cost) & ~np.eye(len(self.cost), dtype=np.bool_)
        missing = np.argwhere(is_missing)
        if len(missing):
            plans = self.floor.planner.plan_many(*self.positions_m[missing.T], blocked=self.closed)
            source, costs = plans.lower_bound_source, plans.cost.tolist()
            # Bounds that take a search of their own are left to the pairs of a route.
            bounds = np.zeros(len(costs)) if callable(source) else source
            for (start, goal), cost, bound in zip(missing.tolist(), costs, bounds, strict=True):
                self._learn(start, goal, cost, bound)

    def _learn(self, start: int, goal: int, cost: float, bound: float) -> None:
        """Take over the cost and the bound of a plan between two ends.

        Without one-way rules the optimum is the same in both directions: planners with headings
        make no floors.
        """
        for pair in ((start, goal), (goal, start))[: 1 if self.is_directed else 2]:
            self.lower[pair] = max(self.lower[pair], bound)
            if math.isnan(self.cost[pair]):
                self.expected[pair] = self.lower[pair]
        self.cost[start, goal] = self.expected[start, goal] = cost

    def straight_m(self, waypoint: ArrayLike | str) -> FloatArray:
        """Return lower bounds on the costs between a waypoint and each end, float64 (n,), metres.

        `waypoint`: a point `(x, y)` in metres, or a name of the floor.
        """
        return self._safe(self._distance_m(waypoint, self.positions_m))

    def straight_between_m(self, start: ArrayLike | str, goal: ArrayLike | str) -> float:
        """Return a lower bound on the cost between two waypoints in metres; 0 if both are names."""
        if isinstance(start, str):
            start, goal = goal, start
        if isinstance(start, str):
            return 0.0
        point = np.asarray(start, dtype=np.float64)[None, :2]
        return float(self._safe(self._distance_m(goal, point))[0])

    def _safe(self, straight_m: FloatArray) -> FloatArray:
        """Return lengths of straight lines as lower bounds on costs."""
        return np.maximum(straight_m - self._slack_m, 0.0) * ROUNDED

    def _distance_m(self, waypoint: ArrayLike | str, positions_m: FloatArray) -> FloatArray:
        """Return the distances of points from a waypoint, from the box round a named one."""
        if not isinstance(waypoint, str):
            away = positions_m - np.asarray(waypoint, dtype=np.float64)[:2]
            return hypots(away[:, 0], away[:, 1])
        grid = self.floor.planner.grid
        at = grid.frame.positions_of(positions_m)
        low, high = self._box_of(waypoint)
        away = np.maximum(np.maximum(low - at, at - high), 0.0)
        return hypots(away[:, 0], away[:, 1]) * grid.resolution_m

    def _box_of(self, name: str) -> tuple[FloatArray, FloatArray]:
        """Return the least and the greatest row and column of a named waypoint, with a margin."""
        rooms = self.floor.rooms
        assert rooms is not None  # noqa: S101 - names have been checked
        corners = []
        if name in rooms.points:
            frame = self.floor.planner.grid.frame
            corners.append(frame.positions_of(np.array([rooms.points[name]])))
        box = self._boxes[rooms.index(name)] if name in rooms.names else None
        if box is not None:
            corners.append(np.array([[part.start for part in box], [part.stop for part in box]]))
        both = np.concatenate(corners)
        return both.min(axis=0) - 1.0, both.max(axis=0) + 1.0

    @cached_property
    def _boxes(self) -> Sequence[tuple[slice, ...] | None]:
        """The rows and columns of each room."""
        from scipy import ndimage  # noqa: PLC0415 - a plan on one map needs none

        rooms = self.floor.rooms
        assert rooms is not None  # noqa: S101 - names have been checked
        return ndimage.find_objects(rooms.label_of + 1, max_label=len(rooms.names))


# Models: the models of the maps in one file, with links and known costs.

_MOST_MAPS = 99
"""Most different maps of a building in a file."""


class _Values(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _FloorValues(_Values):
    name: str
    elevation_m: float
    map: Annotated[int, Field(ge=0, lt=_MOST_MAPS)]


class BuildingValues(_Values):
    """A building, as a model states it."""

    speed_m_s: float
    floors: Annotated[list[_FloorValues], Field(min_length=1, max_length=10_000)]
    links: Annotated[list[Link], Field(max_length=10_000)]
    profiles: Annotated[list[Profile], Field(max_length=1000)] = []


def building_parts(  # noqa: PLR0913 - a building, taken apart
    floors: Sequence[Floor],
    links: Sequence[Link],
    known: Sequence[Known],
    facts: Mapping[str, Any],
    parts_of: Callable[[HybridPlanner], Iterable[Part]],
    *,
    compress: bool,
) -> list[Part]:
    """Describe a building; planners that several floors share are described once.

    `floors`, `links`, `known`: of the building; what is known of the costs between links, floor by
    floor; `facts`: its `speed_m_s` and its `profiles`; `parts_of`: returns the parts of the model
    of a planner; `compress`: whether the arrays of its maps are deflated. Raises
    `InvalidValueError` when it has too many maps.
    """
    planners = list({id(floor.planner): floor.planner for floor in floors}.values())
    if len(planners) > _MOST_MAPS:
        raise InvalidValueError(
            f"a model holds a building of at most {_MOST_MAPS} maps, this one has {len(planners)}"
        )
    values: dict[str, Any] = {
        "speed_m_s": facts["speed_m_s"],
        "floors": [
            {
                "name": floor.name,
                "elevation_m": floor.elevation_m,
                "map": next(i for i, one in enumerate(planners) if one is floor.planner),
            }
            for floor in floors
        ],
        "links": [plain(asdict(link)) for link in links],
    }
    profiles = [plain(asdict(one)) for one in facts["profiles"] if one not in PROFILES]
    if profiles:  # models without are read by earlier versions too
        values["profiles"] = profiles
    written = [
        # A model has no costs of cells, and what is known by them does not hold without.
        one if floor.planner.costs is None else Known(np.zeros_like(one.lower), one.cost * np.nan)
        for floor, one in zip(floors, known, strict=True)
    ]
    arrays = {
        name: np.concatenate([getattr(one, name).ravel() for one in written])
        for name in ("lower", "cost")
    }
    parts = [BUILDING.part(arrays, {"pairs": len(arrays["lower"])}, values)]
    for planner in planners:
        content = np.frombuffer(
            b"".join(buffers_of(parts_of(planner), compress=compress)), dtype=np.uint8
        )
        parts.append(FLOOR.part({"model": content}, {"bytes": len(content)}))
    return parts
