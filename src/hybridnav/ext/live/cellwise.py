"""The draft of a next version in which single cells move between places."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.ext.live.kernels import merging as _merge_kernels
from hybridnav.ext.live.kernels.cells import take_out
from hybridnav.ext.live.kernels.merging import merge_pairs
from hybridnav.ext.live.kernels.near import box_groups, box_round
from hybridnav.ext.live.state import PLACE, State
from hybridnav.ext.live.tiles import NO_PLACE, SIDE, Box, Differing
from hybridnav.maps.islands import unique_rows
from hybridnav.pyramid.decimation import contract_alone
from hybridnav.pyramid.record import SURVIVES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from hybridnav._base.typing import AnyArray, ByteArray, LongArray
    from hybridnav.pyramid.decimation import Criterion

_SMALL_CELLS = 512 * 512
"""Cells of a window below which it takes longer to divide it than to look at all of it."""


class CellDraft:
    """The next version while it is made; the version before stays as it is.

    Cells that change class leave their places, and join those beside them with the nearest
    surviving cells within the merge distance; what is left of them makes places of its own. Levels
    below the places are made when they are read (see `levels`).

    `before`: the version before; `criterion`: when two fields merge; its linkage is "throats" or
    "radius".
    """

    def __init__(self, before: State, criterion: Criterion) -> None:
        self.before = before
        self.tiles = before.tiles.next_version()
        self.places = before.places.next_version()
        self.next_place = before.next_place
        self.cells: LongArray = np.empty((0, 2), np.int64)
        self.criterion = criterion
        self.limit = criterion.limit

    def change(self, boxes: Iterable[Box], classes: ByteArray, low: tuple[int, int]) -> None:
        """Set the classes of the cells of boxes, and move the cells whose class changes.

        For the parameters see `Tiles.differing`.
        """
        found = self.tiles.differing(boxes, classes, low)
        self.cells = np.stack([found.row, found.col], axis=1)
        if len(found.row):
            for cells, box in self._groups(found):
                self._move(cells, box)

    def _groups(self, found: Differing) -> Iterator[tuple[Differing, Box]]:
        """Yield changed cells that lie far enough from others, and a box round their places."""
        box = self._box_round(found)
        if box.shape[0] * box.shape[1] <= _SMALL_CELLS:
            yield found, box
            return
        places = sorted({*found.place.tolist()} - {NO_PLACE})
        boxes = self.places.read(places)["box"].astype(np.int64)
        keys = ((found.row // SIDE) << 32) + found.col // SIDE
        _, first, index = np.unique(keys, return_index=True, return_inverse=True)
        of_tiles = np.stack([found.row[first], found.col[first]], axis=1) // SIDE * SIDE
        joined = np.concatenate([boxes, np.hstack([of_tiles, of_tiles + SIDE])])
        group_of = box_groups(joined)
        of_cell = group_of[len(places) + index]
        has = found.place >= 0
        of_cell[has] = group_of[np.searchsorted(places, found.place[has])]
        for group in np.unique(of_cell).tolist():
            inside = of_cell == group
            cells = Differing(*(values[inside] for values in found))
            yield self._as_now(cells, Box(*joined[group].tolist()))

    def _as_now(self, cells: Differing, box: Box) -> tuple[Differing, Box]:
        """Return cells with the places that they are in after other groups, and a box round."""
        place = self.tiles.planes(box)[0][cells.row - box.low_row, cells.col - box.low_col]
        cells = cells._replace(place=place.astype(np.int64))
        return cells, self._box_round(cells)

    def _box_round(self, cells: Differing) -> Box:
        """Return the least box that holds cells and their places."""
        table = self.places.columns()
        return Box(*box_round(cells.row, cells.col, cells.place, table))

    def _move(self, found: Differing, box: Box) -> None:
        """Move changed cells, and merge places that may merge then."""
        window = _Window(self, box.widened(1))
        first = self.next_place
        waiting, lost, altered = window.take_out(found)
        joined, moved, boxes = _merge_kernels.let_join(
            window.planes,
            window.low,
            self.places.columns(),
            (altered, first, self.next_place),
            waiting,
            self.limit,
        )
        made = window.make_places(boxes) if len(boxes) else boxes[:, 0]
        beyond = _merge_kernels.merge_after(
            window.planes,
            window.low,
            self.places.columns(),
            (made, moved, lost, first, self.next_place, self.before.next_place),
            joined,
            self.limit,
        )
        window.write()
        while len(beyond):
            beyond = np.concatenate([self._merge(pair) for pair in unique_rows(beyond).rows])

    def _merge(self, pair: LongArray) -> LongArray:
        """Merge a pair of places if they may merge, and what may merge with them then."""
        if len(self.places.known(pair)) < len(pair):
            return np.empty((0, 2), np.int64)
        some, other = (Box(*box) for box in self.places.read(pair)["box"].tolist())
        window = _Window(self, some.joined(other).widened(1))
        beyond = window.merge(pair.reshape(1, 2))
        window.write()
        return beyond

    def close(self) -> State:
        """Return the version."""
        self.tiles.close()
        self.places.close()
        ends = self.before.vertex_ends.copy()
        ends[SURVIVES] = self.places.count
        has_levels = self.before.has_levels and not len(self.cells)
        return State(self.tiles, self.places, ends, self.next_place, has_levels)


class _Window:
    """A box of cells of a draft, which change before they are written back."""

    def __init__(self, draft: CellDraft, box: Box) -> None:
        self._draft = draft
        self._box = box
        self.low = box[:2]
        self.planes = draft.tiles.planes(box)

    def take_out(self, found: Differing) -> tuple[LongArray, LongArray, LongArray]:
        """Take changed cells out of their places.

        Return flat cells that wait for a place, the places that lost cells, and those of them that
        have to be looked at again beside the new ones.
        """
        draft, places = self._draft, self._draft.places
        cells = (found.row - self.low[0]) * self._box.shape[1] + found.col - self.low[1]
        self.planes[1].ravel()[cells] = found.of_class
        parents, lost, altered = take_out(
            self.planes[0], self.low, places.columns(), (cells, found.place), draft.next_place
        )
        if len(parents):
            self._new(places.read(parents))
        return cells[found.of_class > 0], lost, altered

    def _new(self, rows: AnyArray) -> LongArray:
        """Enter places with new numbers; return these."""
        first = self._draft.next_place
        self._draft.next_place += len(rows)
        return self._draft.places.append(first, rows)

    def make_places(self, boxes: LongArray) -> LongArray:
        """Make places of connected cells that no place took in; return those that may be small.

        They have the next numbers, in the window too; their boxes are given.
        """
        low = np.array(self.low)
        rows = np.zeros(len(boxes), PLACE)
        rows["area"], rows["part"], rows["box"] = 1, -1, boxes + np.tile(low, 2)
        rows["cell"] = (boxes[:, :2] + boxes[:, 2:]) // 2 + low
        numbers = self._new(rows)
        sides = boxes[:, 2:] - boxes[:, :2] - 1
        is_large = (sides * sides).sum(axis=1) >= self._draft.limit
        for at in np.flatnonzero(is_large).tolist():
            self._contract(int(numbers[at]), boxes[at])
        small: LongArray = numbers[~is_large]
        return small

    def _contract(self, number: int, box: LongArray) -> None:
        """Put places, as contraction makes them, in the place of one that is too large."""
        inside = np.s_[box[0] : box[2], box[1] : box[3]]
        place, of_class = self.planes[0][inside], self.planes[1][inside]
        mask = place == number
        fields = contract_alone(of_class * mask, self._draft.criterion)
        rows = np.zeros(len(fields.survivors), PLACE)
        low = np.array(self.low) + box[:2]
        rows["area"], rows["part"], rows["is_stale"] = fields.areas, -1, True
        rows["cell"] = np.stack(np.divmod(fields.survivors, mask.shape[1]), axis=1) + low
        rows["box"] = fields.boxes + np.array([0, 0, 1, 1]) + np.tile(low, 2)
        new = self._new(rows)
        place[mask] = new[fields.field_of[mask]]
        self._draft.places.drop([number])

    def merge(self, pairs: LongArray) -> LongArray:
        """Merge places of pairs that may merge, and so on; return pairs that leave the window."""
        draft = self._draft
        beyond: LongArray = merge_pairs(
            self.planes,
            self.low,
            draft.places.columns(),
            pairs,
            draft.limit,
            draft.before.next_place,
        )
        return beyond

    def write(self) -> None:
        """Enter the cells into the draft."""
        self._draft.tiles.put(self._box, self.planes)
