"""Obstacles and components of a grid, and their nesting, which the graph does not hold: found on
first use.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hybridnav._base.typing import ByteArray, IntArray, LongArray
from hybridnav.maps import CellClass, OccupancyGrid

RIM = 0
"""Label of the occupied ring round the map and of every obstacle that touches it."""


@dataclass(frozen=True, eq=False)
class Islands:
    """Obstacles (8-connected sets of occupied cells, the map padded with an occupied ring) and
    components (4-connected sets of other cells) of a grid.

    Obstacle 0 is the rim. Each other obstacle is surrounded by one component, each component by
    one obstacle: together a tree rooted at the rim.
    """

    obstacle_of: IntArray
    """int32 (rows, cols), obstacle of each cell, -1 elsewhere."""
    obstacle_cell: LongArray
    """int64 (n_obstacles,), flat cell west of the first cell of each obstacle, in the component
    that surrounds it; -1 for the rim."""
    component_of: IntArray
    """int32 (rows, cols), component of each cell, -1 elsewhere."""
    component_cell: LongArray
    """int64 (n_components,), first flat cell of each component."""
    surrounding_obstacle: LongArray
    """int64 (n_components,), the obstacle that each component lies in."""

    @classmethod
    def of_classes(cls, classes: ByteArray) -> Islands:
        """Find the islands of a grid of `CellClass`, shape (rows, cols)."""
        from scipy import ndimage  # noqa: PLC0415 - takes long to load

        occupied = classes == CellClass.OCCUPIED
        padded = np.pad(occupied, 1, constant_values=True)
        label, n_obstacles = ndimage.label(padded, structure=np.ones((3, 3)))
        obstacle_of = (label[1:-1, 1:-1] - 1).astype(np.int32)  # the ring is met first: label 1
        component_of = (ndimage.label(~occupied)[0] - 1).astype(np.int32)
        west = _first_cells(obstacle_of, n_obstacles) - 1
        west[RIM] = -1
        first = _first_cells(component_of, int(component_of.max(initial=-1)) + 1)
        rows, cols = np.divmod(first, classes.shape[1])
        return cls(
            obstacle_of, west, component_of, first, label[rows + 1, cols].astype(np.int64) - 1
        )

    @property
    def component_round_obstacle(self) -> LongArray:
        """int64 (n_obstacles,), the component that surrounds each obstacle, -1 for the rim."""
        found: LongArray = self.component_of.ravel()[self.obstacle_cell].astype(np.int64)
        found[RIM] = -1
        return found

    def filled_cells(self) -> LongArray:
        """Count the cells of each obstacle and of all that it surrounds, int64 (n_obstacles,)."""
        count = len(self.obstacle_cell)
        cells = np.bincount(self.obstacle_of[self.obstacle_of >= 0], minlength=count)
        inner = np.bincount(self.component_of[self.component_of >= 0])
        np.add.at(cells, self.surrounding_obstacle, inner)
        component = self.component_round_obstacle
        above = np.where(component < 0, -1, np.append(self.surrounding_obstacle, -1)[component])
        filled, at = cells.copy(), above
        while (further := at >= 0).any():
            np.add.at(filled, at[further], cells[further])
            at = np.where(further, above[at], -1)
        return filled


def _first_cells(labels: IntArray, count: int) -> LongArray:
    """Return the first flat cell of each label from 0, -1 where it has none."""
    found, at = np.unique(labels.ravel(), return_index=True)
    first = np.full(count, -1, dtype=np.int64)
    first[found[found >= 0]] = at[found >= 0]
    return first


class LazyIslands:
    """The islands of a grid, on first use.

    Levels hold this and not their pyramid: without a cycle of references, memory is free as soon as
    a pyramid is not used any more.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self._grid = grid

    @cached_property
    def found(self) -> Islands:
        """Obstacles and components, with their nesting."""
        return Islands.of_classes(self._grid.classes)
