"""How stable the numbers of places, regions and rooms are over an update."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.grid import CellClass
from hybridnav.grid.runs import unique_rows
from hybridnav.online.shift import placed, shift_of

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, ByteArray, IntArray, LongArray
    from hybridnav.grid import OccupancyGrid


class Flips(NamedTuple):
    """How stable the numbers of places, regions or rooms are over one update.

    A cell flips if it stays free and changes its number, although more than half of the cells of
    its old place stay free. A place is untouched if none of its cells changes class; it flips if
    its number is not on more than half of its cells any more. The same holds for regions and
    rooms.

    An untouched place that flips has a changed cell beside it, if it is not among `apart`, or else
    a changed place beside it, if it is not among `far`.

    Examples
    --------
    >>> from hybridnav.online import replay
    >>> grid = hn.OccupancyGrid(np.zeros((8, 8)), hn.Frame(0.25), robot_radius_m=0)
    >>> first, second = replay([grid, grid])
    >>> second.place_flips.cells, second.place_flips.free
    (0, 64)
    """

    cells: int
    """Cells that flip."""
    merged: int
    """Those of them whose place is no more, and lies for the most part in one other place."""
    cut_off: int
    """Those whose place still has its number, elsewhere."""
    free: int
    """Cells that stay free."""
    untouched: frozenset[int]
    """Numbers of untouched places."""
    flipped: frozenset[int]
    """Those of them that flip."""
    apart: frozenset[int]
    """Untouched places with no changed cell beside one of their cells, at a side or a corner."""
    far: frozenset[int]
    """Those of them that have no boundary with a place that is touched."""


class Numbered(NamedTuple):
    """Cells with the numbers of their places, regions or rooms."""

    grid: OccupancyGrid
    """Their map."""
    classes: ByteArray
    """uint8 (rows, cols), `CellClass`, of the robot for places and regions, measured for rooms."""
    number_of: IntArray
    """int32 (rows, cols), -1 for none."""


def flips_between(before: Numbered, after: Numbered) -> Flips:
    """Compare the numbers of cells of two versions; see `Flips`."""
    shift = shift_of(before.grid, after.grid, otherwise="begin a new replay")
    shape = after.grid.shape
    number_of = placed(before.number_of, shape, shift, -1)
    classes = placed(before.classes, shape, shift, CellClass.OCCUPIED)
    old = np.where(classes == CellClass.FREE, number_of, np.int32(-1))
    now, changed = after.number_of, classes != after.classes
    inside, stays = old >= 0, (classes == CellClass.FREE) & ~changed
    n_numbers = int(max(number_of.max(initial=0), now.max(initial=0))) + 1
    areas = np.bincount(old[inside], minlength=n_numbers)
    kept = np.bincount(old[inside & stays], minlength=n_numbers)
    same = np.bincount(old[inside & (old == now)], minlength=n_numbers)
    moved = np.flatnonzero(inside & stays & (old != now) & (2 * kept > areas)[old])
    merged, cut_off = _causes(old.ravel()[moved], now.ravel()[moved], areas, now)
    untouched = (areas > 0) & (kept == areas)
    apart = untouched & ~_meets(old, _widened(changed), n_numbers)
    touched = _meets(number_of, changed, n_numbers)
    far = apart & ~_beside(number_of, touched)
    return Flips(
        len(moved),
        merged,
        cut_off,
        int(np.count_nonzero(stays)),
        _numbers(untouched),
        _numbers(untouched & (2 * same <= areas)),
        _numbers(apart),
        _numbers(far),
    )


def _causes(old: IntArray, new: IntArray, areas: LongArray, now: IntArray) -> tuple[int, int]:
    """Return how many cells flip as their places merge, and as they are cut off."""
    is_now = np.zeros(len(areas), np.bool_)
    is_now[now[now >= 0]] = True
    pairs, _, _, cells = unique_rows(np.stack([old, new], axis=1))
    is_cut = is_now[pairs[:, 0]]
    is_merged = ~is_cut & (2 * cells > areas[pairs[:, 0]])
    return int(cells[is_merged].sum()), int(cells[is_cut].sum())


def _meets(number_of: IntArray, cells: BoolArray, n_numbers: int) -> BoolArray:
    """Return which numbers some cells have, bool (n_numbers,)."""
    found = np.zeros(n_numbers, np.bool_)
    found[number_of[cells & (number_of >= 0)]] = True
    return found


def _widened(cells: BoolArray) -> BoolArray:
    """Return cells and those beside them, at a side or a corner."""
    tall = cells.copy()
    tall[1:] |= cells[:-1]
    tall[:-1] |= cells[1:]
    wide = tall.copy()
    wide[:, 1:] |= tall[:, :-1]
    wide[:, :-1] |= tall[:, 1:]
    return wide


def _beside(number_of: IntArray, numbers: BoolArray) -> BoolArray:
    """Return which numbers have a boundary with one of some numbers."""
    found = np.zeros(len(numbers), np.bool_)
    pairs = (number_of[1:], number_of[:-1]), (number_of[:, 1:], number_of[:, :-1])
    for one, other in pairs:
        apart = (one != other) & (one >= 0) & (other >= 0)
        for some, others in ((one[apart], other[apart]), (other[apart], one[apart])):
            found[some[numbers[others]]] = True
    return found


def _numbers(of: BoolArray) -> frozenset[int]:
    return frozenset(np.flatnonzero(of).tolist())
