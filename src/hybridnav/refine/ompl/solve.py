"""OMPL at work: its state spaces with the checks of states and motions in them, and the solution of
one problem by one planner; imported by the worker alone.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from ompl import base, geometric

from hybridnav._base.trig import hypot, hypots
from hybridnav._base.typing import FloatArray
from hybridnav.errors import OmplError
from hybridnav.refine.curves import driven, shortest_curve
from hybridnav.refine.motions import MotionCheck
from hybridnav.refine.ompl import OmplSettings
from hybridnav.refine.ompl.client import Search
from hybridnav.refine.ompl.settings import PARAMETERS, REAL, ROADMAPS

FINE = 1e-4
"""Share of the extent that OMPL takes as its validity resolution; its own motion check is never
used, so the share only has to be small."""


class StateSpace:
    """One state space inside some bounds, with the checks of a map.

    It keeps all objects that it passes to OMPL alive: the bindings hold no references to Python
    objects. `state_valid` checks a state of OMPL.

    `settings`: space and turning radius; `check`: check of states and motions; `low`, `high`:
    float64 (2,), bounds of x and y in metres, map frame; `note`: called with x and y of each valid
    state; None for no call.
    """

    def __init__(
        self,
        settings: OmplSettings,
        check: MotionCheck,
        low: FloatArray,
        high: FloatArray,
        *,
        note: Callable[[float, float], None] | None = None,
    ) -> None:
        bounds = base.RealVectorBounds(2)
        for axis in range(2):
            bounds.setLow(axis, float(low[axis]))
            bounds.setHigh(axis, float(max(high[axis], low[axis] + 1e-9)))
        self._check = check
        self._radius_m, self._is_dubins = settings.turning_radius_m, settings.space == "dubins"
        self.spins = settings.follows_discs
        self.is_roadmap = settings.planner in ROADMAPS
        self._spells = settings.space == "differential"
        self._reverses = settings.reverses
        self.dimension = 3 if settings.has_heading else 2
        self.space = _space_of(settings)
        self.space.setBounds(bounds)
        self.information = base.SpaceInformation(self.space)
        self.state_valid = _check_of(check, note, is_flat=not settings.has_heading)
        self._motions = _motions_of(settings, check, self.information)
        self.information.setStateValidityChecker(self.state_valid)
        self.information.setMotionValidator(self._motions)
        self.information.setStateValidityCheckingResolution(FINE)
        self.information.setup()

    def state(self, values: FloatArray) -> Any:
        """Return a state of OMPL from x, y and, if there is one, a heading."""
        state = self.information.allocState()
        self.fill(state, values)
        return state

    def fill(self, state: Any, values: Sequence[float] | FloatArray) -> None:
        """Set the values of a state of OMPL."""
        if self.dimension == 2:  # noqa: PLR2004
            state[0], state[1] = float(values[0]), float(values[1])
        else:
            state.setX(float(values[0]))
            state.setY(float(values[1]))
            yaw = math.remainder(float(values[2]), math.tau)
            state.setYaw(-math.pi if yaw >= math.pi else yaw)  # pi itself is out of OMPL's bounds

    def points(self, states: Iterable[Any]) -> FloatArray:
        """Return the values of states, float64 (n, 3), copied because OMPL frees states with their
        path."""
        if self.dimension == 2:  # noqa: PLR2004
            rows = [(state[0], state[1], 0.0) for state in states]
        else:
            rows = [(state.getX(), state.getY(), state.getYaw()) for state in states]
        return np.array(rows, dtype=np.float64).reshape(-1, 3)

    def driven(self, points: FloatArray) -> FloatArray:
        """Return the states of a path, float64 (n, 3), without rows if it cannot be driven.

        For `differential` the robot only turns or only drives between them. Parts of such motions
        are valid if the motions are, as PathSimplifier assumes.
        """
        if not self._spells or not len(points):
            return points
        return driven(self._check, points, reverses=self._reverses)

    def is_valid(self, points: FloatArray) -> bool:
        """Return whether every state and motion of a path is valid, joints between motions
        included."""
        if not len(points):
            return False
        if self.dimension == 2:  # noqa: PLR2004
            return self._check.path_valid(points[:, :2])
        if self._spells:
            return self._check.path_valid(points)
        states = [self.state(point) for point in points]
        valid, runs = self.information.isValid, self.information.checkMotion
        return all(map(valid, states)) and all(runs(*pair) for pair in itertools.pairwise(states))

    def length(self, points: FloatArray) -> float:
        """Return the metres that the robot's base moves along a path of states.

        Not by OMPL: its Reeds-Shepp distance is up to 2.4 times that of some straight drives.
        """
        if self._radius_m is not None:
            curve = partial(shortest_curve, radius_m=self._radius_m, reverses=not self._is_dubins)
            return math.fsum(curve(*pair).length_m for pair in itertools.pairwise(points.tolist()))
        steps = np.diff(points[:, :2], axis=0)
        return math.fsum(hypots(steps[:, 0], steps[:, 1]).tolist())


def _space_of(settings: OmplSettings) -> Any:
    if settings.space == "r2":
        return base.RealVectorStateSpace(2)
    if settings.follows_discs:
        return base.SE2StateSpace()
    if settings.space == "dubins":
        return base.DubinsStateSpace(settings.turning_radius_m)
    return base.ReedsSheppStateSpace(settings.turning_radius_m)


def _check_of(
    check: MotionCheck, note: Callable[[float, float], None] | None, *, is_flat: bool
) -> Any:
    valid = check.state_valid

    def noted(*values: float) -> bool:
        good = valid(*values)
        if good and note is not None:
            note(*values[:2])
        return good

    told = valid if note is None else noted
    if is_flat:
        return lambda state: told(state[0], state[1])
    return lambda state: told(state.getX(), state.getY(), state.getYaw())


class _Straight(base.MotionValidator):  # type: ignore[misc]  # the bindings have no types
    """Straight motions of a disc."""

    def __init__(self, information: Any, check: MotionCheck) -> None:
        super().__init__(information)
        self._valid = check.motion_valid

    def checkMotion(self, first: Any, second: Any) -> bool:  # noqa: N802 - OMPL's name
        return self._valid(first[0], first[1], second[0], second[1])


class _Turning(base.MotionValidator):  # type: ignore[misc]
    """Motions between poses, by a given check."""

    def __init__(self, information: Any, valid: Callable[..., bool]) -> None:
        super().__init__(information)
        self._valid = valid

    def checkMotion(self, first: Any, second: Any) -> bool:  # noqa: N802
        return self._valid(
            first.getX(), first.getY(), first.getYaw(),
            second.getX(), second.getY(), second.getYaw(),
        )  # fmt: skip


def _either_direction(check: MotionCheck) -> Callable[..., bool]:
    valid = check.drive_valid
    return lambda *poses: valid(*poses) or valid(*poses, backwards=True)


def _motions_of(settings: OmplSettings, check: MotionCheck, information: Any) -> Any:
    if settings.space == "r2":
        return _Straight(information, check)
    if settings.space == "se2":
        return _Turning(information, check.turn_valid)
    if settings.space == "differential":
        return _Turning(
            information, _either_direction(check) if settings.reverses else check.drive_valid
        )
    assert settings.turning_radius_m is not None  # noqa: S101 - the settings are checked
    curve = check.dubins_valid if settings.space == "dubins" else check.reeds_shepp_valid
    return _Turning(information, partial(curve, radius_m=settings.turning_radius_m))


IMPROVING = frozenset({"RRTstar", "InformedRRTstar", "BITstar", "PRMstar"})
"""Planners that continue after the first solution."""
NEAR = 1e-6
"""Distance from the goal, in metres and radians, below which a path ends there."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A problem from one state to another."""

    space: StateSpace
    """State space with its checks and bounds."""
    start: FloatArray
    """float64 (3,)."""
    goal: FloatArray
    objective: Any
    enough: float = math.inf
    """Cost at which a planner that improves paths may stop; infinity: at the first path."""


