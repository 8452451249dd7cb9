"""Decimation inside a window: some fields are contracted anew, others take part whole or stay.

The ends of the edges inside a field, and of those between two fields, depend on the cells of these
fields alone: arcs are classes of cracks that blocks of two fields join, and self-loops are holes of
one field. So the record stays valid outside a set of fields that are dissolved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.combinatorial.darts import Darts
from hybridnav.pyramid import _field_kernels
from hybridnav.pyramid._kernels import Vertices
from hybridnav.pyramid.cracks import endpoints_of
from hybridnav.pyramid.decimation import contract_all, contract_within
from hybridnav.pyramid.record import MAX_LEVELS, SURVIVES, Record
from hybridnav.pyramid.start import Start, mark_blocks, start_at_base

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, ByteArray, IntArray, LongArray
    from hybridnav.pyramid.record import Linkage

_FIRST_KIND = 3
"""The least number that is no class: cells of a ring have kinds of their own."""


class Criterion(NamedTuple):
    """What decides whether two fields merge."""

    linkage: Linkage
    """The distance that stays below the limit."""
    limit: int
    """See `decimation.squared_limit`."""
    seed: int
    """Breaks ties."""


class Cells(NamedTuple):
    """The cells of a window, arrays of shape (rows, cols)."""

    dissolved: ByteArray
    """uint8, `CellClass` of the cells that start as vertices of the base; 0 elsewhere."""
    kept: BoolArray
    """The cells of the fields that take part whole."""
    kept_kind: ByteArray
    """uint8, `CellClass` of kept cells, or another number for fields that merge with none."""
    whole_at: ByteArray
    """uint8, at the surviving cells of kept fields the level from which all of them are whole."""


class Fields(NamedTuple):
    """The fields of a window after its decimation."""

    record: Record
    """All levels; flat arrays of the window."""
    field_of: IntArray
    """int32 (rows, cols), the field of each cell, -1 for none."""
    survivors: LongArray
    """int64 (n,), flat surviving cell of each field, ascending."""
    areas: LongArray
    """int64 (n,), cells of each field."""
    boxes: IntArray
    """int32 (n, 4), as `Level.boxes`."""


def contract_window(cells: Cells, kept: Record, criterion: Criterion) -> Fields:
    """Contract dissolved cells and kept fields until no edge between them may be contracted.

    Kept fields are vertices in pieces up to the level from which they are whole, and so take part
    only from there. What lies beyond them counts as no vertex.

    Parameters
    ----------
    cells
        The cells of the window. Every edge of a dissolved cell, and every 2x2 block that holds one,
        lies among dissolved and kept cells and cells that are no vertex.
    kept
        The record of the window before, flat; only what it states about kept cells is read.
    criterion
        When two fields merge.

    Returns
    -------
    Fields
        With the new ends of all edges among dissolved and kept cells. Edges from a kept cell to
        anything beyond are absent.
    """
    record, start = _start(cells, kept, criterion.limit)
    contract_all(start, criterion.linkage, criterion.limit, criterion.seed)
    field_of, survivors, areas, boxes = _fields(record, cells.dissolved.shape[1])
    return Fields(record, field_of.reshape(cells.dissolved.shape), survivors, areas, boxes)


def contract_beside(
    dissolved: ByteArray, ring: BoolArray, joins: ByteArray, criterion: Criterion
) -> Fields:
    """Contract dissolved cells among themselves, beside fields that stay as they are.

    Only the cells of those fields beside the dissolved ones are looked at. They join one another at
    the levels at which they do so in their fields, so that edges to them end where they must.

    Parameters
    ----------
    dissolved
        uint8 (rows, cols), `CellClass` of the cells that start as vertices of the base; 0
        elsewhere. Read-only.
    ring
        bool (rows, cols), the cells beside them that stay: all that share a 2x2 block with one.
    joins
        uint8 by base edge, the level at which two cells of the ring join, 0 for all other edges.
    criterion
        When two fields merge.

    Returns
    -------
    Fields
        With the ends of all edges of dissolved cells. What is stated about cells of the ring is of
        no use elsewhere.
    """
    return _contract_within(dissolved, dissolved, (ring, joins), criterion, None)


def contract_places(
    places: IntArray,
    survivors: BoolArray,
    beside: tuple[BoolArray, ByteArray],
    criterion: Criterion,
) -> Fields:
    """Contract each of some places to its surviving cell, beside fields that stay as they are.

    Parameters
    ----------
    places
        int32 (rows, cols), the place of each cell that starts as a vertex of the base, from 1; 0
        elsewhere.
    survivors
        bool (rows, cols), the cell of each place that survives. The linkage is "radius", and no
        cell is too far from that of its place.
    beside
        The cells beside the places, and the levels at which these join; see `contract_beside`.
    criterion
        When two fields merge.

    Returns
    -------
    Fields
        One for each place, and those beside them; see `contract_beside`.
    """
    in_blocks = np.where(survivors, np.int32(0), places)
    return _contract_within(places, in_blocks, beside, criterion, survivors.ravel())


def contract_alone(classes: ByteArray, criterion: Criterion) -> Fields:
    """Contract cells until no edge between two of them may be contracted.

    Parameters
    ----------
    classes
        uint8 (rows, cols), `CellClass`; what is 0 counts as no vertex.
    criterion
        When two fields merge.
    """
    classes.flags.writeable = False  # as the classes of a grid are: another type compiles anew
    start = start_at_base(classes, criterion.limit)
    contract_within(start, *criterion, np.empty(0, np.uint8))
    field_of, survivors, areas, boxes = _fields(start.record, classes.shape[1])
    return Fields(start.record, field_of.reshape(classes.shape), survivors, areas, boxes)


def _contract_within(
    dissolved: ByteArray | IntArray,
    in_blocks: ByteArray | IntArray,
    beside: tuple[BoolArray, ByteArray],
    criterion: Criterion,
    survivors: BoolArray | None,
) -> Fields:
    """Contract cells beside fields that stay; cells of different kinds stay apart."""
    ring, joins = beside
    kinds = np.where(ring, dissolved.dtype.type(1), dissolved)
    kinds.flags.writeable = in_blocks.flags.writeable = False
    record, darts, vertices, *rest = start_at_base(kinds, criterion.limit, in_blocks=in_blocks)
    kind = vertices.classes.astype(np.int32)
    on_ring = np.flatnonzero(ring[tuple(vertices.cells.T)])
    kind[on_ring] = max(_FIRST_KIND, int(dissolved.max(initial=0)) + 1) + np.arange(len(on_ring))
    start = Start(record, darts, vertices._replace(classes=kind), *rest)
    contract_within(start, *criterion, joins, survivors=survivors)
    field_of, found, areas, boxes = _fields(record, dissolved.shape[1])
    return Fields(record, field_of.reshape(dissolved.shape), found, areas, boxes)


def _fields(record: Record, cols: int) -> tuple[IntArray, LongArray, LongArray, IntArray]:
    field_of, survivors = _field_kernels.label_fields(
        record.vertex_end, record.vertex_parent, MAX_LEVELS
    )
    areas, boxes = _field_kernels.field_extents(field_of, cols, len(survivors))
    return field_of, survivors, areas, boxes


def _start(cells: Cells, kept: Record, limit: int) -> tuple[Record, Start]:
    """Return the record of the blocks and kept fields, and the darts between them."""
    rows, cols = cells.dissolved.shape
    record, power, *_ = mark_blocks(cells.dissolved, limit)
    stays = cells.kept.ravel()
    record.vertex_end[stays] = kept.vertex_end[stays]
    record.vertex_parent[stays] = kept.vertex_parent[stays]
    _join_edges(cells, record.edge_end, kept.edge_end)
    field_of, survivors, _, boxes = _fields(record, cols)
    place = np.stack(np.divmod(survivors, cols), axis=1).astype(np.int32)
    row, col = place.T
    whole_at = np.where(
        cells.kept[row, col], cells.whole_at[row, col], 2 * power[row >> 1, col >> 1]
    )
    kinds = np.where(cells.kept, cells.kept_kind, cells.dissolved)[row, col]
    vertices = Vertices(place, boxes, kinds, whole_at.astype(np.uint8))
    alive = np.flatnonzero(record.edge_end == SURVIVES)
    sigma, origin, protected = _field_kernels.level_darts(
        alive, record.edge_end, record.vertex_end, field_of, MAX_LEVELS, rows, cols
    )
    sweep = _field_kernels.sweeps(survivors, record.edge_end, MAX_LEVELS, cols)
    starts = np.stack(endpoints_of(alive, cols), axis=1).ravel()
    darts = Darts(sigma, origin, sweep[starts], protected, alive.astype(np.int32))
    return record, Start(record, darts, vertices, 0, cols)


def _join_edges(cells: Cells, edge_end: ByteArray, before: ByteArray) -> None:
    """Add the edges between kept cells, as they were, and those to dissolved cells, all alive."""
    shape = (*cells.kept.shape, 2)
    ends, old = edge_end.reshape(shape), before.reshape(shape)
    for north, low, high in _neighbours():
        stays = cells.kept[low], cells.kept[high]
        fresh = cells.dissolved[low] > 0, cells.dissolved[high] > 0
        of_low = ends[low][..., north]
        of_low[stays[0] & stays[1]] = old[low][..., north][stays[0] & stays[1]]
        of_low[(stays[0] & fresh[1]) | (fresh[0] & stays[1])] = SURVIVES


def _neighbours() -> tuple[tuple[int, tuple[slice, slice], tuple[slice, slice]], ...]:
    """Return the direction of base edges, 1 for north, and slices of their two cells."""
    all_but_first, all_but_last, every = slice(1, None), slice(None, -1), slice(None)
    return (
        (0, (every, all_but_last), (every, all_but_first)),
        (1, (all_but_last, every), (all_but_first, every)),
    )
