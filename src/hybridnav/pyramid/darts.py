"""Darts of a plane graph, contracted and removed, and the rules that decide which arcs are
contracted above the places, and in which order.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from hybridnav._base.typing import IntArray, LongArray
from hybridnav.pyramid.kernels.darts import Darts
from hybridnav.pyramid.kernels.decimation import ATTRIBUTE_MAX, Vertices

__all__ = ["WORST_RANK", "Darts", "Resists", "Steering"]


WORST_RANK: int = ATTRIBUTE_MAX
"""Rank of the arcs that are contracted last."""


class Resists(Protocol):
    """A rule by which arcs resist contraction above the places."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows and columns of the map that the rule is for."""

    @property
    def kept_apart(self) -> IntArray | None:
        """int32 (rows, cols), labels that no place has two of, -1 for none; None for no labels."""

    def steering(self, field_of: IntArray, n_vertices: int) -> Steering:
        """Return the steering from a level on.

        `field_of`: int32 (n_cells,), the vertex of each cell at that level, -1 for none;
        `n_vertices`: vertices of that level.
        """


class Steering(Protocol):
    """A value of each arc of the level that is being contracted."""

    def candidates(
        self, field_of: Callable[[], IntArray], darts: Darts, vertices: Vertices
    ) -> tuple[LongArray, LongArray]:
        """Return the arcs that may be contracted at this level, and the rank of each.

        `field_of`: returns the vertex of each flat cell, int32 (n_cells,), -1 for none: a pass over
        the map; `darts`, `vertices`: those of the level. Returns int64 (n,), arcs, ascending. int64
        (n,), from 0 to `WORST_RANK`, the least first.
        """

    def refuse_leaves(self, parent: IntArray, kernel_dart: IntArray) -> None:
        """Undo joins of stars that pass one by one, but not together; see `select_stars`."""

    def merge(self, merged_into: IntArray, n_vertices: int) -> None:
        """Go on to the next level.

        `merged_into`: int32, the vertex of the next level that each vertex becomes part of;
        `n_vertices`: vertices of the next level.
        """
