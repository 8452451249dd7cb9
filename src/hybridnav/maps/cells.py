"""Classes of cells, and the limits and defaults of grids and paths, known without numpy."""

from enum import IntEnum


class CellClass(IntEnum):
    """Class of a cell for planners; occupied cells are not vertices of any graph.

    Examples
    --------
    >>> [kind.name for kind in hn.CellClass]
    ['OCCUPIED', 'FREE', 'UNEXPLORED']
    """

    OCCUPIED = 0
    FREE = 1
    UNEXPLORED = 2


MAX_CELLS = 1 << 28
"""Cells a grid may have at most, 16,384 x 16,384: four darts for each are numbered in int32."""

DEFAULT_MAX_CELLS = 20_000_000
"""Cells of a map that are read unless more are asked for: 4,472 x 4,472, or 224 m a side at 5 cm.
Reading so many takes about a second and 0.3 GB."""

DEFAULT_ROBOT_RADIUS_M = 0.25
"""Default radius of the robot in metres, for presets and for maps."""

TOLERANCE = 1e-9
"""Greatest loss, or difference of two losses, that counts as rounding."""

Box = tuple[int, int, int, int]
"""First row, last row + 1, first column, last column + 1 of a box of cells."""
