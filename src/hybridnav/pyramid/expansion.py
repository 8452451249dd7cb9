"""The expansion rating: the steering by which regions grow out of places.

M. Holtgrewe, P. Sanders, C. Schulz: Engineering a scalable high quality graph partitioner, IPDPS
2010, where the rating of an edge is its squared weight over the product of the weights of its
endpoints.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.pyramid import _steering_kernels
from hybridnav.pyramid._kernels import ATTRIBUTE_MAX

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import FloatArray, IntArray, LongArray
    from hybridnav.combinatorial.darts import Darts
    from hybridnav.pyramid._kernels import Vertices
    from hybridnav.pyramid.level import Level

_PATIENCE = 32
"""Levels of a round at which arcs wait for better ones; real maps need 10."""
_ANY_SIZE = 2**62


class Expansion:
    """A steering by the expansion rating; see `Steering`.

    The rating of an arc is the squared length of what two fields have in common, over the product
    of their areas. The length is that of all arcs between the two, in cracks: merging two fields
    takes all of them away. An arc waits while another one at either of its endpoints is rated more
    than twice as high, so that the order is nearly that of one contraction at a time.

    Parameters
    ----------
    places
        The level to start from, whose arcs and fields are measured.
    most_cells
        Most cells of a field.
    """

    def __init__(self, places: Level, most_cells: int) -> None:
        plain = ~places.is_self_loop
        self._areas = places.areas
        self._most_cells = most_cells
        self._levels = 0
        self._keys, self._lengths = self._joined(places.arcs[plain], places.n_cracks[plain])
        self._ratings = np.empty(0)

    def lift_limit(self) -> None:
        """Let fields grow to any size."""
        self._most_cells = _ANY_SIZE
        self._levels = 0

    def candidates(
        self, _field_of: Callable[[], IntArray], darts: Darts, vertices: Vertices
    ) -> tuple[LongArray, LongArray]:
        """Return the arcs that no better one keeps waiting, the greatest rating first."""
        endpoints = darts.origin.reshape(-1, 2)
        u, v = endpoints.T
        kinds, areas = vertices.classes, self._areas
        may = (u != v) & (kinds[u] == kinds[v]) & (areas[u] + areas[v] <= self._most_cells)
        ratings = self._ratings = np.zeros(len(endpoints))
        ratings[may] = self._rated(endpoints[may])
        best = np.zeros(len(areas))
        np.maximum.at(best, endpoints, ratings[:, None])
        self._levels += 1
        share = 0.5 if self._levels <= _PATIENCE else 0.0
        arcs = np.flatnonzero(may & (ratings >= share * best[endpoints].max(axis=1, initial=0.0)))
        _, rank = np.unique(-ratings[arcs], return_inverse=True)
        return arcs, rank * ATTRIBUTE_MAX // max(int(rank.max(initial=0)), ATTRIBUTE_MAX)

    def refuse_leaves(self, parent: IntArray, kernel_dart: IntArray) -> None:
        """Undo the joins of stars that would make a field too large."""
        leaves = np.flatnonzero(kernel_dart >= 0)
        leaves = leaves[np.argsort(-self._ratings[kernel_dart[leaves] >> 1], kind="stable")]
        _steering_kernels.refuse_large_leaves(
            leaves, parent, kernel_dart, self._areas, self._most_cells
        )

    def merge(self, merged_into: IntArray, n_vertices: int) -> None:
        """Add up the areas of the fields, and the boundaries between them."""
        endpoints = merged_into[np.stack(np.divmod(self._keys, len(self._areas)), axis=1)]
        apart = endpoints[:, 0] != endpoints[:, 1]
        areas = np.zeros(n_vertices, dtype=np.int64)
        np.add.at(areas, merged_into, self._areas)
        self._areas = areas
        self._keys, self._lengths = self._joined(endpoints[apart], self._lengths[apart])

    def _rated(self, endpoints: IntArray) -> FloatArray:
        """Return the rating of arcs, int32 (n, 2), between different fields."""
        at = np.searchsorted(self._keys, self._keys_of(endpoints))
        area = self._areas[endpoints].astype(np.float64)
        ratings: FloatArray = self._lengths[at] ** 2 / (area[:, 0] * area[:, 1])
        return ratings

    def _joined(self, endpoints: IntArray, lengths: LongArray) -> tuple[LongArray, LongArray]:
        """Return the pairs of fields that have boundaries, and the length of all of each pair."""
        keys, of_key = np.unique(self._keys_of(endpoints), return_inverse=True)
        total = np.zeros(len(keys), dtype=np.int64)
        np.add.at(total, of_key, lengths)
        return keys, total

    def _keys_of(self, endpoints: IntArray) -> LongArray:
        """Return one number for each pair of vertices, in either order."""
        low, high = np.sort(endpoints.astype(np.int64), axis=1).T
        keys: LongArray = low * len(self._areas) + high
        return keys
