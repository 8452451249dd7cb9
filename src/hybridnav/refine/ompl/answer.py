"""The answer to one query: corridor after corridor, until a path is found or time is up.

A winding corridor is a chain of small problems, field by field along the coarse path.

OMPL's bindings let no Python code draw the states of tree planners, and most states in the box
round a winding corridor lie outside the corridor. The box round one field holds few others.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable

import numpy as np

from hybridnav._base.moves import path_length_in_cells
from hybridnav._base.trig import atan2, cos, hypot, hypots, lengths_along, sin
from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.refine.ompl.attempts import Attempts, Simplifier, objective_of
from hybridnav.refine.ompl.client import OmplQuery, Reply
from hybridnav.refine.ompl.problem import Base, Box, SearchArea, bounds_of, search_area_of
from hybridnav.refine.ompl.solve import IMPROVING, Problem, StateSpace, solve

_WINDING, _SLACK_CELLS = 1.2, 4
"""A leg is cut in two if its path of cells is longer than this times the straight line plus so many
cells."""
_SHORT_CELLS = 8
"""Most cells of a bent leg that a disc walks from centre to centre: in a maze with passages one
cell wide every bend is such a leg, and batch planners take a millisecond each."""
_TRIES = 10
"""Iterations for each cell of a leg before it is cut in two."""
_LONGER = 1.05
"""A leg that is longer than this times its path of cells has taken another door."""
_LEG = 0.5
"""Part of its share of the time that a leg may take before it is cut in two."""
_WINDOW = 0.02
"""Share of the time left for one window; there are fewer windows if that is too short."""
_LEAST_WINDOWS = 4
_ROUNDS_WITHOUT_GAIN = 2
_LEAST_GAIN = 2e-4


def attempt(attempts: Attempts, corridor: SearchArea, whole: StateSpace, *, part: float) -> bool:
    """Solve leg after leg, join and simplify them, and improve windows of the path; return success.

    `whole`: state space of the whole corridor; `part`: share of the time left that the legs may
    take. Returns whether there is a path.
    """
    points = _legs(attempts, corridor, whole, part=part)
    if points is None:
        return False
    points = attempts.finish(whole, points)
    if attempts.settings.planner in IMPROVING:
        _improve(attempts, corridor, whole, points)
    return True


def _legs(
    attempts: Attempts, corridor: SearchArea, whole: StateSpace, *, part: float
) -> FloatArray | None:
    """Return the legs, solved and joined; None if one has no path."""
    cells = attempts.query.cells
    poses = Poses(attempts.query, corridor, whole)
    joints = [index for index in _joints(attempts, cells) if poses.at(index) is not None]
    waiting = list(itertools.pairwise(joints))[::-1]
    joined = [attempts.query.start[None]]
    latest_s = (1 - part) * attempts.budget.left()
    while waiting:
        first, last = waiting.pop()
        share = _LEG / (len(waiting) + 1)
        found = _leg(attempts, corridor, cells[first : last + 1], poses.pair(first, last), share)
        middle = (first + last) // 2
        if found is not None:
            joined.append(found[1:])
        elif (
            last - first > 1 and poses.at(middle) is not None and attempts.budget.left() > latest_s
        ):
            waiting += [(middle, last), (first, middle)]
        else:
            attempts.partial(np.concatenate(joined))
            return None
    # Turns to the headings at which legs meet are left out.
    points = whole.driven(np.concatenate(joined))
    return points if len(points) else None


def _joints(attempts: Attempts, cells: LongArray) -> list[int]:
    """Return the indices of the cells at which the path of cells is cut into legs.

    These are its endpoints, the crossings from one field to the next, and points in between until
    no leg winds.
    """
    last = len(cells) - 1
    field_of = attempts.setup.field_of
    crossings: list[int] = []
    if field_of is not None:
        fields = field_of[cells[:, 0], cells[:, 1]]
        crossings = (np.flatnonzero(np.diff(fields)) + 1).tolist()
    waiting = list(itertools.pairwise(sorted({0, *crossings, last})))[::-1]
    joints = [0]
    at = lengths_along(cells)
    while waiting:
        first, end = waiting.pop()
        straight = hypot(*(cells[end] - cells[first]))
        if at[end] - at[first] > _WINDING * straight + _SLACK_CELLS:
            middle = (first + end) // 2
            waiting += [(middle, end), (first, middle)]
        else:
            joints.append(end)
    return joints


def _leg(
    attempts: Attempts,
    corridor: SearchArea,
    cells: LongArray,
    endpoints: tuple[FloatArray, FloatArray],
    share: float,
) -> FloatArray | None:
    """Return a path between two near states, float64 (n, 3), or None.

    The result is None if every path found is much longer than the path of cells.
    """
    flat, straight = not attempts.settings.has_heading, np.stack(endpoints)
    if flat and corridor.check.path_valid(straight[:, :2]):
        return straight
    if flat and len(cells) <= _SHORT_CELLS:
        return None
    space = attempts.space(corridor, *_bounds(corridor, cells))
    turns_and_drives = attempts.settings.space == "differential"
    if turns_and_drives and len(direct := space.driven(straight)):
        return direct
    objective = objective_of(space)
    most = _TRIES * len(cells) if flat or turns_and_drives else None
    found = solve(
        Problem(space, *endpoints, objective),
        attempts.settings,
        attempts.budget.stopper(share, most=most),
        search=attempts.search,
    )
    if not found.is_exact or not flat:
        return found.points if found.is_exact else None
    points = Simplifier(space).shorter(found.points)
    limit_m = _LONGER * path_length_in_cells(cells) * corridor.grid.resolution_m
    return points if space.length(points) <= limit_m else None


_MARGIN_CELLS = 8


def _bounds(corridor: SearchArea, cells: LongArray) -> tuple[FloatArray, FloatArray]:
    """Return the bounds round some cells with a margin, inside those of the corridor."""
    low, high = cells.min(axis=0), cells.max(axis=0) + 1
    margin = _MARGIN_CELLS + int((high - low).max()) // 4
    box: Box = (
        max(int(low[0]) - margin, corridor.box[0]),
        min(int(high[0]) + margin, corridor.box[1]),
        max(int(low[1]) - margin, corridor.box[2]),
        min(int(high[1]) + margin, corridor.box[3]),
    )
    return bounds_of(corridor.grid, box)


def _improve(
    attempts: Attempts, corridor: SearchArea, whole: StateSpace, points: FloatArray
) -> None:
    """Plan windows of the path again, each in the ellipse that can shorten it."""
    budget = attempts.budget
    cost_of = whole.length
    cost, fruitless, window = cost_of(points), 0, _LEAST_WINDOWS
    while fruitless < _ROUNDS_WITHOUT_GAIN and budget.left() > 0 and len(points) > 2:  # noqa: PLR2004
        before = cost
        for number in range(2 * window - 1):
            along = number / (2 * window), (number + 2) / (2 * window)
            points = _window(attempts, corridor, whole, points, along)
            if budget.left() <= 0:
                break
        cost = cost_of(points)
        attempts.better(points, cost)
        fruitless = 0 if cost < before * (1 - _LEAST_GAIN) else fruitless + 1
        window = max(window // 2, 1) if fruitless else window


def _window(
    attempts: Attempts,
    corridor: SearchArea,
    whole: StateSpace,
    points: FloatArray,
    along: tuple[float, float],
) -> FloatArray:
    """Return the path with a part of it searched again; `along` are shares of its length."""
    first, last = _between(points, along)
    if last - first < 2:  # noqa: PLR2004 - one motion
        return points
    cost_of, inner = whole.length, points[first : last + 1]
    cost, least = cost_of(inner), whole.length(inner[[0, -1]])
    if cost <= least * (1 + _LEAST_GAIN):
        return points
    space = attempts.space(corridor, *_ellipse(corridor, inner, cost))
    objective = objective_of(space)
    problem = Problem(space, inner[0], inner[-1], objective, least * (1 + _LEAST_GAIN))
    found = solve(problem, attempts.settings, attempts.budget.stopper(_WINDOW))
    if not found.is_exact or cost_of(found.points) >= cost:
        return points
    joined = whole.driven(np.concatenate([points[:first], found.points, points[last + 1 :]]))
    return joined if len(joined) else points


def _between(points: FloatArray, along: tuple[float, float]) -> tuple[int, int]:
    """Return the indices of the states just before and after a part of a path's length."""
    at = lengths_along(points[:, :2])
    first = int(np.searchsorted(at, along[0] * at[-1], side="right")) - 1
    last = int(np.searchsorted(at, along[1] * at[-1]))
    return max(first, 0), min(last, len(points) - 1)


