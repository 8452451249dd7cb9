"""Classes of cells."""

from __future__ import annotations

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
