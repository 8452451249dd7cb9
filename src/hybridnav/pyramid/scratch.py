"""Work space of a decimation, shared by the passes over each level."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, ByteArray, IntArray, KeyArray


@dataclass
class Scratch:
    """Work space of all levels: 17 bytes an edge and 21 a vertex, shared by consecutive passes."""

    keys: KeyArray
    rest: KeyArray
    state: ByteArray
    best: KeyArray
    matched: IntArray
    parent: IntArray
    kernel_dart: IntArray
    has_leaf: BoolArray

    @classmethod
    def of_size(cls, n_vertices: int, n_edges: int) -> Scratch:
        """Return work space for a level of this size, which suits all levels above it."""
        return cls(
            np.empty(n_edges, np.uint64),
            np.empty(n_edges, np.uint64),
            np.empty(n_edges, np.uint8),
            np.empty(n_vertices, np.uint64),
            np.empty(n_vertices, np.int32),
            np.empty(n_vertices, np.int32),
            np.empty(n_vertices, np.int32),
            np.empty(n_vertices, np.bool_),
        )

    def for_level(self, n_vertices: int, n_edges: int) -> Scratch:
        """Return views of the length of a level."""
        return Scratch(
            self.keys[:n_edges],
            self.rest[:n_edges],
            self.state[:n_edges],
            self.best[:n_vertices],
            self.matched[:n_vertices],
            self.parent[:n_vertices],
            self.kernel_dart[:n_vertices],
            self.has_leaf[:n_vertices],
        )

    # Keys and matching are free once the stars are chosen.

    @property
    def inverse(self) -> IntArray:
        """int32 by dart, the inverse of sigma."""
        return self.rest.view(np.int32)

    @property
    def touched(self) -> IntArray:
        """int32, a dart of each face that contraction has changed."""
        return self.keys.view(np.int32)

    @property
    def new_edge(self) -> IntArray:
        """int32 by edge, its even dart at the next level."""
        return self.keys.view(np.int32)

    @property
    def new_vertex(self) -> IntArray:
        """int32 by vertex, its index at the next level."""
        return self.matched

    @property
    def shift(self) -> IntArray:
        """int32 by vertex, scratch of `contract`."""
        return self.best.view(np.int32)