@dataclass(frozen=True, eq=False)
class Searched:
    """Result of a planner."""

    points: FloatArray
    """float64 (n, 3), as returned by `StateSpace.driven`; without rows if no path was found."""
    is_exact: bool
    """Whether the path ends at the goal."""


def solve(
    problem: Problem,
    settings: OmplSettings,
    is_spent: Callable[[], bool],
    *,
    on_path: Callable[[FloatArray], None] | None = None,
    search: Search | None = None,
) -> Searched:
    """Solve a problem by the planner of the settings.

    `settings`: planner and parameters; `is_spent`: called once an iteration; True ends the search;
    `on_path`: called with each better path of a planner that continues, float64 (n, 3); `search`:
    receives the motions of tree or roadmap.
    """
    space = problem.space
    problem.objective.setCostThreshold(base.Cost(min(problem.enough, 1e300)))
    definition = base.ProblemDefinition(space.information)
    definition.setStartAndGoalStates(space.state(problem.start), space.state(problem.goal))
    definition.setOptimizationObjective(problem.objective)
    planner = make(settings, space.information)
    planner.setProblemDefinition(definition)
    planner.setup()
    if settings.planner in ROADMAPS:
        _grow(planner, definition, problem, is_spent, on_path)
    elif settings.planner in IMPROVING and on_path is not None:
        _improve(planner, definition, problem, is_spent, on_path)
    else:
        planner.solve(base.PlannerTerminationCondition(is_spent))
    if search is not None:
        _note_edges(space, planner, search)
    return _found(problem, definition)


