"""Combinatorial maps: plane graphs as permutations of darts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, IntArray, LongArray


@copies_alike
@dataclass(frozen=True, eq=False)
class CombinatorialMap:
    """A plane graph and its dual, both held by one permutation of darts.

    Edge e has the darts 2e and 2e + 1, each the other's half: `alpha(d) = d ^ 1`, not stored. The
    dual needs no array of its own: its rotation is `phi = sigma o alpha`.
    """

    sigma: IntArray
    """int32 (2 n_edges,), next dart counter-clockwise round the vertex."""
    origin: IntArray
    """int32 (2 n_edges,), vertex at which each dart starts."""
    protected: BoolArray
    """bool (2 n_edges,), whether the face on the right of the dart is protected: anything but an
    ordinary one, which at the base is a full 2x2 block of vertices."""
    base_edge: IntArray
    """int32 (n_edges,), id of each edge in the base: 2 * flat cell, plus 1 for a step north."""
    n_vertices: int
    """Vertices, those without an edge included."""

    def __post_init__(self) -> None:
        for array in (self.sigma, self.origin, self.protected, self.base_edge):
            array.flags.writeable = False

    @property
    def n_edges(self) -> int:
        """Edges, self-loops included."""
        return len(self.base_edge)

    @property
    def phi(self) -> IntArray:
        """int32 (2 n_edges,), next dart round the face, which lies on the right of its darts."""
        phi: IntArray = self.sigma[np.arange(len(self.sigma)) ^ 1]
        return phi

    def faces(self) -> LongArray:
        """Label the faces: for each dart the number of its orbit under phi, dense from 0."""
        from scipy.sparse import coo_array  # noqa: PLC0415 - only who looks at the dual pays
        from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

        n_darts = len(self.sigma)
        ones = np.ones(n_darts, dtype=np.int8)
        steps = coo_array((ones, (np.arange(n_darts), self.phi)), shape=(n_darts, n_darts))
        _, label = connected_components(steps, directed=False)
        return label.astype(np.int64)
