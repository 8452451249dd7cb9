"""The reference of losses: the metrics to choose from, and the any-angle optimum, proved."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, get_args

from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import CellClass
from hybridnav.search.mesh import MeshSearch, build_mesh

if TYPE_CHECKING:
    from hybridnav.maps import OccupancyGrid

Cell = tuple[int, int]

Yardstick = Literal["both", "any-angle", "octile", "weighted"]
"""What losses refer to: each path's own metric, in a run with costs `weighted`; for all paths the
any-angle optimum; the octile optimum, which any-angle paths have no loss over; the least cost of
paths of cells, for the costs of all paths."""


Optimum = Literal["any-angle", "octile", "weighted"]
"""What the losses of one table refer to."""


YARDSTICKS: dict[Yardstick, tuple[Optimum, ...]] = {
    "both": ("any-angle", "octile"),
    "any-angle": ("any-angle",),
    "octile": ("octile",),
    "weighted": ("weighted",),
}
"""The optima that losses refer to, one table each, by the metric that is asked for."""

OPTIMA: dict[Optimum, str] = {
    "any-angle": "the any-angle optimum",
    "octile": "the octile optimum",
    "weighted": "the least cost of paths of cells",
}
"""The name of each optimum in captions."""

REFERS_TO: dict[Yardstick, str] = {
    "both": "the any-angle optimum in one table, the octile optimum in another, which any-angle "
    "paths are not in",
    "any-angle": "the any-angle optimum, for all paths",
    "octile": "the octile optimum; any-angle paths have none",
    "weighted": "the least cost of paths of cells, for the costs of all paths",
}
"""What losses refer to, in words."""


def check_yardstick(metric: str) -> None:
    """Raise `InvalidValueError` if there is no such yardstick."""
    if metric not in get_args(Yardstick):
        known = ", ".join(get_args(Yardstick))
        raise InvalidValueError(f"losses refer to one of {known}, got metric {brief(metric)}")


class AnyAngleOptimum:
    """Lengths of shortest any-angle paths between the centres of cells, by the convex mesh.

    Every legal path of the octile grid is an any-angle path between the same two centres, so no
    method's path is shorter, whatever its metric.

    Parameters
    ----------
    grid
        The map. Without corner cutting: an any-angle path never passes between two blocked cells
        that meet at a corner.

    Examples
    --------
    >>> from hybridnav.harness import AnyAngleOptimum
    >>> optimum = AnyAngleOptimum(hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0))
    >>> optimum.length_m((0, 0), (0, 3))
    3.0
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self._search = MeshSearch(build_mesh(grid.classes == CellClass.FREE))
        self._resolution_m = grid.resolution_m

    def length_m(self, start: Cell, goal: Cell) -> float:
        """Return the length between the centres of two free cells, infinite for no path.

        Parameters
        ----------
        start, goal
            (row, col) of free cells.
        """
        centres = (start[0] + 0.5, start[1] + 0.5), (goal[0] + 0.5, goal[1] + 0.5)
        return self._search.path((start, goal), centres).length_cells * self._resolution_m
