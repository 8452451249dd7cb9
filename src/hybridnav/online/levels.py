"""The levels below places, made when they are read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.online import _ring_kernels, _write_kernels
from hybridnav.online.state import State
from hybridnav.online.tiles import NO_PLACE
from hybridnav.pyramid.record import SURVIVES
from hybridnav.pyramid.window import contract_places

if TYPE_CHECKING:
    from hybridnav._typing import AnyArray, BoolArray, ByteArray
    from hybridnav.online.tiles import Box, Tiles
    from hybridnav.pyramid.window import Criterion


def with_levels(state: State, box: Box, criterion: Criterion) -> State:
    """Return a version with all levels below the places that changed since they were made last.

    Each of these places is dissolved into its cells and contracted again, beside places that stay
    as they are, until its surviving cell alone is left.

    Parameters
    ----------
    state
        The version; it stays as it is.
    box
        All cells, by the rows and columns of the tiles.
    criterion
        When two fields merge; its linkage is "radius".
    """
    if state.has_levels:
        return state
    stale = state.places.stale()
    tiles, places = state.tiles.next_version(), state.places.next_version()
    cells, rows = tiles.read(box), places.read(stale)
    dissolved = _ring_kernels.index_in(cells["place"], stale)
    gone = (dissolved > 0) | ((cells["class"] == 0) & (cells["end"] > 0))
    ring = _ring_kernels.ring_round(gone) & (cells["place"] != NO_PLACE)
    survivors = np.zeros(box.shape, np.bool_)
    row, col = (rows["cell"] - np.array(box[:2])).T
    survivors[row, col] = True
    joins = _joins_of(tiles, box, ring, cells)
    fields = contract_places(dissolved, survivors, (ring, joins), criterion)
    fresh = cells["class"] * gone
    _write_kernels.enter(
        tuple(cells[name] for name in ("class", "end", "parent", "edges", "place")),
        (gone, fresh),
        (fields.record.vertex_end, fields.record.vertex_parent, fields.record.edge_end),
        fields.field_of,
        cells["place"].ravel()[fields.survivors].astype(np.int64),
    )
    tiles.write(box, cells)
    rows["is_stale"] = False
    places.write(stale, rows)
    tiles.close()
    places.close()
    ends = np.bincount(cells["end"].ravel(), minlength=SURVIVES + 1).astype(np.int64)
    return State(tiles, places, ends, state.next_place)


def _joins_of(tiles: Tiles, box: Box, ring: BoolArray, cells: AnyArray) -> ByteArray:
    """Return the level at which the two cells of each base edge in a ring join, flat."""
    joins: ByteArray
    joins, beyond = _ring_kernels.ring_joins(ring, cells["end"], cells["parent"], cells["place"])
    beyond[:, 2:] += np.tile(np.array(box[:2]), 2)
    for edge, reached, *cell, row, col in beyond.tolist():
        level, first, second = reached, (cell[0], cell[1]), (row, col)
        while first != second:
            if tiles.end_at(first) > tiles.end_at(second):
                first, second = second, first
            level = max(level, tiles.end_at(first))
            first = tiles.parent_of(first)
        joins[edge] = level
    return joins