def _ellipse(corridor: SearchArea, inner: FloatArray, cost: float) -> tuple[FloatArray, FloatArray]:
    """Return the bounds of the ellipse of paths up to a cost between the endpoints of a part.

    They lie inside the bounds of the corridor (J. Gammell and others: Informed RRT*, 2014).
    """
    offset = (inner[-1] - inner[0])[:2]
    straight = float(hypots(*offset))
    across = math.sqrt(max(cost * cost - straight * straight, 0.0)) / 2
    direction = offset / straight if straight > 0 else np.array([1.0, 0.0])
    half = np.sqrt((cost / 2 * direction) ** 2 + (across * direction[::-1]) ** 2)
    middle = (inner[0] + inner[-1])[:2] / 2
    low, high = corridor.bounds
    return np.maximum(middle - half, low), np.minimum(middle + half, high)


# States of the robot along a path of cells, where the legs of a chain meet.

_AHEAD_M = 1.0
"""Distance before and behind a cell over which the direction of the path is taken."""
_TURNS = tuple(math.radians(degrees) for degrees in (0, 15, -15, 30, -30, 60, -60, 90, -90))
_ASIDE_CELLS = (0, 2, -2, 4, -4, 8, -8)


class Poses:
    """Valid states at cells of a path.

    The endpoints are those of the query. The others head along the path, turned or moved aside if
    that is not valid.

    `query`: OmplQuery with the path of cells; `corridor`: corridor that states must lie in;
    `whole`: state space of the corridor.
    """

    def __init__(self, query: OmplQuery, corridor: SearchArea, whole: StateSpace) -> None:
        self._check = corridor.check
        self._has_heading = whole.dimension > 2  # noqa: PLR2004
        self._resolution_m = corridor.grid.resolution_m
        self._centres = corridor.grid.frame.points_of(query.cells)
        last = len(query.cells) - 1
        self._known: dict[int, FloatArray | None] = {last: query.goal}
        self._known[0] = query.start

    def at(self, index: int) -> FloatArray | None:
        """Return the state at a cell of the path, float64 (3,); None if no state near it is
        valid."""
        if index not in self._known:
            self._known[index] = self._found(index)
        return self._known[index]

    def pair(self, first: int, last: int) -> tuple[FloatArray, FloatArray]:
        """Return the states at two cells that have valid ones."""
        one, other = self.at(first), self.at(last)
        assert one is not None  # noqa: S101 - the caller has looked
        assert other is not None  # noqa: S101
        return one, other

    def _found(self, index: int) -> FloatArray | None:
        x, y = self._centres[index].tolist()
        if not self._has_heading:
            return np.array([x, y, 0.0])
        steps = max(int(_AHEAD_M / self._resolution_m), 1)
        ahead = self._centres[min(index + steps, len(self._centres) - 1)]
        ahead = ahead - self._centres[max(index - steps, 0)]
        heading = atan2(ahead[1], ahead[0])
        for aside in _ASIDE_CELLS:
            offset_m = aside * self._resolution_m
            at_x, at_y = x - offset_m * sin(heading), y + offset_m * cos(heading)
            for turn in _TURNS:
                if self._check.state_valid(at_x, at_y, heading + turn):
                    return np.array([at_x, at_y, math.remainder(heading + turn, math.tau)])
        return None


