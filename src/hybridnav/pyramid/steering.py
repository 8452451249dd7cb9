"""What decides above the places which arcs are contracted, and in which order."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import IntArray, LongArray
    from hybridnav.combinatorial.darts import Darts
    from hybridnav.pyramid._kernels import Vertices


class Steering(Protocol):
    """A value of each arc of the level that is being contracted."""

    def candidates(
        self, field_of: Callable[[], IntArray], darts: Darts, vertices: Vertices
    ) -> tuple[LongArray, LongArray]:
        """Return the arcs that may be contracted at this level, and the rank of each.

        Parameters
        ----------
        field_of
            Returns the vertex of each flat cell, int32 (n_cells,), -1 for none: a pass over the
            map.
        darts, vertices
            Those of the level.

        Returns
        -------
        LongArray
            int64 (n,), arcs, ascending.
        LongArray
            int64 (n,), from 0 to `ATTRIBUTE_MAX`, the least first.
        """

    def refuse_leaves(self, parent: IntArray, kernel_dart: IntArray) -> None:
        """Undo joins of stars that pass one by one, but not together; see `select_stars`."""

    def merge(self, merged_into: IntArray, n_vertices: int) -> None:
        """Go on to the next level.

        Parameters
        ----------
        merged_into
            int32, the vertex of the next level that each vertex becomes part of.
        n_vertices
            Vertices of the next level.
        """
