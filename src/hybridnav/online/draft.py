"""A version of the cells and places, and the draft of the next one."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.online.tiles import NO_PLACE, Box, Tiles
from hybridnav.online.windows import Core, contract, places_beside
from hybridnav.pyramid.record import SURVIVES

if TYPE_CHECKING:
    from hybridnav._typing import AnyArray, BoolArray, ByteArray, LongArray
    from hybridnav.online.places import PlaceTable
    from hybridnav.pyramid.window import Criterion

_MOST_WHOLE_AT = 48
"""A neighbour that is whole only above this level is dissolved too: what joins it lies one level
higher each time, and a byte holds 126 levels. Fresh builds have 10 to 15."""


class State(NamedTuple):
    """All that a version consists of."""

    tiles: Tiles
    """Its cells."""
    places: PlaceTable
    """Its places."""
    vertex_ends: LongArray
    """int64 (256,), how many cells have each end."""
    next_place: int
    """The least number that no place has ever had."""


class Draft:
    """The next version while it is made; the version before stays as it is.

    Parameters
    ----------
    before
        The version before.
    criterion
        When two fields merge.
    """

    def __init__(self, before: State, criterion: Criterion) -> None:
        self.before = before
        self.tiles = before.tiles.next_version()
        self.places = before.places.next_version()
        self.vertex_ends = before.vertex_ends.copy()
        self.next_place = before.next_place
        self._criterion = criterion

    def change(self, box: Box, classes: ByteArray) -> None:
        """Set the classes of the cells of a box, and contract what that touches.

        Parameters
        ----------
        box
            Cells, by the rows and columns of the tiles.
        classes
            uint8 `CellClass`, of the shape of the box.
        """
        if box.is_empty:
            return
        cells = self.tiles.read(box)
        differs = cells["class"] != classes
        if not differs.any():
            return
        touched = {int(place) for place in np.unique(cells["place"][differs]) if place != NO_PLACE}
        region, cells, mask, kept = self._around(box, differs, touched)
        new_class = cells["class"].copy()
        new_class[box.inside(region)] = classes
        self.places.drop(touched)
        core = Core(region, mask, np.where(mask, new_class, np.uint8(0)))
        seeds = self._contract(core, kept)
        while seeds:
            seeds = self._go_on(seeds)

    def _around(
        self, box: Box, differs: BoolArray, touched: set[int]
    ) -> tuple[Box, AnyArray, BoolArray, list[int]]:
        """Return the region to dissolve, its cells as they are, their mask, and its neighbours.

        Neighbours that have grown too high are added to the touched places.
        """
        while True:
            region = self._joined(touched, box).widened(1)
            cells = self.tiles.read(region)
            mask = np.isin(cells["place"], list(touched))
            mask[box.inside(region)] |= differs
            kept = places_beside(cells, mask)
            high = self.places.read(kept)["whole_at"] > _MOST_WHOLE_AT
            if not high.any():
                return region, cells, mask, kept
            touched |= set(np.array(kept)[high].tolist())

    def _joined(self, places: set[int], box: Box) -> Box:
        """Return the least box that holds a box and the fields of some places."""
        for row in self.places.read(sorted(places)):
            box = box.joined(Box(*row["box"].tolist()))
        return box

    def _go_on(self, seeds: set[int]) -> set[int]:
        """Contract places with what lies beside them; return those that may go on merging.

        A place whose surviving cell is new, or that has new neighbours, may merge with places that
        its parts could not merge with.
        """
        first = next(iter(seeds))
        box = Box(*self.places.read([first])[0]["box"].tolist())
        region = self._joined(seeds, box).widened(1)
        cells = self.tiles.read(region)
        beside = places_beside(cells, np.isin(cells["place"], list(seeds)))
        nothing = np.zeros(region.shape, np.uint8)
        return self._contract(Core(region, nothing > 0, nothing), sorted({*seeds, *beside}))

    def _contract(self, core: Core, kept: list[int]) -> set[int]:
        """Contract a core and the places beside it; return the places that may go on merging.

        `kept` are the places that take part whole: all beside the core.
        """
        window = contract(self.tiles, self.places, core, kept, self._criterion)
        if window.n_kept.max(initial=0) > 1:
            # Where two of them merge, arcs to what lies beside both may become one.
            beside = self.places.known(window.places_beside(self.tiles))
            window = contract(self.tiles, self.places, core, kept, self._criterion, frozen=beside)
        changed = window.changed()
        if not changed.any() and not core.cells.any():
            return set()
        new = np.flatnonzero(changed)
        numbers = np.empty(len(changed), np.int64)
        numbers[window.field_of_kept] = window.kept
        numbers[new] = self.next_place + np.arange(len(new))
        self.next_place += len(new)
        after = window.cells_after(numbers)
        self._count(window.before, -1)
        self._count(after, 1)
        self.tiles.write(window.box, after)
        gone = np.array(window.kept, np.int64)[changed[window.field_of_kept]]
        self.places.drop(gone.tolist())
        self.places.write(numbers[new].tolist(), window.rows_of(new))
        return set(numbers[window.may_merge()].tolist())

    def _count(self, cells: AnyArray, sign: int) -> None:
        self.vertex_ends += sign * np.bincount(cells["end"].ravel(), minlength=SURVIVES + 1)

    def close(self) -> State:
        """Close levels at which nothing ends any more, and return the version."""
        ends = np.flatnonzero(self.vertex_ends[1:SURVIVES]) + 1
        if len(ends) and ends[-1] > len(ends):
            self._renumber_levels(ends)
        self.tiles.close()
        self.places.close()
        return State(self.tiles, self.places, self.vertex_ends, self.next_place)

    def _renumber_levels(self, levels: LongArray) -> None:
        """Give the levels at which cells end the numbers 1, 2, ...; this looks at every tile."""
        new_level = np.arange(SURVIVES + 1, dtype=np.uint8)
        new_level[levels] = np.arange(1, len(levels) + 1)
        new_end = np.arange(SURVIVES + 1, dtype=np.uint8)
        new_end[2 * levels] = 2 * new_level[levels]
        new_end[2 * levels + 1] = 2 * new_level[levels] + 1
        for box in self.tiles.boxes():
            cells = self.tiles.read(box)
            cells["end"], cells["edges"] = new_level[cells["end"]], new_end[cells["edges"]]
            self.tiles.write(box, cells)
        places = self.places.numbers()
        rows = self.places.read(places)
        rows["whole_at"] = new_level[rows["whole_at"]]
        self.places.write(places, rows)
        before = self.vertex_ends.copy()
        self.vertex_ends[:] = 0
        np.add.at(self.vertex_ends, new_level, before)
