"""The vertices of which the fields of a descent are made, and what a change of the map leaves of
them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray, LongArray
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.level import Level
from hybridnav.pyramid.record import SURVIVES, Patch, Record, farthest_apart
from hybridnav.search.kernels import fields as _kernels


class Layer(NamedTuple):
    """The fields of one level of a descent, made of the vertices of the lowest one."""

    of: LongArray
    """int64 (vertices,), the field of each; -1 for none."""
    vertex: LongArray
    """int64 (n,), the vertex of each field whose surviving cell stands for it."""


class TopCosts(NamedTuple):
    """What the arcs of the highest layer cost, by the max-distance attribute, in cells."""

    keys: LongArray
    """int64 (m,), ascending: the lesser surviving cell of two fields times the cells of the map,
    and the greater one."""
    costs: FloatArray
    """float64 (m,)."""
    hulls: tuple[LongArray, IntArray]
    """int64 (n + 1,) and int32 (k, 2), the convex hull of each field."""

    def of(self, some: LongArray, others: LongArray, n_cells: int) -> FloatArray:
        """Return the costs between fields, given by their surviving cells."""
        keys = np.minimum(some, others) * n_cells + np.maximum(some, others)
        found: FloatArray = self.costs[np.searchsorted(self.keys, keys)]
        return found


class Lowest(NamedTuple):
    """The vertices of one level of a pyramid, and the levels above it that a descent visits."""

    levels: list[int]
    """Those levels, the highest first."""
    cells: LongArray
    """int64 (n,), the surviving cell of each vertex, flat, ascending."""
    sums: FloatArray
    """float64 (n, 4), their cells, and the sums of the rows, the columns and the units of these."""
    arcs: LongArray
    """int64 (m, 2), different vertices whose fields meet by a side."""
    layers: list[Layer]
    """The fields of each level."""
    top: TopCosts | None
    """What arcs of the first one cost; None for octile distances between centres of gravity."""
    holder: IntArray
    """int32 (rows, cols), the surviving cell, flat, of the vertex that holds each cell; -1 for
    none."""
    ends: ByteArray
    """uint8 (rows, cols), see `Record.vertex_end`."""
    ended: LongArray
    """int64 (256,), how many cells have each end."""

    @property
    def field_of(self) -> IntArray:
        """int32 (rows, cols), the vertex that holds each cell; -1 for none."""
        index = np.empty(self.holder.size + 1, np.int32)
        index[-1], index[self.cells] = -1, np.arange(len(self.cells))
        return index[self.holder]


def lowest_of(
    pyramid: DualGraphPyramid,
    sizes: list[int],
    levels: list[int],
    units: IntArray | None,
    *,
    by_distance: bool,
) -> Lowest:
    """Return the vertices of the last of some levels.

    `sizes`: the vertices of each level up to the first one of `levels`, which are those that a
    descent visits, the highest first; `units`: int32 (rows, cols), factor of each cell; None for
    lengths; `by_distance`: whether arcs of the first level cost their max-distance attribute.
    """
    lowest, record, shape = pyramid[levels[-1]], pyramid.record, pyramid.grid.shape
    cells = lowest.cells @ np.array([shape[1], 1])
    arcs = lowest.arcs.astype(np.int64)
    return Lowest(
        levels,
        cells,
        sums_of(lowest.field_of, units, lowest.n_vertices),
        arcs[~lowest.is_self_loop],
        [_layer(record, cells, level) for level in levels],
        _top_costs(pyramid[levels[0]]) if by_distance else None,
        np.append(cells, -1).astype(np.int32)[lowest.field_of],
        record.vertex_end.reshape(shape),
        _ended(sizes),
    )


def _ended(sizes: list[int]) -> LongArray:
    """Return how many vertices end at each level, of the numbers of vertices of the levels."""
    ended = np.zeros(SURVIVES + 1, np.int64)
    ended[1 : len(sizes)], ended[SURVIVES] = -np.diff(sizes), sizes[-1]
    return ended


def sums_of(field_of: IntArray, units: IntArray | None, n_fields: int) -> FloatArray:
    """Return the cells of fields, and the sums of their rows, columns and units; see `Lowest`."""
    flat = None if units is None else np.ascontiguousarray(units).ravel()
    sums: FloatArray = _kernels.field_sums(field_of.ravel(), field_of.shape[1], flat, n_fields)
    return sums


def _layer(record: Record, cells: LongArray, level: int) -> Layer:
    """Return the fields of a level above some vertices, given by their surviving cells."""
    alive = record.vertex_end[cells] > level
    holder = _holders(record, cells, level)
    return Layer((np.cumsum(alive) - 1)[np.searchsorted(cells, holder)], np.flatnonzero(alive))


def _holders(record: Record, cells: LongArray, level: int) -> LongArray:
    """Return the surviving cell of the vertex of a level that holds each one of a level below."""
    holder = cells.copy()
    while (gone := record.vertex_end[holder] <= level).any():
        holder[gone] = record.vertex_parent[holder[gone]]
    return holder


def _top_costs(level: Level) -> TopCosts:
    plain, (rows, cols) = ~level.is_self_loop, level.grid.shape
    tops = (level.cells @ np.array([cols, 1]))[level.arcs[plain]]
    distances = level.max_distance_m[plain] / level.grid.resolution_m
    squared = np.rint(distances * distances)  # whole numbers, as those of a change
    return TopCosts(*_sorted_costs(tops, np.sqrt(squared), rows * cols), level.hulls)


def _sorted_costs(
    tops: LongArray, distances: FloatArray, n_cells: int
) -> tuple[LongArray, FloatArray]:
    """Return the keys of `TopCosts`, each once, and the costs.

    `tops`: int64 (m, 2), flat surviving cells; `distances`: float64 (m,), in cells.
    """
    keys, first = np.unique(tops.min(axis=1) * n_cells + tops.max(axis=1), return_index=True)
    return keys, distances[first]


# After a change of the map: vertices of places that are other ones now, in a window.


class _Merged(NamedTuple):
    """Two ascending lists of cells as one."""

    cells: LongArray
    """int64 (n,), ascending."""
    old: LongArray
    """int64, where each of the first list is now; -1 for those left out."""
    new: LongArray
    """int64, where each of the second list is."""

    @classmethod
    def of(cls, cells: LongArray, stays: BoolArray, new: LongArray) -> _Merged:
        """Merge those cells that stay with new ones."""
        kept = cells[stays]
        both = np.concatenate([kept, new])
        order, place = np.argsort(both, kind="stable"), np.empty(len(both), np.int64)
        place[order] = np.arange(len(both))
        old = np.full(len(cells), -1)
        old[stays] = place[: len(kept)]
        return cls(both[order], old, place[len(kept) :])


def patched_ends(before: Lowest, patch: Patch) -> tuple[LongArray, list[int]]:
    """Return how many vertices end at each level after a change, and how many each level has then,
    up to that of the places."""
    (row, col), (rows, cols) = patch.low, patch.was.shape
    gone = before.ends[row : row + rows, col : col + cols][patch.was]
    ended = before.ended + np.bincount(patch.record.vertex_end, minlength=SURVIVES + 1)
    ended -= np.bincount(gone, minlength=SURVIVES + 1)
    ended[0] = 0
    top = int(np.flatnonzero(ended[:SURVIVES]).max(initial=0))
    sizes: list[int] = (ended.sum() - np.cumsum(ended)[: top + 1]).tolist()
    return ended, sizes


def patched(
    before: Lowest, patch: Patch, levels: list[int], ended: LongArray, units: IntArray | None
) -> Lowest:
    """Return the vertices of the map now, equal to those of its whole pyramid.

    What lies outside the window is taken over, and copied.

    `before`: the vertices of the map before; `levels`: those that a descent visits now, the same
    ones but for the first; `ended`: see `patched_ends`; `units`: as in `lowest_of`.
    """
    (row, col), (rows, cols), n_cols = patch.low, patch.was.shape, before.holder.shape[1]
    window, record = np.s_[row : row + rows, col : col + cols], patch.record
    now = (record.vertex_end > 0).reshape(rows, cols)
    label, survivors = patch.fields(levels[-1])

    def on_map(cells: LongArray) -> LongArray:
        return (cells // cols + row) * n_cols + cells % cols + col

    new = on_map(survivors)
    at_row, at_col = before.cells // n_cols - row, before.cells % n_cols - col
    inside = (at_row >= 0) & (at_row < rows) & (at_col >= 0) & (at_col < cols)
    stays = ~inside
    stays[inside] = ~patch.was[at_row[inside], at_col[inside]]
    merged = _Merged.of(before.cells, stays, new)
    n = len(merged.cells)

    holder, ends = before.holder.copy(), before.ends.copy()
    holder[window][patch.was], ends[window][patch.was] = -1, 0
    holder[window][now] = new[label[now]]
    ends[window][now] = record.vertex_end.reshape(rows, cols)[now]

    layers = [
        _patched_layer(layer, merged, _layer(record, survivors, level))
        for layer, level in zip(before.layers, levels, strict=True)
    ]
    beside = np.searchsorted(merged.cells, _kernels.pairs_beside(holder, now, row, col))
    pairs = np.stack(np.divmod(np.unique(beside @ (n, 1)), n), axis=1)
    some, others = (merged.old[ends] for ends in before.arcs.T)
    both = (some >= 0) & (others >= 0)
    arcs = np.concatenate([np.stack([some[both], others[both]], axis=1), pairs])
    sums = np.empty((n, 4))
    own = units if units is None else units[window]
    sums_new = sums_of(label, own, len(new))
    sums_new[:, 1:3] += sums_new[:, :1] * np.array([row, col])
    sums[merged.old[stays]], sums[merged.new] = before.sums[stays], sums_new
    top = _patched_top(before, merged, layers[0], pairs, patch)
    found = Lowest(levels, merged.cells, sums, arcs, layers, top, holder, ends, ended)
    if units is not None:
        found.sums[:, 3] = sums_of(found.field_of, units, n)[:, 3]
    return found


def _patched_layer(layer: Layer, merged: _Merged, new: Layer) -> Layer:
    """Return the fields of a level, of those of vertices that stay and of new ones."""
    alive, of = np.zeros(len(merged.cells), np.bool_), np.empty(len(merged.cells), np.int64)
    own, others = merged.old[layer.vertex], merged.new[new.vertex]
    alive[own[own >= 0]] = alive[others] = True
    number = np.cumsum(alive) - 1
    stays = merged.old >= 0
    of[merged.old[stays]] = number[own[layer.of[stays]]]
    of[merged.new] = number[others[new.of]]
    return Layer(of, np.flatnonzero(alive))


def _patched_top(
    before: Lowest, merged: _Merged, layer: Layer, pairs: LongArray, patch: Patch
) -> TopCosts | None:
    """Return what arcs of the highest level cost; `pairs`: new ones of the lowest one's arcs."""
    top, n_cells = before.top, before.holder.size
    if top is None:
        return None
    stays = merged.old[before.layers[0].vertex] >= 0
    kept = before.cells[before.layers[0].vertex[stays]]
    start, points = patch.place_hulls()
    new = merged.cells[layer.vertex]
    order = np.argsort(np.concatenate([kept, np.setdiff1d(new, kept)]), kind="stable")
    begins = np.concatenate([top.hulls[0][:-1][stays], start[:-1] + len(top.hulls[1])])[order]
    sizes = np.concatenate([np.diff(top.hulls[0])[stays], np.diff(start)])[order]
    ends = np.cumsum(sizes)
    every = np.concatenate([top.hulls[1], points])
    hulls = (
        np.append(0, ends),
        every[np.repeat(begins - ends + sizes, sizes) + np.arange(sizes.sum())],
    )

    fields = unique_rows(layer.of[pairs]).rows
    fields = fields[fields[:, 0] != fields[:, 1]]
    distances = np.sqrt(farthest_apart(hulls, fields))
    keys, costs = _sorted_costs(new[fields], distances, n_cells)
    some, others = np.divmod(top.keys, n_cells)
    both = np.isin(some, kept) & np.isin(others, kept)
    keys, costs = np.append(top.keys[both], keys), np.append(top.costs[both], costs)
    order = np.argsort(keys, kind="stable")
    return TopCosts(keys[order], costs[order], hulls)
