"""A corridor as a chain of small problems, field by field along the coarse path.

OMPL's bindings let no Python code draw the states of tree planners, and of the box round a winding
corridor most states lie outside it. The box round one field holds little else.
"""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.refine.ompl.corridor import bounds_of
from hybridnav.refine.ompl.planners import IMPROVING, Problem, solve

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, LongArray
    from hybridnav.refine.ompl.answer import Answering
    from hybridnav.refine.ompl.corridor import Box, Corridor
    from hybridnav.refine.ompl.spaces import StateSpace

_LEG = 0.5
"""Part of its share of the time that a leg may take before it is cut in two."""
_WINDOW = 0.02
"""Part of the time that is left for one window; windows are fewer where that is too short."""
_LEAST_WINDOWS = 4
_ROUNDS_WITHOUT_GAIN = 2
_LEAST_GAIN = 2e-4


def attempt(answering: Answering, corridor: Corridor, whole: StateSpace, *, part: float) -> None:
    """Solve leg after leg, join them, simplify, and improve windows of the path.

    Parameters
    ----------
    answering
        The query.
    corridor
        Where it may search.
    whole
        State space of the whole corridor.
    part
        How much of what is left the legs may take.
    """
    points = _legs(answering, corridor, part=part)
    if points is None:
        return
    points = answering.finish(whole, points)
    if answering.settings.planner in IMPROVING:
        _improve(answering, corridor, points)


def _legs(answering: Answering, corridor: Corridor, *, part: float) -> FloatArray | None:
    """The legs, solved and joined; None where one has no path."""
    cells = answering.query.cells
    stops = _stops(answering, cells)
    waiting = list(itertools.pairwise(stops))[::-1]
    joined = [answering.query.start[None]]
    while waiting:
        first, last = waiting.pop()
        ends = _pose(answering, first), _pose(answering, last)
        share = part * _LEG / (len(waiting) + 1)
        found = _leg(answering, corridor, cells[first : last + 1], ends, share)
        if found is not None:
            joined.append(found[1:])
        elif last - first > 1 and answering.budget.left() > 0:
            middle = (first + last) // 2
            waiting += [(middle, last), (first, middle)]
        else:
            answering.partial(np.concatenate(joined))
            return None
    return np.concatenate(joined)


def _stops(answering: Answering, cells: LongArray) -> list[int]:
    """Where the path of cells goes over from one field to the next, and its ends."""
    last = len(cells) - 1
    field_of = answering.setup.field_of
    if field_of is None:
        return [0, last]
    fields = field_of[cells[:, 0], cells[:, 1]]
    return sorted({0, *(np.flatnonzero(np.diff(fields)) + 1).tolist(), last})


def _pose(answering: Answering, index: int) -> FloatArray:
    """The state at a cell of the path; the ends are those of the query."""
    query = answering.query
    last = len(query.cells) - 1
    if index in {0, last}:
        return query.start if index == 0 else query.goal
    centre = answering.setup.grid.frame.points_of(query.cells[index])
    return np.array([*centre, 0.0])


def _leg(
    answering: Answering,
    corridor: Corridor,
    cells: LongArray,
    ends: tuple[FloatArray, FloatArray],
    share: float,
) -> FloatArray | None:
    """A path between two states near each other, float64 (n, 3)."""
    (x0, y0, _), (x1, y1, _) = ends
    if corridor.check.motion_valid(x0, y0, x1, y1):
        return np.stack(ends)
    space = answering.space(corridor, *_bounds(corridor, cells))
    found = solve(
        Problem(space, *ends, answering.objective.of(space)),
        answering.settings,
        answering.budget.stopper(share),
        search=answering.search,
    )
    return found.points if found.is_exact else None


_MARGIN_CELLS = 8


def _bounds(corridor: Corridor, cells: LongArray) -> tuple[FloatArray, FloatArray]:
    """Bounds round some cells with a margin, inside the corridor's."""
    low, high = cells.min(axis=0), cells.max(axis=0) + 1
    margin = _MARGIN_CELLS + int((high - low).max()) // 4
    box: Box = (
        max(int(low[0]) - margin, corridor.box[0]),
        min(int(high[0]) + margin, corridor.box[1]),
        max(int(low[1]) - margin, corridor.box[2]),
        min(int(high[1]) + margin, corridor.box[3]),
    )
    return bounds_of(corridor.grid, box)


def _improve(answering: Answering, corridor: Corridor, points: FloatArray) -> None:
    """Give windows of the path to the planner again, each with the ellipse that can shorten it."""
    budget = answering.budget
    cost_of = answering.objective.cost
    cost, fruitless, window = cost_of(points), 0, _LEAST_WINDOWS
    while fruitless < _ROUNDS_WITHOUT_GAIN and budget.left() > 0 and len(points) > 2:  # noqa: PLR2004
        before = cost
        for number in range(2 * window - 1):
            along = number / (2 * window), (number + 2) / (2 * window)
            points = _window(answering, corridor, points, along)
            if budget.left() <= 0:
                break
        cost = cost_of(points)
        answering.better(points, cost)
        fruitless = 0 if cost < before * (1 - _LEAST_GAIN) else fruitless + 1
        window = max(window // 2, 1) if fruitless else window


def _window(
    answering: Answering,
    corridor: Corridor,
    points: FloatArray,
    along: tuple[float, float],
) -> FloatArray:
    """The path with a part of it, given as parts of its length, searched anew."""
    cost_of = answering.objective.cost
    before, inner, after = _cut(points, along)
    cost = cost_of(inner)
    straight = float(np.hypot(*(inner[-1] - inner[0])[:2]))
    if cost <= straight * (1 + _LEAST_GAIN):
        return points
    space = answering.space(corridor, *_ellipse(corridor, inner, cost))
    enough = straight * (1 + _LEAST_GAIN)
    problem = Problem(space, inner[0], inner[-1], answering.objective.of(space), enough)
    found = solve(problem, answering.settings, answering.budget.stopper(_WINDOW))
    if not found.is_exact or cost_of(found.points) >= cost:
        return points
    return np.concatenate([before, found.points, after])


def _cut(
    points: FloatArray, along: tuple[float, float]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """A path before, inside and after a part of its length; the middle part has both its ends."""
    steps = np.hypot(*np.diff(points[:, :2], axis=0).T)
    at = np.concatenate([[0.0], np.cumsum(steps)])
    low, high = along[0] * at[-1], along[1] * at[-1]
    ends = [np.array([np.interp(s, at, points[:, axis]) for axis in range(3)]) for s in (low, high)]
    before, after = points[at < low], points[at > high]
    between = points[(at > low) & (at < high)]
    return before, np.concatenate([ends[0][None], between, ends[1][None]]), after


def _ellipse(corridor: Corridor, inner: FloatArray, cost: float) -> tuple[FloatArray, FloatArray]:
    """Bounds of the ellipse whose points lie on some path not longer than a cost, between the ends
    of a part (J. Gammell and others: Informed RRT*, 2014), inside the corridor's bounds."""
    offset = (inner[-1] - inner[0])[:2]
    straight = float(np.hypot(*offset))
    across = math.sqrt(max(cost**2 - straight**2, 0.0)) / 2
    direction = offset / straight if straight > 0 else np.array([1.0, 0.0])
    half = np.sqrt((cost / 2 * direction) ** 2 + (across * direction[::-1]) ** 2)
    middle = (inner[0] + inner[-1])[:2] / 2
    low, high = corridor.bounds
    return np.maximum(middle - half, low), np.minimum(middle + half, high)
