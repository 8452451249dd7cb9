"""The multilevel overlay: fields, the costs inside them level by level, and their changes.

D. Delling, A. V. Goldberg, T. Pajor, R. F. Werneck: Customizable route planning, 2011. Fields do
not depend on costs; what depends on them is computed again when they change.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import legal_moves
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.threads import Turns
from hybridnav.errors import InvalidValueError
from hybridnav.maps.costs.factors import UNIT_BITS
from hybridnav.search.overlay.changes import (
    ONE,
    Change,
    PathsTooLongError,
    are_whole,
    box_within,
    change_in,
    compute_top,
    fields_around,
    fill_cliques,
    fill_some,
    fill_tables,
    numbers_of,
    units_of,
)
from hybridnav.search.overlay.growth import Grown, grow
from hybridnav.search.overlay.kernels import costs as kernels
from hybridnav.search.overlay.kernels.gates import gates_of
from hybridnav.search.overlay.layout import CellCosts, Levels, Top, lay_out, slots_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.search.overlay.changes import Window

TOP_BYTES_PER_CELL = 10.0
"""Most bytes for each cell of the distances over the last level, unless asked otherwise."""


@copies_alike
class Overlay:
    """Costs between the border cells of fields on several levels, exact at any time.

    `update` changes costs in a box of cells: the fields of the two finest levels that it touches
    get their new costs at once. The tables of the fields around them become stale: until `renew`,
    searches go through the levels below there, guided by the former tables as long as these are
    lower bounds. Cells in no field that may be entered from then on join the nearest field, or
    become fields. Updates wait until the searches of other threads have ended.

    Parameters
    ----------
    ground, levels
        Cells, and levels with the cliques of the finest fields.
    factor
        Float (rows, cols), the factors as given, None where `ground` has them exactly.
    top_bytes
        Most bytes of the distances over the last level.
    """

    def __init__(
        self, ground: CellCosts, levels: Levels, factor: FloatArray | None, top_bytes: float
    ) -> None:
        self.ground = ground
        self.levels = levels
        self._factor = factor
        self._enterable: BoolArray | None = None
        """The cells that may be entered, None for those in fields."""
        self.version = 0
        """How often costs have changed."""
        self.shape = (ground.rows, ground.cols)
        self._top_bytes = top_bytes
        self.top: Top = compute_top(levels, -1.0)
        self._turns = Turns()
        self._begun: Callable[[], None] | None = None
        """The update that has begun and not ended; an interrupt leaves it here."""

    @property
    def cost_unit(self) -> float:
        """Cost in cells of one unit of the integer costs."""
        return 1 / (2 << UNIT_BITS)

    @property
    def memory_bytes(self) -> int:
        """Bytes of all arrays."""
        arrays: list[AnyArray] = [*self.ground[:4], *self.levels, *self.top[:3]]
        arrays += [array for array in (self._factor, self._enterable) if array is not None]
        return sum(array.nbytes for array in arrays)

    @property
    def is_current(self) -> bool:
        """Whether no table waits for `renew`."""
        return not self.levels.is_stale.any() and (
            self.top.is_current or self.top.distance.size == 0
        )

    def turn(self) -> AbstractContextManager[bool]:
        """Return the lock to hold during a search: it keeps updates away, not other searches.

        An update that was interrupted is completed first.
        """
        if self._begun is not None:
            self._turns.alone(self._complete)
        return self._turns.shared()

    def is_open(self, cell: tuple[int, int]) -> bool:
        """Return whether a path may enter a cell now."""
        # A call of `slots_of` would take as long as the search of cells close together.
        flat = int(cell[0]) * self.shape[1] + int(cell[1])
        slot = self.ground.block_at[flat >> kernels.BLOCK_BITS] + flat % (1 << kernels.BLOCK_BITS)
        return bool(self.ground.field_of[slot] >= 0 and self.ground.units[slot] > 0)

    def cost_of(self, cells: LongArray, sums: tuple[int, int]) -> float:
        """Return the cost of a path in cells, by the factors as given.

        Parameters
        ----------
        cells
            int64 (n, 2), (row, col) of the cells passed.
        sums
            Its sums of units; see `sums_along`.
        """
        if self._factor is None:
            straight, diagonal = sums
            return float(straight + diagonal * math.sqrt(2.0)) * self.cost_unit
        is_straight = (np.diff(cells, axis=0) == 0).any(axis=1)
        length = np.where(is_straight, 1.0, math.sqrt(2.0))
        factor = self._factor[cells[:, 0], cells[:, 1]]
        return float((length * (factor[1:] + factor[:-1])).sum() / 2)

    def update(
        self,
        factor: FloatArray,
        *,
        enterable: BoolArray | None = None,
        closed: BoolArray | None = None,
        changed: tuple[int, int, int, int] | None = None,
    ) -> None:
        """Change the costs of the cells in a box; the next answer is exact for the new ones.

        Parameters
        ----------
        factor
            Any float (rows, cols), the factor of each cell, from 1 to 1000 where it may be entered.
        enterable
            bool (rows, cols), cells that may be entered from now on; None for the same as before.
        closed
            bool (rows, cols), cells among them that may not be entered for now; None for none.
        changed
            First row, last row + 1, first column, last column + 1 of the box outside of which
            nothing is read; None for the whole map.

        Raises
        ------
        InvalidValueError
            When factors, cells or the box are not as described, or the overlay has no field that
            cells could join.
        PathsTooLongError
            When a path inside one of the finest fields costs more than 16,000 cells; nothing has
            changed then.
        """
        factor = numbers_of(factor)
        window = box_within(changed, self.shape)
        own = None
        if enterable is None:
            shut = ~self._entered(window)
        else:
            own = self._checked("enterable", enterable)[window]
            shut = ~own
        if closed is not None:
            shut = shut | self._checked("closed", closed)[window]
        units = units_of(factor, self.shape, ~shut, window)
        given = np.where(shut, 1.0, factor[window]).astype(np.float64)
        if (units > 0).any() and self.levels.level_at[-1] == 0:
            raise InvalidValueError("the overlay was built without a free cell: build another one")
        self._turns.alone(partial(self._take, window, units, given, own))

    def _entered(self, window: Window) -> BoolArray:
        """Return the cells in a window that may be entered, closed ones too."""
        if self._enterable is not None:
            return self._enterable[window]
        return self._in_fields(window)

    @property
    def _whole(self) -> Window:
        return slice(0, self.shape[0]), slice(0, self.shape[1])

    def _in_fields(self, window: Window) -> BoolArray:
        """Return the cells of a window that are in fields."""
        inside: BoolArray = self.ground.field_of[slots_of(self.ground, window)] >= 0
        return inside

    def _checked(self, name: str, cells: BoolArray) -> BoolArray:
        cells = np.asarray(cells)
        if cells.shape != self.shape or cells.dtype != np.bool_:
            raise InvalidValueError(
                f"{name} has shape {cells.shape} and type {cells.dtype}: give one bool for each "
                f"of {self.shape} cells"
            )
        return cells

    def _take(
        self, box: Window, units: IntArray, given: FloatArray, enterable: BoolArray | None
    ) -> None:
        """Take new costs of a box of cells, in units and as given, and the cells to enter."""
        self._complete()
        anew = partial(self._take_anew, box, units, given, enterable)
        added = ~self._in_fields(box) & (units > 0)
        if added.any():
            grown = grow(self.ground, self.levels, self.top, added, box)
            self._begun = partial(self._install_anew, grown, anew)
            self._install(grown)
        change = change_in(self.ground, self.shape, box, units)
        self._begun = anew
        try:
            if len(change.touched):
                self._apply(change)
                self.version += 1
        except PathsTooLongError:
            self._begun = None
            raise
        self._set_given(box, given, enterable)
        self._begun = None

    def _install(self, grown: Grown) -> None:
        """Take an overlay with more cells, and compute what is new of it."""
        if self._enterable is None:
            self._enterable = self._in_fields(self._whole)
        self.ground, self.levels, self.top = grown.ground, grown.levels, grown.top
        fill_cliques(grown.ground, grown.levels, grown.affected[0])
        for fields in grown.affected[1:2]:
            fill_some(grown.levels, fields)

    def _install_anew(self, grown: Grown, anew: Callable[[], None]) -> None:
        """Complete an update with more cells."""
        self._install(grown)
        anew()

    def _set_given(self, box: Window, given: FloatArray, enterable: BoolArray | None) -> None:
        if enterable is not None and (enterable != self._entered(box)).any():
            if self._enterable is None:
                self._enterable = self._in_fields(self._whole)
            self._enterable[box] = enterable
        if self._factor is None and not are_whole(given):
            units = self.ground.units[slots_of(self.ground, self._whole)]
            self._factor = np.maximum(units, 1) / ONE
        if self._factor is not None:
            self._factor[box] = given

    def _complete(self) -> None:
        """Complete an update that was interrupted."""
        begun = self._begun
        if begun is not None:
            try:
                begun()
            except PathsTooLongError:
                self._begun = None
                raise
            self._begun = None

    def _take_anew(
        self, box: Window, units: IntArray, given: FloatArray, enterable: BoolArray | None
    ) -> None:
        """Take new costs of a box of cells, and compute all costs of fields anew."""
        ground, levels = self.ground, self.levels
        ground.units[slots_of(ground, box)] = units
        is_open = (ground.field_of >= 0) & (ground.units > 0)
        whole = slots_of(ground, self._whole)
        ground.moves[whole] = legal_moves(np.ascontiguousarray(is_open[whole]), False)
        self.ground = ground._replace(least_units=int(ground.units[is_open].min(initial=ONE)))
        n_fields = int(levels.level_at[-1])
        finest = int(levels.level_at[1])
        fill_cliques(self.ground, levels, np.arange(finest, dtype=np.int32))
        window = (0, self.shape[0], 0, self.shape[1])
        kernels.renew_moves(levels, self.ground, np.arange(n_fields, dtype=np.int32), window)
        levels.is_stale[finest:] = True
        self.levels = fill_tables(levels)
        self.top = compute_top(self.levels, self._top_bytes)
        self.version += 1
        self._set_given(box, given, enterable)

    def renew(self, progress: Progress = no_progress) -> None:
        """Compute all stale tables again, so that queries are as fast as before any update."""
        self._turns.alone(partial(self._renew, progress))
        n_steps = len(self.levels.level_at)
        progress(n_steps, n_steps)

    def _renew(self, progress: Progress) -> None:
        self._complete()
        if not self.is_current:
            self.levels = fill_tables(self.levels, progress)
            self.top = compute_top(self.levels, self._top_bytes)

    def _apply(self, change: Change) -> None:
        """Bring costs up to date, those that a change touches, and mark the tables around them."""
        ground, levels = self.ground, self.levels
        slots = slots_of(ground, change.window)
        before = ground.units[slots], ground.moves[slots]
        ground.units[slots], ground.moves[slots] = change.units, change.moves
        try:
            fill_cliques(ground, levels, change.touched)
        except PathsTooLongError:
            ground.units[slots], ground.moves[slots] = before
            fill_cliques(ground, levels, change.touched)
            raise
        is_open = change.units > 0
        least = min(ground.least_units, int(change.units[is_open].min(initial=ground.least_units)))
        self.ground = ground._replace(least_units=least)
        rows, cols = change.window
        beside = np.concatenate(fields_around(levels, change.beside))
        window = (rows.start, rows.stop, cols.start, cols.stop)
        kernels.renew_moves(levels, self.ground, beside, window)
        touched = fields_around(levels, change.touched)
        for fields in touched[1:]:
            levels.is_stale[fields] = True
        lowered = fields_around(levels, change.lowered)
        for fields in lowered[1:]:
            levels.is_lowered[fields] = levels.is_stale[fields] | levels.is_lowered[fields]
        for fields in touched[1:2]:
            levels.is_newer[fields] = len(touched) > 2  # noqa: PLR2004 - a table is above
            fill_some(levels, fields)
        if self.top.distance.size > 0:
            near = gates_of(levels, self.top, lowered[-1])
            self.top = self.top._replace(lowered=np.union1d(self.top.lowered, near))
        self.top = self.top._replace(is_current=False)


def build_overlay(
    enterable: BoolArray,
    labels: Sequence[IntArray],
    factor: FloatArray | None = None,
    *,
    top_bytes: float | None = None,
    progress: Progress = no_progress,
) -> Overlay:
    """Build the overlay of some nested partitions of the cells.

    Parameters
    ----------
    enterable
        bool (rows, cols), the cells that paths may use.
    labels
        int32 (rows, cols) for each level, the finest first: the field of each of these cells, -1
        elsewhere; each field lies in one field of the next level.
    factor
        Any float (rows, cols), from 1 to 1000: a move costs its length times the mean of its two
        cells; None for 1 everywhere. Rounded down to 1 / 2^14.
    top_bytes
        Most bytes of the distances over the last level: with more, queries search its border cells.
        None for 10 for each cell that may be entered.
    progress
        Called after each level with the number of steps done and of all.

    Returns
    -------
    Overlay
        Fields and costs, ready for `OverlaySearch`.

    Raises
    ------
    InvalidValueError
        When fields are not nested, a cell is in no field, or a factor is out of range.
    PathsTooLongError
        When a path inside one of the finest fields costs more than 16,000 cells.

    Examples
    --------
    >>> from hybridnav.search.overlay import OverlaySearch, build_overlay
    >>> free = np.ones((4, 8), dtype=bool)
    >>> halves = np.arange(8, dtype=np.int32) // 4 + np.zeros((4, 1), dtype=np.int32)
    >>> overlay = build_overlay(free, [halves])
    >>> OverlaySearch(overlay).path((0, 0), (0, 7)).cost_cells
    7.0
    """
    if not labels:
        raise InvalidValueError(
            "an overlay was given no level: give the field of each cell on at least one"
        )
    for label in labels:
        if label.shape != enterable.shape or (label[enterable] < 0).any():
            raise InvalidValueError("every cell that may be entered must be in a field")
    given = np.ones(enterable.shape) if factor is None else numbers_of(factor)
    whole = slice(0, enterable.shape[0]), slice(0, enterable.shape[1])
    units = units_of(given, (enterable.shape[0], enterable.shape[1]), enterable, whole)
    moves = legal_moves(np.ascontiguousarray(enterable), False)
    inside = [np.where(enterable, label, -1) for label in labels]
    ground, levels = lay_out(moves, units, inside)
    fill_cliques(ground, levels, np.arange(levels.level_at[1], dtype=np.int32))
    progress(1, len(labels) + 1)
    if top_bytes is None:
        top_bytes = TOP_BYTES_PER_CELL * max(int(enterable.sum()), 1)
    kept = np.where(enterable, given, 1.0).astype(np.float64)
    factors = None if are_whole(kept) else kept
    overlay = Overlay(ground, levels, factors, top_bytes)
    overlay.renew(progress)
    return overlay
