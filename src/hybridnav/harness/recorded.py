"""Recorded paths judged against the proved optimum between their own ends, and their detours."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.trig import hypots, lengths_along
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import Clearance, Contact, clearance_of, contacts_of
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.checks import checked_points
from hybridnav.maps.costs import cost_along
from hybridnav.planning import HybridPlanner, PlanResult

_LEAST_SHARE, _LEAST_M = 0.02, 0.01
"""Share of its length, and metres, that a part of a path loses at least to be listed."""
_PARTS = 200
"""Pieces in which losses are looked for."""


@dataclass(frozen=True)
class Detour:
    """A part of a path on which it loses: each metre of loss belongs to one part.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.zeros((4, 9)), robot_radius_m=0)
    >>> points = [(0.5, 0.5), (3.5, 0.5), (3.5, 2.5), (3.5, 0.5), (8.5, 0.5)]
    >>> (there_and_back,) = hn.judge(grid, points).detours
    >>> round(there_and_back.loss_m, 6)
    4.0
    """

    from_m: float
    """Metres along the path at which it begins."""
    to_m: float
    """Metres along the path at which it ends."""
    loss_m: float
    """Metres of this part that bring the path no nearer to its end."""
    start: tuple[float, float]
    """Where it begins, `(x, y)` in metres, map frame."""
    end: tuple[float, float]
    """Where it ends."""


@dataclass(frozen=True, eq=False)
class JudgedPath:
    """Verdict on one recorded path.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.zeros((4, 8)), robot_radius_m=0)
    >>> judged = hn.judge(grid, [(0.5, 0.5), (3.5, 3.5), (6.5, 0.5)])
    >>> judged.legal, round(judged.length_m, 3), judged.optimum_m, round(judged.loss, 3)
    (True, 8.485, (6.0, 6.0), 0.414)
    """

    points: FloatArray
    """float64 (n, 2), `(x, y)` in metres, map frame."""
    legal: bool | None
    """Whether a disc of the robot's radius drives it without a contact; None if two maps were given
    and it is between them."""
    contacts: tuple[Contact, ...]
    """Every piece outside the free space, in order."""
    length_m: float
    """Length of the line through its points, metres."""
    optimum: PlanResult
    """A shortest path between its ends; without one its `status` and `reason` state why."""
    optimum_m: tuple[float, float]
    """Proved bounds on the length of a shortest path between its ends: none is shorter than the
    first, and one is as long as the second, metres. Both infinite where there is none."""
    clearance: Clearance
    """Distances to occupied cells."""
    turning_rad: float
    """Sum of the changes of its direction, radians, of points half a cell apart and more."""
    max_curvature_per_m: float
    """Largest change of direction of a metre, 1 / m, at these points."""
    duration_s: float | None
    """Seconds from its first to its last point; None without times, as the next ones."""
    mean_speed_m_s: float | None
    """Length by duration, m / s."""
    max_speed_m_s: float | None
    """Largest speed between two points, m / s."""
    cost: float | None
    """Its cost by the costs that were given, metres; None without, and off the map."""
    least_cost: tuple[float, float] | None
    """Proved bounds on the least cost between its ends, as `optimum_m`."""
    planner: HybridPlanner

    @property
    def loss(self) -> float:
        """Length / length of the optimal path - 1, at least this is lost; below 0 for a path that
        takes a way that is none. NaN without an optimum, and for one that ends where it begins."""
        return _loss(self.length_m, self.optimum_m[1])

    @property
    def loss_at_most(self) -> float:
        """Length / proved lower bound - 1: `loss`, unless two maps were given."""
        return _loss(self.length_m, self.optimum_m[0])

    @property
    def cost_loss(self) -> float:
        """Cost / proved least cost - 1; NaN without costs."""
        if self.cost is None or self.least_cost is None:
            return math.nan
        return _loss(self.cost, self.least_cost[0])

    @cached_property
    def detours(self) -> tuple[Detour, ...]:
        """The parts of the path that lose most, the worst first; found when they are read first.

        From any of its points the path could go on by the shortest way. What the rest would save
        by that grows along the path by what is lost: it is found at 200 places. Parts outside the
        free space, from where there is no way, are left out.
        """
        along = lengths_along(self.points)
        if not math.isfinite(self.optimum_m[1]) or self.length_m <= 0:
            return ()
        at = np.linspace(0.0, along[-1], _PARTS + 1)
        places = np.stack([np.interp(at, along, axis) for axis in self.points.T], axis=1)
        places[[0, -1]] = self.points[[0, -1]]
        goal = np.broadcast_to(self.points[-1], places.shape)
        left = self.planner.plan_many(places, np.array(goal)).cost
        known = np.flatnonzero(np.isfinite(left))
        at, left, places = at[known], left[known], places[known]
        lost = np.diff(at) + np.diff(left)
        loses = lost > _LEAST_SHARE * np.diff(at)
        edges = np.flatnonzero(np.diff(np.concatenate([[False], loses, [False]]).astype(np.int8)))
        detours = []
        for low, high in edges.reshape(-1, 2).tolist():
            loss_m = float(lost[low:high].sum())
            if loss_m >= max(_LEAST_M, _LEAST_SHARE * self.optimum_m[1]):
                ends = (tuple(places[k].tolist()) for k in (low, high))
                detours.append(Detour(float(at[low]), float(at[high]), loss_m, *ends))
        return tuple(sorted(detours, key=lambda part: -part.loss_m))

    def part(self, from_m: float, to_m: float) -> FloatArray:
        """Return the points of a part of the path, float64 (k, 2).

        Parameters
        ----------
        from_m, to_m
            Metres along the path.
        """
        along = lengths_along(self.points)
        inner = along[(along > from_m) & (along < to_m)]
        at = np.concatenate([[from_m], inner, [to_m]])
        return np.stack([np.interp(at, along, axis) for axis in self.points.T], axis=1)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for strict JSON; infinite or missing values are None."""
        low, high = map(_finite, self.optimum_m)
        stated = self.clearance
        return {
            "legal": self.legal,
            "contacts": [vars(each) | {"depth_m": _finite(each.depth_m)} for each in self.contacts],
            "length_m": self.length_m,
            "status": str(self.optimum.status),
            "optimum_low_m": low,
            "optimum_high_m": high,
            "loss": _finite(self.loss),
            "loss_at_most": _finite(self.loss_at_most),
            "clearance": {name: _finite(value) for name, value in vars(stated).items()},
            "turning_rad": self.turning_rad,
            "max_curvature_per_m": self.max_curvature_per_m,
            "duration_s": self.duration_s,
            "mean_speed_m_s": self.mean_speed_m_s,
            "max_speed_m_s": self.max_speed_m_s,
            "cost": self.cost,
            "least_cost": None if self.least_cost is None else list(map(_finite, self.least_cost)),
            "cost_loss": _finite(self.cost_loss),
            "detours": [vars(each) for each in self.detours],
        }