_FIRST = 0.7
"""Share of the time left in which a corridor other than the last must yield a path."""
_CHAIN = 0.5
"""Share of that for a chain of poses, before the corridor is searched as one problem."""
_SEARCHED = 0.9
"""Share of the time left for improving planners if the path is simplified afterwards."""
_ENOUGH = 1 + 1e-4
"""A path that is no longer than this times the lower bound needs no improvement."""


def answer(base: Base, query: OmplQuery, send: Callable[[Reply], None]) -> Reply:
    """Try the corridors of a query in turn and return the last reply.

    `base`: the map, and the worker's tables of it; `send`: called with each better path.
    """
    attempts = Attempts(base, query, send)
    last = len(query.corridors) - 1
    for number, (name, fields) in enumerate(query.corridors):
        corridor = search_area_of(base, query, fields)
        _attempt(attempts, corridor, part=1.0 if number == last else _FIRST)
        if not attempts.leave(name):
            break
    return attempts.last_reply()


def _attempt(attempts: Attempts, corridor: SearchArea, *, part: float) -> None:
    whole, query, settings = attempts.enter(corridor), attempts.query, attempts.settings
    if np.array_equal(query.start, query.goal):
        attempts.better(query.start[None], 0.0)
        return
    has_legs = corridor.inside is not None and len(query.cells) > 1
    if settings.confine == "chain" and has_legs:
        # Legs between poses may be too short for a turning circle or a long robot.
        first_part = part * _CHAIN if settings.has_heading else part
        if attempt(attempts, corridor, whole, part=first_part) or not settings.has_heading:
            return
    _at_once(attempts, whole, part=part)


def _at_once(attempts: Attempts, whole: StateSpace, *, part: float) -> None:
    """Solve the whole corridor as one problem."""
    settings = attempts.settings
    improves = settings.planner in IMPROVING
    problem = Problem(
        whole,
        attempts.query.start,
        attempts.query.goal,
        objective_of(whole),
        _ENOUGH * attempts.bound_m if improves else math.inf,
    )
    share = part * (_SEARCHED if improves and settings.simplify else 1.0)
    found = solve(
        problem,
        settings,
        attempts.budget.stopper(share),
        on_path=lambda points: attempts.better(points, whole.length(points)),
        search=attempts.search,
    )
    if found.is_exact:
        attempts.finish(whole, found.points)
    else:
        attempts.partial(found.points)
