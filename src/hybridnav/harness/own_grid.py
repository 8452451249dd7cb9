"""Methods that plan on a grid of their own, such as for a larger robot, and are judged on the
run's."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from hybridnav.baselines import MethodResult
from hybridnav.errors import InvalidValueError, brief
from hybridnav.grid import CellClass

if TYPE_CHECKING:
    from hybridnav.baselines import Method
    from hybridnav.grid import OccupancyGrid

Cell = tuple[int, int]

_MOST_RADIUS_M = 1e3


def checked_grid(given: Any) -> dict[str, Any]:
    """Return the settings of a grid of its own as a file of methods states them.

    Raises
    ------
    InvalidValueError
        When a key or a value is not known.
    """
    if not isinstance(given, dict) or given.keys() - {"robot_radius_m", "corner_cutting"}:
        raise InvalidValueError(
            f"grid has the keys robot_radius_m, in metres, and corner_cutting, got {brief(given)}"
        )
    radius = given.get("robot_radius_m", 0)
    is_number = isinstance(radius, (int, float)) and not isinstance(radius, bool)
    if not is_number or not 0 <= radius <= _MOST_RADIUS_M:
        raise InvalidValueError(f"grid: robot_radius_m is a number of metres, got {brief(radius)}")
    if not isinstance(given.get("corner_cutting", False), bool):
        raise InvalidValueError(
            f"grid: corner_cutting is true or false, got {brief(given['corner_cutting'])}"
        )
    return dict(given)


class OnOwnGrid:
    """A method on a grid of its own.

    Its paths are judged on the grid of the run. Its plans, its bounds and its "no path" are about
    its own grid: they are not passed on, and a query without a path has no answer.

    Parameters
    ----------
    method
        The method, made for `grid`.
    grid
        Its grid, of the same cells as that of the run.
    """

    region_of = None

    def __init__(self, method: Method, grid: OccupancyGrid) -> None:
        self._method = method
        self._free = grid.classes == CellClass.FREE
        self.name = method.name
        self.n_nodes, self.n_edges = method.n_nodes, method.n_edges
        self.memory_bytes = method.memory_bytes
        self.version = getattr(method, "version", "")
        self.settings = getattr(method, "settings", "")

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two cells that are free on the grid of the run."""
        if not (self._free[start] and self._free[goal]):
            return MethodResult(None, gave_up="start or goal is not free on its own grid")
        answer = self._method.solve(start, goal)
        line, claim = answer.any_angle, answer.by_costs
        return replace(
            answer,
            nodes=None,
            arcs=None,
            bound=math.inf,
            any_angle=None if line is None else replace(line, lower_bound_m=0.0),
            by_costs=None if claim is None else replace(claim, lower_bound_m=0.0),
            gave_up="" if answer.is_path else answer.gave_up or "no path on its own grid",
        )

    def close(self) -> None:
        """End the processes of the method."""
        close = getattr(self._method, "close", None)
        if callable(close):
            close()