def _loss(value: float, least: float) -> float:
    return value / least - 1 if 0 < least < math.inf else math.nan


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def judge(  # noqa: PLR0913 - all but two have defaults
    grid: OccupancyGrid | HybridPlanner,
    points: ArrayLike,
    *,
    times_s: ArrayLike | None = None,
    costs: HybridPlanner | None = None,
    inner: OccupancyGrid | HybridPlanner | None = None,
    limit_m: float | None = None,
) -> JudgedPath:
    """Judge a recorded path of a disc: whether it is legal, and how far above the optimum.

    Parameters
    ----------
    grid
        The map, or a planner of it by preset `shortest`, which many paths may share; it states too
        whether unexplored cells may be entered.
    points
        The path, `(x, y)` in metres, map frame, shape (n, 2), n >= 1, finite.
    times_s
        Seconds at the points, (n,), ascending; None without times.
    costs
        A planner by costs, such as of preset `robot`, for the cost of the path and the least one.
    inner
        A second map on which only cells are blocked that are so for certain, or a planner of it.
        It yields the lower bound of the optimum, where `grid`, whose free cells are so for certain,
        yields the path that is that short. See `optimum_m` and `legal`.
    limit_m
        Limit of the share of the path with less clearance, metres; None for the robot's radius.

    Raises
    ------
    InvalidValueError
        When the points or times are not as described, a planner is not of that kind, or the map
        allows corner cutting.

    Examples
    --------
    >>> grid = hn.example_map("figure1")
    >>> judged = hn.judge(grid, [(0.5, 0.5), (0.5, 2.5), (2.0, 2.5)])
    >>> judged.legal, round(judged.length_m, 3), round(judged.loss, 3)
    (True, 3.5, 0.375)
    """
    planner = _by_length("grid", grid)
    xy = checked_points(points).copy()
    xy.flags.writeable = False
    map_, allowed = planner.grid, planner.preset.planner.allow_unexplored
    optimum = planner.plan(xy[0], xy[-1])
    contacts = contacts_of(map_, xy, allow_unexplored=allowed)
    legal: bool | None = not contacts
    low = optimum.lower_bound
    if inner is not None:
        certain = _by_length("inner", inner)
        low = certain.plan(xy[0], xy[-1]).lower_bound
        is_out = contacts_of(certain.grid, xy, allow_unexplored=allowed) if contacts else ()
        legal = None if contacts and not is_out else legal
    along = lengths_along(xy)
    turning, curvature = _turns(xy, map_.resolution_m / 2)
    cost, least = (None, None) if costs is None else _costs(costs, xy)
    return JudgedPath(
        xy,
        legal,
        contacts,
        math.fsum(np.diff(along).tolist()),
        optimum,
        (min(low, optimum.cost), optimum.cost),
        clearance_of(map_, xy, limit_m=map_.robot_radius_m if limit_m is None else limit_m),
        turning,
        curvature,
        *_timed(times_s, along),
        cost,
        least,
        planner,
    )