def make(settings: OmplSettings, information: Any) -> Any:
    """Return a planner with its parameters.

    Raises `OmplError` when OMPL refuses one of them together with the others.
    """
    planner = getattr(geometric, settings.planner)(information)
    setters = PARAMETERS[settings.planner]
    if settings.space == "differential" and "range" in setters:
        # A state part of the way has an intermediate heading, in which a long robot rarely fits.
        planner.setRange(information.getStateSpace().getMaximumExtent())
    # BIT* refuses just-in-time sampling while it uses k nearest neighbours.
    ordered = sorted(settings.parameters.items(), key=lambda item: item[0] != "use_k_nearest")
    for name, value in ordered:
        getattr(planner, setters[name])(float(value) if name in REAL else value)
    for name, value in ordered:
        taken = getattr(planner, f"get{setters[name].removeprefix('set')}")()
        if taken != value:
            raise OmplError(
                f"planner.ompl.parameters: {settings.planner} does not take {name}: {value} "
                f"together with the others; it keeps {taken}"
            )
    return planner


_FIRST_SLICE, _MOST_SLICE = 64, 1 << 20
"""Iterations after which a planner that continues is asked for its path; twice as many each
time."""
_WORTH = 0.01
"""Share by which a path must be shorter to be fetched at once."""


def _improve(
    planner: Any,
    definition: Any,
    problem: Problem,
    is_spent: Callable[[], bool],
    on_path: Callable[[FloatArray], None],
) -> None:
    """Run a planner slice by slice, so that its paths are known even if it must be killed."""
    best, size, over = math.inf, _FIRST_SLICE, False
    best_cost = planner.bestCost
    while not over:
        left, worth = size, best * (1 - _WORTH)

        def ended(worth: float = worth) -> bool:
            nonlocal left, over
            left -= 1
            over = is_spent()
            return over or left < 0 or best_cost().value() < worth

        planner.solve(base.PlannerTerminationCondition(ended))
        found = _found(problem, definition)
        if found.is_exact:
            best = best_cost().value()
            on_path(found.points)
        # A planner that ends by itself has nothing left to do.
        over = over or best <= problem.enough or left == size
        size = min(2 * size, _MOST_SLICE)


_FIRST_GROWTH, _MOST_GROWTH = 25, 5000
"""Iterations by which a roadmap grows before it is asked for a path; twice as many each time."""
_ASK_S = 0.001


def _grow(
    planner: Any,
    definition: Any,
    problem: Problem,
    is_spent: Callable[[], bool],
    on_path: Callable[[FloatArray], None] | None,
) -> None:
    """Grow a roadmap and ask it for paths, in turn.

    `solve` of PRM looks for paths in a thread of its own, which asks the termination condition: a
    condition in Python would wait there forever, because the bindings never release the
    interpreter. So roadmaps grow under conditions in Python and are queried under conditions by the
    clock.
    """
    best, growth, over = math.inf, _FIRST_GROWTH, False
    while not over:
        left = growth

        def grown() -> bool:
            nonlocal left, over
            left -= 1
            over = is_spent()
            return over or left < 0

        planner.growRoadmapPtc(base.PlannerTerminationCondition(grown))
        planner.solve(base.timedPlannerTerminationCondition(_ASK_S))
        found = _found(problem, definition)
        if found.is_exact:
            cost = definition.getSolutionPath().cost(problem.objective).value()
            if cost < best and on_path is not None:
                on_path(found.points)
            best = min(cost, best)
            over = over or cost <= problem.enough
        growth = min(2 * growth, _MOST_GROWTH)


def _found(problem: Problem, definition: Any) -> Searched:
    path = definition.getSolutionPath() if definition.hasSolution() else None
    if path is None:
        return Searched(np.empty((0, 3)), is_exact=False)
    points = problem.space.driven(problem.space.points(path.getStates()))
    if not len(points):
        return Searched(points, is_exact=False)
    # OMPL's own flag is wrong for roadmaps that grew after a first answer.
    off = points[-1] - problem.goal
    turned = 0.0 if problem.space.dimension == 2 else math.remainder(off[2], math.tau)  # noqa: PLR2004
    return Searched(points, is_exact=bool(hypot(off[0], off[1]) + abs(turned) <= NEAR))


def _note_edges(space: StateSpace, planner: Any, search: Search) -> None:
    data = base.PlannerData(space.information)
    planner.getPlannerData(data)
    count = data.numVertices()
    points = space.points([data.getVertex(index).getState() for index in range(count)])
    for tail in range(count):
        heads = data.getEdges(tail)
        search.edges.extend((*points[tail, :2], *points[head, :2]) for head in heads)
