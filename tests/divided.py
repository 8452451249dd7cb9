"""Maps whose cells are divided into connected fields, and searches on them that scipy does."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from hypothesis import strategies as st
from scipy import sparse
from scipy.sparse import csgraph

from hybridnav.grid import CellClass
from hybridnav.portals import build_portals
from hybridnav.search.moves import DIAGONAL, STRAIGHT
from tests.oracle.grid import move_graph
from tests.strategies import MAX_SIDE, block_labels, class_grids, occupancy_grid, scenes

if TYPE_CHECKING:
    from hybridnav.grid import OccupancyGrid
    from hybridnav.portals import Portals

SIDE = min(MAX_SIDE, 20)
KINDS = ("pyramid", "pieces", "pieces", "stairs", "grown", "grown", "one", "cells")
SPACINGS = ((16, 4), (16, 4), (8, 2), (4, 4), (6, 3), (3, 1), (1, 1), (100, 100))
"""Spacing of portals if all border cells are gates, and of portals and gates otherwise."""
GATES = ("all", "sparse")
"""All border cells are gates, or few of them."""


@dataclass(frozen=True)
class Divided:
    """A map, a partition of the cells that may be entered, and its legal moves."""

    grid: OccupancyGrid
    field_of: Any
    spacings: tuple[int, int] = (16, 4)
    allow_unexplored: bool = False

    @cached_property
    def free(self) -> Any:
        """Whether each cell may be entered."""
        classes = self.grid.classes
        unexplored = (classes == CellClass.UNEXPLORED) & self.allow_unexplored
        return (classes == CellClass.FREE) | unexplored

    @cached_property
    def label(self) -> Any:
        """Flat, 0 to n - 1 in the order of the given numbers, -1 where not entered."""
        names = np.unique(self.field_of[self.free])
        return np.where(self.free, np.searchsorted(names, self.field_of), -1).ravel()

    @cached_property
    def moves(self) -> Any:
        """Symmetric graph of the legal moves, weighed by their integer costs."""
        everywhere = np.ones_like(self.free)
        graph: Any = move_graph(everywhere if self.grid.corner_cutting else self.free, self.free)
        graph.data = np.where(graph.data > 1, DIAGONAL, STRAIGHT).astype(np.float64)
        return graph + graph.T

    @cached_property
    def inside(self) -> Any:
        """Graph of the moves that stay in their field."""
        entries = self.moves.tocoo()
        own = self.label[entries.row] == self.label[entries.col]
        kept = entries.data[own], (entries.row[own], entries.col[own])
        return sparse.coo_array(kept, shape=entries.shape).tocsr()

    @cached_property
    def inside_by_direction(self) -> Any:
        """bool (8, cells), whether each of the eight moves from each cell stays in its field."""
        entries, cols = self.inside.tocoo(), self.grid.shape[1]
        row, col = np.divmod(entries.row, cols)
        to_row, to_col = np.divmod(entries.col, cols)
        turn = np.arctan2(to_row - row, to_col - col) / (np.pi / 4)
        legal = np.zeros((8, self.label.size), dtype=np.bool_)
        legal[np.round(turn).astype(int) % 8, entries.row] = True
        return legal

    @cached_property
    def crossings(self) -> Any:
        """Moves between fields: tail, head and cost, each in both directions."""
        entries = self.moves.tocoo()
        apart = self.label[entries.row] != self.label[entries.col]
        cost = entries.data[apart].astype(np.int64)
        return entries.row[apart].astype(np.int64), entries.col[apart].astype(np.int64), cost

    @cached_property
    def n_fields(self) -> int:
        """Fields of the cells that may be entered."""
        return int(self.label.max(initial=-1)) + 1

    def portals(self, gates: str = "all", *, least_spacing: int = 1, **options: Any) -> Portals:
        """What is tested; sparse gates at least so many cells apart."""
        spacing, sparse = self.spacings[0], max(self.spacings[1], least_spacing)
        spacings = {"spacing_cells": spacing, "gate_spacing_cells": 1}
        if gates == "sparse":
            spacings = dict.fromkeys(spacings, sparse)
        allowed = self.allow_unexplored
        return build_portals(
            self.grid, self.field_of, allow_unexplored=allowed, **{**spacings, **options}
        )


def fields_of(starts: Any) -> Any:
    """Return the field of each item, for items sorted by field."""
    return np.repeat(np.arange(len(starts) - 1), np.diff(starts))


def costs_from(graph: Any, cells: Any) -> Any:
    """Integer costs from each of these flat cells to all, infinite where there is no path."""
    found, back = np.unique(cells, return_inverse=True)
    if not len(found):
        return np.empty((0, graph.shape[0]))
    return csgraph.dijkstra(graph, directed=True, indices=found)[back]


def gate_graph(portals: Portals) -> Any:
    """Graph of the gates: paths inside fields, and moves between fields."""
    n = portals.n_gates
    tail = np.repeat(np.arange(n), np.diff(portals.exit_start))
    graph = sparse.coo_array((portals.exit_cost.astype(float), (tail, portals.exit_gate)), (n, n))
    starts = portals.gate_start.tolist()
    pairs = [itertools.product(range(a, b), repeat=2) for a, b in itertools.pairwise(starts)]
    endpoints = np.array([*itertools.chain(*pairs)], dtype=np.int64).reshape(-1, 2).T
    return (graph + sparse.coo_array((portals.clique.astype(float), (*endpoints,)), (n, n))).tocsr()


def components_of(divided: Divided) -> Any:
    """The connected components of the fields, as a partition."""
    _, piece = csgraph.connected_components(divided.inside, directed=False)
    return piece.reshape(divided.grid.shape).astype(np.int32)


def grown_labels(shape: tuple[int, int], rng: np.random.Generator) -> Any:
    """Cells by the nearest of some random seeds, and a few cells of their own."""
    row, col = np.indices(shape)
    seeds = rng.integers(0, shape, size=(int(rng.integers(2, 14)), 2))
    away = np.hypot(row[..., None] - seeds[:, 0], col[..., None] - seeds[:, 1])
    alone = rng.random(shape) < rng.choice([0.0, 0.03, 0.2])
    return np.where(alone, 100 + row * shape[1] + col, away.argmin(axis=2)).astype(np.int32)


@st.composite
def partitions(draw: st.DrawFn, side: int = SIDE) -> Divided:
    """Draw maps whose fields are connected: of a pyramid, blocks, stairs, cells, or one."""
    kind = draw(st.sampled_from(KINDS))
    spacings = draw(st.sampled_from(SPACINGS))
    if kind == "pyramid":
        scene = draw(scenes(side))
        pyramid = scene.pyramid(draw(st.sampled_from(["radius", "survivor", "diameter"])))
        return Divided(scene.grid, pyramid[-1].field_of, spacings)
    classes = draw(class_grids(side if kind != "cells" else min(side, 9)))
    corners = draw(st.sampled_from([False] * 3 + [True]))
    grid = replace(occupancy_grid(classes), corner_cutting=corners)
    entered = draw(st.sampled_from([False] * 3 + [True]))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    row, col = np.indices(classes.shape)
    if kind == "cells":
        names = rng.permutation(classes.size).reshape(classes.shape)
    elif kind == "stairs":
        names = (row + (col if rng.random() < 0.5 else -col)) // int(rng.integers(1, 5)) + 99
    elif kind == "grown":
        names = grown_labels(classes.shape, rng)
    else:
        names = block_labels(classes.shape, rng) if kind == "pieces" else np.zeros_like(row)
    divided = Divided(grid, names.astype(np.int32), spacings, entered)
    pieces = components_of(divided)
    # Cells that may not be entered may have a field or none, and numbers of fields have gaps.
    pieces[~divided.free & (rng.random(classes.shape) < 0.5)] = -1
    return replace(divided, field_of=rng.permutation(pieces.max(initial=0) + 1)[pieces] * 3)


def halves(rows: int, cols: int, at: int) -> Divided:
    """A free map, its left part one field and its right part another."""
    field_of = np.zeros((rows, cols), dtype=np.int32)
    field_of[:, at:] = 1
    return Divided(occupancy_grid(np.ones((rows, cols), dtype=np.uint8)), field_of, (8, 4))