def _by_length(name: str, given: OccupancyGrid | HybridPlanner) -> HybridPlanner:
    """Return a planner of shortest paths, and refuse others."""
    planner = HybridPlanner(given) if isinstance(given, OccupancyGrid) else given
    if not isinstance(planner, HybridPlanner) or planner.method.metric != "any-angle":
        raise InvalidValueError(
            f"{name} is {given!r:.60}, expected a map or a planner of shortest paths: give an "
            "OccupancyGrid, or HybridPlanner(grid, preset='shortest')"
        )
    return planner


def _costs(costs: HybridPlanner, xy: FloatArray) -> tuple[float | None, tuple[float, float]]:
    """Return the cost of a path, and the bounds on the least one."""
    if costs.costs is None:
        raise InvalidValueError(
            f"costs is a planner of preset {costs.preset.name}, which has none: take one by costs, "
            "such as preset robot"
        )
    optimum = costs.plan(xy[0], xy[-1])
    cells, shape = costs.grid.frame.positions_of(xy), costs.grid.shape
    is_on = bool(((cells >= 0) & (cells <= shape)).all())
    cost = cost_along(costs.grid, costs.costs, xy) if is_on else None
    return cost, (optimum.lower_bound, optimum.cost)


def _timed(
    times_s: ArrayLike | None, along: FloatArray
) -> tuple[float | None, float | None, float | None]:
    """Return the duration of a path, its mean and its largest speed."""
    if times_s is None:
        return None, None, None
    times = np.asarray(times_s, dtype=np.float64)
    if times.shape != along.shape or not np.isfinite(times).all() or (np.diff(times) < 0).any():
        raise InvalidValueError(
            f"times_s has the shape {times.shape} or descends, expected {len(along)} ascending "
            "seconds: sort the points by time, or leave the times out"
        )
    steps, lengths = np.diff(times), np.diff(along)
    moves, duration = steps > 0, float(times[-1] - times[0])
    mean = float(along[-1]) / duration if duration > 0 else None
    most = float((lengths[moves] / steps[moves]).max()) if moves.any() else None
    return duration, mean, most


def _turns(xy: FloatArray, spacing_m: float) -> tuple[float, float]:
    """Return the sum of the turns of a line, radians, and the largest of a metre, 1 / m.

    What a standing robot measures is no turn: points less than the spacing from the last one are
    left out.
    """
    kept, last = [0], xy[0].tolist()
    for k, (x, y) in enumerate(xy.tolist()):
        if max(abs(x - last[0]), abs(y - last[1])) >= spacing_m:
            kept.append(k)
            last = [x, y]
    steps = np.diff(xy[kept], axis=0)
    # numpy's own: no answer hangs on its last bit, and 10,000 points take 1 ms, not 30.
    first, second = steps[:-1], steps[1:]
    across = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    turns = np.abs(np.arctan2(across, (first * second).sum(axis=1)))
    lengths = hypots(steps[:, 0], steps[:, 1])
    rates = turns / ((lengths[1:] + lengths[:-1]) / 2)
    return float(turns.sum()), float(rates.max(initial=0.0))
