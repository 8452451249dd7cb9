"""Windows of the cells: what a decimation reads there, and what it changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from hybridnav.online import _ring_kernels, _write_kernels
from hybridnav.online.places import PLACE, PlaceTable
from hybridnav.online.tiles import NO_PLACE, Box, Tiles
from hybridnav.pyramid.record import SURVIVES, Record
from hybridnav.pyramid.window import Cells, Fields, contract_beside, contract_window

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import AnyArray, BoolArray, ByteArray, LongArray
    from hybridnav.online.groups import Group
    from hybridnav.pyramid.window import Criterion

_ALIGNED = 16
"""Windows begin at multiples of the period of blocks, so that blocks lie where they always do."""
_FROZEN = np.uint8(2)
"""Added to the class of frozen places: kinds that differ do not merge."""
_BESIDE = np.ones((3, 3), dtype=np.bool_)


@dataclass(frozen=True, eq=False)
class Window:
    """A window after its decimation; its arrays have the shape of the box, or one row a field."""

    box: Box
    cells: AnyArray
    """Its cells before, `CELL`; `cells_after` changes them."""
    kept: list[int]
    """The places that took part whole, or frozen."""
    rows: AnyArray
    """Their rows in the table of places."""
    stays: BoolArray
    """Their cells."""
    gone: BoolArray
    """The cells that began anew."""
    fresh: ByteArray
    """Their classes."""
    fields: Fields
    """What all of it was contracted to."""

    @property
    def _kept_at(self) -> tuple[LongArray, LongArray]:
        """The surviving cells of the kept places, in the window."""
        row, col = (self.rows["cell"] - np.array(self.box[:2])).T
        return row, col

    @property
    def field_of_kept(self) -> LongArray:
        """int64 (n_kept,), the field that holds each kept place."""
        return self.fields.field_of[self._kept_at].astype(np.int64)

    @property
    def n_kept(self) -> LongArray:
        """int64 (n_fields,), the kept places in each field."""
        counts: LongArray = np.bincount(self.field_of_kept, minlength=len(self.fields.survivors))
        return counts

    def changed(self) -> BoolArray:
        """Return the fields that are not one kept place alone, bool (n_fields,)."""
        changed: BoolArray = self.n_kept > 1
        changed[self.fields.field_of[self.fresh > 0]] = True
        return changed

    def may_merge(self) -> BoolArray:
        """Return the fields that may merge with more than their kept places could.

        Those are fields of several kept places, and those whose surviving cell is that of none.
        """
        row, col = self._kept_at
        of_kept = self.field_of_kept
        moved = self.fields.survivors[of_kept] != row * self.box.shape[1] + col
        found: BoolArray = self.n_kept > 1
        found[of_kept[moved]] = True
        return found

    def places_beside(self, tiles: Tiles) -> list[int]:
        """Return the places beside the kept ones that are not among them."""
        cells = tiles.read(self.box.widened(1))
        return places_beside(cells, np.isin(cells["place"], self.kept))

    def cells_after(self, numbers: LongArray, n_ends: LongArray) -> AnyArray:
        """Return the cells of the window as they are now.

        Parameters
        ----------
        numbers
            The number of the place of each field.
        n_ends
            int64 (256,), how many cells have each end; changed.
        """
        after, record = self.cells, self.fields.record
        _write_kernels.enter(
            tuple(after[name] for name in ("class", "end", "parent", "edges", "place")),
            (self.stays, self.gone, self.fresh),
            (record.vertex_end, record.vertex_parent, record.edge_end),
            self.fields.field_of,
            numbers,
            n_ends,
        )
        return after

    def rows_of(self, fields: LongArray) -> AnyArray:
        """Return the rows of some fields for the table of places."""
        found, ends = self.fields, self.fields.record.vertex_end
        whole_at = np.zeros(len(found.survivors), np.uint8)
        field_of = found.field_of.ravel()
        inside = np.flatnonzero((field_of >= 0) & (ends != SURVIVES))
        np.maximum.at(whole_at, field_of[inside], ends[inside])
        rows = np.zeros(len(fields), PLACE)
        low = np.array(self.box[:2])
        at = np.divmod(found.survivors[fields], self.box.shape[1])
        rows["area"], rows["cell"] = found.areas[fields], np.stack(at, axis=1) + low
        rows["box"] = found.boxes[fields] + np.array([0, 0, 1, 1]) + np.tile(low, 2)
        rows["whole_at"] = whole_at[fields]
        return rows


def contract(
    tiles: Tiles,
    places: PlaceTable,
    kept: Sequence[int],
    criterion: Criterion,
    *,
    frozen: Sequence[int] = (),
) -> Window:
    """Contract whole places until no two of them may merge.

    Parameters
    ----------
    tiles, places
        The version before.
    kept
        The places.
    criterion
        When two fields merge.
    frozen
        Places that merge with none, whose arcs to others may become one.
    """
    rows = places.read([*kept, *frozen])
    low, high = rows["box"][:, :2].min(axis=0), rows["box"][:, 2:].max(axis=0)
    box = Box(*low.tolist(), *high.tolist())
    cells = tiles.read(box)
    gone, fresh = np.zeros(box.shape, np.bool_), np.zeros(box.shape, np.uint8)
    fresh.flags.writeable = False  # as the classes of a grid are: another type compiles anew
    place = cells["place"]
    stays = np.isin(place, [*kept, *frozen])
    kinds = cells["class"] + _FROZEN * np.isin(place, list(frozen)).astype(np.uint8)
    whole_at = np.zeros(box.shape, np.uint8)
    row, col = (rows["cell"] - np.array(box[:2])).T
    # None grows while another is in pieces: arcs between pieces are not in the graph.
    whole_at[row, col] = rows["whole_at"].max(initial=0)
    fields = contract_window(Cells(fresh, stays, kinds, whole_at), record_of(cells), criterion)
    return Window(box, cells, [*kept, *frozen], rows, stays, gone, fresh, fields)


def contract_group(
    tiles: Tiles,
    places: PlaceTable,
    region: Box,
    changed: tuple[Group, ByteArray],
    criterion: Criterion,
) -> tuple[Window, list[tuple[int, int]]]:
    """Contract places and cells among themselves, beside places that stay as they are.

    Parameters
    ----------
    tiles, places
        The version before.
    region
        A box that holds all of them and the cells beside them.
    changed
        The places and cells, and the `CellClass` of the cells of the group's box now.
    criterion
        When two fields merge.

    Returns
    -------
    Window
        In which no place takes part.
    list of tuple
        Each field that may merge with a place beside it, and that place.
    """
    group, classes = changed
    low_row, low_col = (at // _ALIGNED * _ALIGNED for at in region[:2])
    box = Box(low_row, low_col, region.high_row, region.high_col)
    cells = tiles.read(box)
    numbers = np.array(sorted(group.places), np.int64)
    gone = _ring_kernels.in_places(cells["place"], numbers)
    fresh = cells["class"] * gone
    if not group.box.is_empty:
        inside = group.box.inside(box)
        gone[inside] |= group.differs
        fresh[inside][group.differs] = classes[group.differs]
    fresh.flags.writeable = False  # as the classes of a grid are: another type compiles anew
    ring = _ring_kernels.ring_round(gone) & (cells["place"] != NO_PLACE)
    fields = contract_beside(fresh, ring, joins_of(tiles, box, ring, cells), criterion)
    stays = np.zeros(box.shape, np.bool_)
    window = Window(box, cells, [], places.read([]), stays, gone, fresh, fields)
    pairs = _ring_kernels.pairs_across(fields.field_of, fresh, ring, cells["class"], cells["place"])
    may = [
        (field, place)
        for field, place in sorted(set(map(tuple, pairs.tolist())))
        if _may_merge(window, field, (place, places.read([place])[0]), tiles, criterion)
    ]
    return window, may


def joins_of(tiles: Tiles, box: Box, ring: BoolArray, cells: AnyArray) -> ByteArray:
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


def _may_merge(
    window: Window, field: int, beside: tuple[int, AnyArray], tiles: Tiles, criterion: Criterion
) -> bool:
    """Return whether a field and a place beside it, given with its row, may merge."""
    place, row = beside
    fields, low, limit = window.fields, np.array(window.box[:2]), criterion.limit
    cell = np.array(divmod(int(fields.survivors[field]), window.box.shape[1])) + low
    apart = cell - row["cell"]
    if int(apart @ apart) >= limit:
        return False
    if criterion.linkage != "radius":
        return True
    of_field, far = fields.boxes[field] + np.array([0, 0, 1, 1]), _ring_kernels.farthest_squared
    if _least_reach(row["cell"] - low, of_field) < limit and (
        far(fields.field_of, field, of_field, *(row["cell"] - low)) < limit
    ):
        return True
    if _least_reach(cell, row["box"]) >= limit:
        return False
    around = Box(*row["box"].tolist())
    whole = np.array([0, 0, *around.shape])
    found = far(tiles.read(around)["place"], place, whole, *(cell - np.array(around[:2])))
    return bool(found < limit)


def _least_reach(cell: LongArray, box: LongArray) -> int:
    """Return the least squared distance from a cell to the farthest one of a field in a box.

    The field has a cell at each side of its box.
    """
    return int(max(*(box[:2] - cell), *(cell - box[:2]), *(box[2:] - 1 - cell), 0)) ** 2


def places_beside(cells: AnyArray, core: BoolArray) -> list[int]:
    """Return the places of the cells beside a mask, by sides or corners, ascending."""
    beside = ndimage.binary_dilation(core, _BESIDE) & ~core
    return [int(place) for place in np.unique(cells["place"][beside]) if place != NO_PLACE]


def record_of(cells: AnyArray) -> Record:
    """Return the record of a window, flat."""
    rows, cols = cells.shape
    steps = cells["parent"].astype(np.int32)
    parent = np.arange(rows * cols, dtype=np.int32).reshape(rows, cols)
    parent += steps[..., 0] * np.int32(cols) + steps[..., 1]
    return Record(
        cells["end"].ravel(),
        np.where(cells["end"] == SURVIVES, -1, parent).ravel().astype(np.int32),
        cells["edges"].ravel(),
    )
