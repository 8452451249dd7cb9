"""State spaces, and OMPL's checks of states and motions in them."""

from __future__ import annotations

import itertools
import math
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from ompl import base

from hybridnav.refine.differential import driven

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from hybridnav._base.typing import FloatArray
    from hybridnav.refine.motions import MotionCheck
    from hybridnav.refine.ompl import OmplSettings

_STATES = {"r2": 2, "se2": 3, "differential": 3, "dubins": 3, "reeds-shepp": 3}
FINE = 1e-4
"""Share of the extent that OMPL takes as its validity resolution; its own motion check is never
used, so the share only has to be small."""


class StateSpace:
    """One state space inside some bounds, with the checks of a map.

    It keeps all objects that it passes to OMPL alive: the bindings hold no references to Python
    objects. `state_valid` checks a state of OMPL.

    Parameters
    ----------
    settings
        Space and turning radius.
    check
        Check of states and motions.
    low, high
        float64 (2,), bounds of x and y in metres, map frame.
    note
        Called with x and y of each valid state; None for no call.
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
        self.is_straight = settings.space in {"r2", "se2", "differential"}
        self._spells = settings.space == "differential"
        self._reverses = settings.reverses
        self.dimension = _STATES[settings.space]
        self.space = _space_of(settings)
        self.space.setBounds(bounds)
        self.information = base.SpaceInformation(self.space)
        is_flat = self.dimension == 2  # noqa: PLR2004
        self.state_valid = _flat_check(check, note) if is_flat else _heading_check(check, note)
        self._motions = _motions_of(settings, check, self.information)
        self.information.setStateValidityChecker(self.state_valid)
        self.information.setMotionValidator(self._motions)
        self.information.setStateValidityCheckingResolution(FINE)
        self.information.setup()
        self._kept: list[Any] = []

    def keep(self, thing: Any) -> None:
        """Keep an object alive as long as the space: OMPL holds no references to Python objects."""
        self._kept.append(thing)

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
        """Return the metres that the robot's base moves along a path of states."""
        if not self.is_straight:
            states = [self.state(point) for point in points]
            return math.fsum(self.space.distance(*pair) for pair in itertools.pairwise(states))
        steps = np.diff(points[:, :2], axis=0)
        return math.fsum(np.hypot(steps[:, 0], steps[:, 1]).tolist())


def _space_of(settings: OmplSettings) -> Any:
    if settings.space == "r2":
        return base.RealVectorStateSpace(2)
    if settings.space in {"se2", "differential"}:
        return base.SE2StateSpace()
    if settings.space == "dubins":
        return base.DubinsStateSpace(settings.turning_radius_m)
    return base.ReedsSheppStateSpace(settings.turning_radius_m)


def _flat_check(check: MotionCheck, note: Callable[[float, float], None] | None) -> Any:
    valid = check.state_valid
    if note is None:
        return lambda state: valid(state[0], state[1])

    def noted(state: Any) -> bool:
        good = valid(state[0], state[1])
        if good:
            note(state[0], state[1])
        return good

    return noted


def _heading_check(check: MotionCheck, note: Callable[[float, float], None] | None) -> Any:
    valid = check.state_valid
    if note is None:
        return lambda state: valid(state.getX(), state.getY(), state.getYaw())

    def noted(state: Any) -> bool:
        good = valid(state.getX(), state.getY(), state.getYaw())
        if good:
            note(state.getX(), state.getY())
        return good

    return noted


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
