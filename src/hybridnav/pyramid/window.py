"""Decimation inside a window: some fields are contracted anew, others stay.

The ends of the edges inside a field, and of those between two fields, depend on the cells of these
fields alone: arcs are classes of cracks that blocks of two fields join, and self-loops are holes of
one field. So the record stays valid outside a set of fields that are dissolved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.pyramid.decimation import contract_within
from hybridnav.pyramid.kernels import fields as _field_kernels
from hybridnav.pyramid.record import MAX_LEVELS, Record
from hybridnav.pyramid.start import Start, start_at_base

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray
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
        bool (rows, cols), the cells beside the places: all that share a 2x2 block with one of
        theirs; and uint8 by base edge, the level at which two of these join, 0 for all other edges.
        Only these cells of the fields that stay are looked at. They join one another at the levels
        at which they do so in their fields, so that edges to them end where they must.
    criterion
        When two fields merge.

    Returns
    -------
    Fields
        One for each place, with the ends of all its edges. What is stated about the cells beside
        them is of no use elsewhere.
    """
    in_blocks = np.where(survivors, np.int32(0), places)
    ring, joins = beside
    kinds = np.where(ring, np.int32(1), places)
    kinds.flags.writeable = in_blocks.flags.writeable = False
    record, darts, vertices, *rest = start_at_base(kinds, criterion.limit, in_blocks=in_blocks)
    kind = vertices.classes.astype(np.int32)
    on_ring = np.flatnonzero(ring[tuple(vertices.cells.T)])
    kind[on_ring] = max(_FIRST_KIND, int(places.max(initial=0)) + 1) + np.arange(len(on_ring))
    start = Start(record, darts, vertices._replace(classes=kind), *rest)
    contract_within(start, *criterion, joins, survivors=survivors.ravel())
    field_of, found, areas, boxes = _fields(record, places.shape[1])
    return Fields(record, field_of.reshape(places.shape), found, areas, boxes)


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


def _fields(record: Record, cols: int) -> tuple[IntArray, LongArray, LongArray, IntArray]:
    field_of, survivors = _field_kernels.label_fields(
        record.vertex_end, record.vertex_parent, MAX_LEVELS
    )
    areas, boxes = _field_kernels.field_extents(field_of, cols, len(survivors))
    return field_of, survivors, areas, boxes
