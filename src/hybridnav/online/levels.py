"""The levels below places, made when they are read."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.online import _ring_kernels, _write_kernels
from hybridnav.online.draft import State
from hybridnav.online.tiles import NO_PLACE
from hybridnav.online.windows import joins_of
from hybridnav.pyramid.record import SURVIVES
from hybridnav.pyramid.window import contract_places

if TYPE_CHECKING:
    from hybridnav.online.tiles import Box
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
    joins = joins_of(tiles, box, ring, cells)
    fields = contract_places(dissolved, survivors, (ring, joins), criterion)
    fresh = cells["class"] * gone
    _write_kernels.enter(
        tuple(cells[name] for name in ("class", "end", "parent", "edges", "place")),
        (np.zeros(box.shape, np.bool_), gone, fresh),
        (fields.record.vertex_end, fields.record.vertex_parent, fields.record.edge_end),
        fields.field_of,
        cells["place"].ravel()[fields.survivors].astype(np.int64),
        np.zeros(SURVIVES + 1, np.int64),
    )
    tiles.write(box, cells)
    rows["is_stale"] = False
    places.write(stale, rows)
    tiles.close()
    places.close()
    ends = np.bincount(cells["end"].ravel(), minlength=SURVIVES + 1).astype(np.int64)
    return State(tiles, places, ends, state.next_place)
