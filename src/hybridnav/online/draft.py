"""A version of the cells and places, and the draft of the next one."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.online.groups import Group, changed_groups, place_groups
from hybridnav.online.tiles import NO_PLACE, Box, Tiles
from hybridnav.online.windows import contract, contract_group, places_beside

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._typing import ByteArray, LongArray
    from hybridnav.online.places import PlaceTable
    from hybridnav.online.windows import Window
    from hybridnav.pyramid.window import Criterion

_MOST_WHOLE_AT = 48
"""A neighbour that is whole only above this level is dissolved too: what joins it lies one level
higher each time, and a byte holds 126 levels. Fresh builds have 10 to 15."""

_ROUNDS = 4
"""How often places that may merge are contracted anew, which is quick; then whole ones merge, after
which there are fewer each time."""
_NO_CELLS = Box(0, 0, 0, 0)
_NONE = np.zeros((0, 0), np.uint8)


class State(NamedTuple):
    """All that a version consists of."""

    tiles: Tiles
    """Its cells."""
    places: PlaceTable
    """Its places."""
    vertex_ends: LongArray
    """int64 (256,), how many cells have each end. Levels at which none ends are left out of the
    dense form."""
    next_place: int
    """The least number that no place has ever had."""
    has_levels: bool = True
    """Whether all levels below the places are those of its cells; see `levels`."""


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
        self._cells: list[LongArray] = []

    @property
    def cells(self) -> LongArray:
        """int64 (n, 2), the cells whose class changed, by the rows and columns of the tiles."""
        return np.concatenate([*self._cells, np.empty((0, 2), np.int64)])

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
        self._cells.append(np.argwhere(differs) + np.array(box[:2]))
        again: set[int] = set()
        for group in changed_groups(box, differs, cells["place"], self.places):
            again |= self._renew(group, classes[group.box.inside(box)])
        for _ in range(_ROUNDS):
            groups, again = [*place_groups(sorted(again), self.places)], set()
            for group in groups:
                again |= self._renew(group, _NONE)
        while again:
            again = self._go_on(again)

    def _renew(self, group: Group, classes: ByteArray) -> set[int]:
        """Dissolve places and changed cells, and contract them again.

        Return the places that may merge now: new ones, and those beside them.

        Parameters
        ----------
        group
            The places and cells.
        classes
            uint8 `CellClass`, those of the box of the group now.
        """
        region = self._joined(group.places, group.box).widened(1)
        window, pairs = contract_group(
            self.tiles, self.places, region, (group, classes), self._criterion
        )
        numbers = self._write(window, group.places)
        return {number for field, place in pairs for number in (int(numbers[field]), place)}

    def _joined(self, places: set[int], box: Box = _NO_CELLS) -> Box:
        """Return the least box that holds a box and the fields of some places."""
        for row in self.places.read(sorted(places)):
            field = Box(*row["box"].tolist())
            box = field if box.is_empty else box.joined(field)
        return box

    def _go_on(self, seeds: set[int]) -> set[int]:
        """Merge places with those beside them; return the ones that may go on merging.

        A place whose surviving cell is new, or that has new neighbours, may merge with places that
        its parts could not merge with.
        """
        region = self._joined(seeds).widened(1)
        cells = self.tiles.read(region)
        beside = places_beside(cells, np.isin(cells["place"], list(seeds)))
        kept = sorted({*seeds, *beside})
        high = self.places.read(kept)["whole_at"] > _MOST_WHOLE_AT
        if high.any():
            tall = Group(set(np.array(kept)[high].tolist()), _NO_CELLS, _NONE > 0)
            return set(self.places.known(seeds | self._renew(tall, _NONE)))
        return self._merge(kept)

    def _merge(self, kept: list[int]) -> set[int]:
        """Merge places as far as they may; return those that may go on merging."""
        window = contract(self.tiles, self.places, kept, self._criterion)
        if window.n_kept.max(initial=0) > 1:
            # Where two of them merge, arcs to what lies beside both may become one.
            beside = self.places.known(window.places_beside(self.tiles))
            window = contract(self.tiles, self.places, kept, self._criterion, frozen=beside)
        changed = window.changed()
        if not changed.any():
            return set()
        gone = np.array(window.kept, np.int64)[changed[window.field_of_kept]]
        numbers = self._write(window, gone.tolist())
        return set(numbers[window.may_merge()].tolist())

    def _write(self, window: Window, gone: Iterable[int]) -> LongArray:
        """Write what a window was contracted to; return the number of the place of each field."""
        changed = window.changed()
        new = np.flatnonzero(changed)
        numbers = np.full(len(changed), NO_PLACE, np.int64)
        numbers[window.field_of_kept] = window.kept
        numbers[new] = self.next_place + np.arange(len(new))
        self.next_place += len(new)
        self.tiles.write(window.box, window.cells_after(numbers, self.vertex_ends))
        self.places.drop(gone)
        self.places.write(numbers[new].tolist(), window.rows_of(new))
        return numbers

    def close(self) -> State:
        """Return the version."""
        self.tiles.close()
        self.places.close()
        return State(self.tiles, self.places, self.vertex_ends, self.next_place)
