"""Windows of the cells: what a decimation reads there, and what it changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import ndimage

from hybridnav.online.places import PLACE, PlaceTable
from hybridnav.online.tiles import NO_PLACE, Box, Tiles
from hybridnav.pyramid.record import SURVIVES, Record
from hybridnav.pyramid.window import Cells, Fields, contract_window

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import AnyArray, BoolArray, ByteArray, LongArray
    from hybridnav.pyramid.window import Criterion

_ALIGNED = 16
"""Windows begin at multiples of the period of blocks, so that blocks lie where they always do."""
_FROZEN = np.uint8(2)
"""Added to the class of frozen places: kinds that differ do not merge."""
_BESIDE = np.ones((3, 3), dtype=np.bool_)


class Core(NamedTuple):
    """Cells that begin anew."""

    region: Box
    """The box of the next two arrays; it holds all cells beside them."""
    cells: BoolArray
    """The cells that lose what the record states about them."""
    classes: ByteArray
    """uint8, `CellClass` of these cells now, 0 elsewhere."""


@dataclass(frozen=True, eq=False)
class Window:
    """A window after its decimation; its arrays have the shape of the box, or one row a field."""

    box: Box
    before: AnyArray
    """Its cells before, `CELL`."""
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

    def cells_after(self, numbers: LongArray) -> AnyArray:
        """Return the cells of the window as they are now; `numbers` are the places of the fields.

        Nothing changes beyond the cells that took part or began anew.
        """
        after = self.before.copy()
        rows, cols = self.box.shape
        record = self.fields.record
        end = record.vertex_end.reshape(rows, cols)
        flat = record.vertex_parent.reshape(rows, cols)
        part = self.stays | (self.fresh > 0)
        steps = np.zeros((rows, cols, 2), np.int16)
        row, col = np.nonzero(part & (end != SURVIVES))
        steps[row, col, 0] = flat[row, col] // cols - row
        steps[row, col, 1] = flat[row, col] % cols - col
        write = part | self.gone
        after["class"][self.gone] = self.fresh[self.gone]
        after["end"][write] = end[write]
        after["parent"][write] = steps[write]
        after["place"][write] = NO_PLACE
        after["place"][part] = numbers[self.fields.field_of[part]]
        _write_edges(after["edges"], record.edge_end.reshape(rows, cols, 2), part, self.gone)
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


def contract(  # noqa: PLR0913 - what a version consists of, and what changes in it
    tiles: Tiles,
    places: PlaceTable,
    core: Core,
    kept: Sequence[int],
    criterion: Criterion,
    *,
    frozen: Sequence[int] = (),
) -> Window:
    """Contract a core and whole places until no two of them may merge.

    Parameters
    ----------
    tiles, places
        The version before.
    core
        The cells that begin anew.
    kept
        Places that take part whole: all beside the core.
    criterion
        When two fields merge.
    frozen
        Places that merge with none, whose arcs to others may become one.
    """
    rows = places.read([*kept, *frozen])
    box = core.region
    if len(rows):
        low, high = rows["box"][:, :2].min(axis=0), rows["box"][:, 2:].max(axis=0)
        box = box.joined(Box(*low.tolist(), *high.tolist()))
    low_row, low_col = (at // _ALIGNED * _ALIGNED for at in box[:2])
    box = Box(low_row, low_col, box.high_row, box.high_col)
    before = tiles.read(box)
    inside = core.region.inside(box)
    gone, fresh = np.zeros(box.shape, np.bool_), np.zeros(box.shape, np.uint8)
    gone[inside], fresh[inside] = core.cells, core.classes
    place = np.where(gone, NO_PLACE, before["place"])
    stays = np.isin(place, [*kept, *frozen])
    kinds = before["class"] + _FROZEN * np.isin(place, list(frozen)).astype(np.uint8)
    whole_at = np.zeros(box.shape, np.uint8)
    row, col = (rows["cell"] - np.array(box[:2])).T
    # None grows while another is in pieces: arcs between pieces are not in the graph.
    whole_at[row, col] = rows["whole_at"].max(initial=0)
    fresh.flags.writeable = False  # as the classes of a grid are: another type compiles anew
    cells = Cells(fresh, stays, kinds, whole_at)
    fields = contract_window(cells, record_of(before), criterion)
    return Window(box, before, [*kept, *frozen], rows, stays, gone, fresh, fields)


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


def _write_edges(edges: ByteArray, edge_end: ByteArray, part: BoolArray, gone: BoolArray) -> None:
    """Set the ends of edges among the cells that took part or began anew."""
    beside = np.zeros_like(part)
    for north in (0, 1):
        low = (slice(None, -1), slice(None)) if north else (slice(None), slice(None, -1))
        high = (slice(1, None), slice(None)) if north else (slice(None), slice(1, None))
        write = beside.copy()
        write[low] = (part[low] & part[high]) | gone[low] | gone[high]
        edges[..., north][write] = edge_end[..., north][write]
