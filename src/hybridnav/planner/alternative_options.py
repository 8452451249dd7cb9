"""Options of alternatives: their defaults, their ranges, and where each changes something."""

from __future__ import annotations

import math
from numbers import Real
from typing import TYPE_CHECKING, Literal, TypeVar, get_args

from hybridnav.errors import InvalidValueError
from hybridnav.grid.checks import checked_whole
from hybridnav.homotopy.search import MOST_STATES, TIME_LIMIT_S, check_limits
from hybridnav.planner.by_classes import ClassEffort
from hybridnav.planner.by_doors import RouteLimits

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

By = Literal["doors", "homotopy"]
"""Difference between two paths: the doors that they pass, or the sides of obstacles."""
MOST = 20
"""Most alternatives of one query."""
_MAX_OVERLAP, _MAX_STRETCH, _LEAST_HOLE_M2 = 0.8, 2.0, 1.0
_BY_DOORS = ("max_overlap", "max_stretch", "inside_rooms")
_BY_CLASSES = ("least_hole_m2", "most_states", "time_limit_s")
_T = TypeVar("_T")


def check_used(by: str, given: Mapping[str, object]) -> None:
    """Refuse a difference that does not exist, and options that change nothing with it.

    Parameters
    ----------
    by
        The difference between paths.
    given
        The options that the caller gave, by name.
    """
    if by not in get_args(By):
        raise InvalidValueError(f"by must be 'doors' or 'homotopy', got {by!r:.80}")
    idle: Iterable[str] = ()
    where = "by='doors'"
    if by == "homotopy":
        idle = _BY_DOORS
    elif "inside_rooms" not in given:
        idle, where = _BY_CLASSES, "by='homotopy' or inside_rooms=True"
    for name in idle:
        if name in given:
            raise InvalidValueError(
                f"{name}={given[name]!r:.80} was given with by={by!r:.80}, and it is for "
                f"alternatives with {where}: leave it out"
            )


def limits_of(count: int, max_overlap: float | None, max_stretch: float | None) -> RouteLimits:
    """Return the limits if they are in range; None stands for the default."""
    limits = {"max_overlap": (max_overlap, 0.0, 1.0), "max_stretch": (max_stretch, 1.0, math.inf)}
    for name, (value, low, high) in limits.items():
        if value is not None and not (isinstance(value, Real) and low <= float(value) <= high):
            most = "or more" if math.isinf(high) else f"to {high:g}"
            raise InvalidValueError(
                f"{name} must be a number from {low:g} {most}, got {value!r:.80}"
            )
    return RouteLimits(
        checked_whole("alternatives", count, 1, MOST),
        _or(max_overlap, _MAX_OVERLAP),
        _or(max_stretch, _MAX_STRETCH),
    )


def effort_of(
    least_hole_m2: float | None, most_states: int | None, time_limit_s: float | None
) -> ClassEffort:
    """Return what a search for classes takes if it is in range; None stands for the default."""
    effort = ClassEffort(
        _or(least_hole_m2, _LEAST_HOLE_M2),
        _or(most_states, MOST_STATES),
        _or(time_limit_s, TIME_LIMIT_S),
    )
    check_limits(effort.most_states, effort.time_limit_s)
    if not (isinstance(effort.least_hole_m2, Real) and 0 <= effort.least_hole_m2 < math.inf):
        raise InvalidValueError(
            "least hole must be a finite number of square metres >= 0, "
            f"got {effort.least_hole_m2!r:.80}"
        )
    return effort


def _or(given: _T | None, default: _T) -> _T:
    """Return what was given, or the default for None."""
    return default if given is None else given
