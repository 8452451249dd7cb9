"""The multilevel overlay: fields, the costs inside them level by level, and their changes.

D. Delling, A. V. Goldberg, T. Pajor, R. F. Werneck: Customizable route planning, 2011. Fields do
not depend on costs; what depends on them is computed again when they change.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav._progress import no_progress
from hybridnav.costs.checks import MOST_FACTOR, UNIT_BITS
from hybridnav.errors import InvalidValueError
from hybridnav.overlay import _cost_kernels as kernels
from hybridnav.overlay.changes import change_in, fields_around
from hybridnav.overlay.layout import lay_out
from hybridnav.overlay.tables import (
    PathsTooLongError,
    compute_top,
    fill_cliques,
    fill_some,
    fill_tables,
)
from hybridnav.search.moves import legal_moves
from hybridnav.search.turns import Turns

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from contextlib import AbstractContextManager

    from hybridnav._progress import Progress
    from hybridnav._typing import AnyArray, BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.overlay.changes import Change, Window
    from hybridnav.overlay.layout import CellCosts, Levels, Top

_ONE = 1 << UNIT_BITS
"""Units of a factor of 1; a straight move over such cells costs twice as many."""
TOP_BYTES_PER_CELL = 50.0
"""Most bytes for each cell of the distances between the nodes of the last level, unless asked
otherwise."""
_SIDES = 4


@copies_alike
class Overlay:
    """Costs between the border cells of fields on several levels, exact at any time.

    `update` changes costs in a box of cells: the fields of the two finest levels that it touches
    get their new costs at once. The tables of the fields around them become stale: until `renew`,
    searches go through the levels below there, guided by the former tables as long as these are
    lower bounds. Updates wait until the searches of other threads have ended.

    Parameters
    ----------
    ground, levels
        Cells, and levels with the cliques of the finest fields.
    factor
        Float (rows, cols), the factors as given, None where `ground` has them exactly.
    top_bytes
        Most bytes of the distances between the nodes of the last level.
    """

    def __init__(
        self, ground: CellCosts, levels: Levels, factor: FloatArray | None, top_bytes: float
    ) -> None:
        self.ground = ground
        self.levels = levels
        self._factor = factor
        self.version = 0
        """How often costs have changed."""
        self.shape = (ground.moves.size // ground.cols, ground.cols)
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
        arrays: list[AnyArray] = [*self.ground[:3], *self.levels, self.top.distance]
        given = 0 if self._factor is None else self._factor.nbytes
        return sum(array.nbytes for array in arrays) + given

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
        flat = cell[0] * self.shape[1] + cell[1]
        return bool(self.ground.field_of[flat] >= 0 and self.ground.units[flat] > 0)

    def cost_of(self, cells: LongArray) -> float:
        """Return the cost of a path in cells, by the factors as given.

        Parameters
        ----------
        cells
            int64 (n, 2), (row, col) of the cells passed.
        """
        if self._factor is None:
            units = self.ground.units.reshape(self.shape)
            straight, diagonal = kernels.sums_along(units, cells)
            return float(straight + diagonal * math.sqrt(2.0)) * self.cost_unit
        is_straight = (np.diff(cells, axis=0) == 0).any(axis=1)
        length = np.where(is_straight, 1.0, math.sqrt(2.0))
        factor = self._factor[cells[:, 0], cells[:, 1]]
        return float((length * (factor[1:] + factor[:-1])).sum() / 2)

    def update(
        self,
        factor: FloatArray,
        *,
        closed: BoolArray | None = None,
        changed: tuple[int, int, int, int] | None = None,
    ) -> None:
        """Change the costs of the cells in a box; the next answer is exact for the new ones.

        Parameters
        ----------
        factor
            Any float (rows, cols), the factor of each cell, from 1 to 1000 where it may be entered.
        closed
            bool (rows, cols), cells that may not be entered for now, of those for which the overlay
            was built; None for none.
        changed
            First row, last row + 1, first column, last column + 1 of the box outside of which
            nothing is read; None for the whole map.

        Raises
        ------
        InvalidValueError
            When factors, closed cells or the box are not as described.
        PathsTooLongError
            When a path inside one of the finest fields costs more than 16,000 cells; nothing has
            changed then.
        """
        factor = _numbers(factor)
        rows, cols = self._box(changed)
        field_of = self.ground.field_of.reshape(self.shape)[rows, cols]
        shut = field_of < 0
        if closed is not None:
            closed = np.asarray(closed)
            if closed.shape != self.shape or closed.dtype != np.bool_:
                raise InvalidValueError(
                    f"closed has shape {closed.shape} and type {closed.dtype}: give one bool for "
                    f"each of {self.shape} cells"
                )
            shut = shut | closed[rows, cols]
        units = units_of(factor, self.shape, ~shut, (rows, cols))
        given = np.where(shut, 1.0, factor[rows, cols]).astype(np.float64)
        self._turns.alone(partial(self._take, (rows, cols), units, given))

    def _take(self, box: Window, units: IntArray, given: FloatArray) -> None:
        """Take new costs of a box of cells, in units and as given."""
        self._complete()
        change = change_in(self.ground, self.shape, box, units)
        self._begun = partial(self._take_anew, box, units, given)
        try:
            if len(change.touched):
                self._apply(change)
                self.version += 1
        except PathsTooLongError:
            self._begun = None
            raise
        self._set_given(box, given)
        self._begun = None

    def _set_given(self, box: Window, given: FloatArray) -> None:
        if self._factor is None and not _are_whole(given):
            self._factor = np.maximum(self.ground.units.reshape(self.shape), 1) / _ONE
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

    def _take_anew(self, box: Window, units: IntArray, given: FloatArray) -> None:
        """Take new costs of a box of cells, and compute all costs of fields anew."""
        ground, levels = self.ground, self.levels
        ground.units.reshape(self.shape)[box] = units
        is_open = (ground.field_of >= 0) & (ground.units > 0)
        moves = legal_moves(np.ascontiguousarray(is_open.reshape(self.shape)), False)
        ground.moves[:] = moves.ravel()
        self.ground = ground._replace(least_units=int(ground.units[is_open].min(initial=_ONE)))
        n_fields = int(levels.level_at[-1])
        finest = int(levels.level_at[1])
        fill_cliques(self.ground, levels, np.arange(finest, dtype=np.int32))
        whole = (0, self.shape[0], 0, self.shape[1])
        kernels.renew_moves(levels, self.ground, np.arange(n_fields, dtype=np.int32), whole)
        levels.is_stale[finest:] = True
        fill_tables(levels)
        self.top = compute_top(levels, self._top_bytes)
        self.version += 1
        self._set_given(box, given)

    def renew(self, progress: Progress = no_progress) -> None:
        """Compute all stale tables again, so that queries are as fast as before any update."""
        self._turns.alone(partial(self._renew, progress))
        n_steps = len(self.levels.level_at)
        progress(n_steps, n_steps)

    def _renew(self, progress: Progress) -> None:
        self._complete()
        if not self.is_current:
            fill_tables(self.levels, progress)
            self.top = compute_top(self.levels, self._top_bytes)

    def _box(self, changed: tuple[int, int, int, int] | None) -> tuple[slice, slice]:
        if changed is None:
            return slice(0, self.shape[0]), slice(0, self.shape[1])
        sides = tuple(changed) if isinstance(changed, tuple | list) else ()
        fits = len(sides) == _SIDES and all(isinstance(side, int | np.integer) for side in sides)
        if not fits or not (
            0 <= sides[0] <= sides[1] <= self.shape[0]
            and 0 <= sides[2] <= sides[3] <= self.shape[1]
        ):
            raise InvalidValueError(
                f"changed is {changed!r:.80}: give first row, last row + 1, first column, last "
                f"column + 1 inside {self.shape} cells"
            )
        return slice(int(sides[0]), int(sides[1])), slice(int(sides[2]), int(sides[3]))

    def _apply(self, change: Change) -> None:
        """Bring costs up to date, those that a change touches, and mark the tables around them."""
        ground, levels = self.ground, self.levels
        units, moves = ground.units.reshape(self.shape), ground.moves.reshape(self.shape)
        before = units[change.window].copy(), moves[change.window].copy()
        units[change.window], moves[change.window] = change.units, change.moves
        try:
            fill_cliques(ground, levels, change.touched)
        except PathsTooLongError:
            units[change.window], moves[change.window] = before
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
            fill_some(levels, fields)
        nodes = [
            np.arange(levels.node_at[field], levels.node_at[field + 1], dtype=np.int32)
            for field in lowered[-1]
        ]
        all_lowered = np.unique(np.concatenate([self.top.lowered, *nodes]))
        self.top = self.top._replace(is_current=False, lowered=all_lowered)


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
        Most bytes of the distances between the border cells of the last level: with more, queries
        search these nodes. None for 50 for each cell that may be entered.
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
    >>> from hybridnav.overlay import OverlaySearch, build_overlay
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
    given = np.ones(enterable.shape) if factor is None else _numbers(factor)
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
    overlay = Overlay(ground, levels, None if _are_whole(kept) else kept, top_bytes)
    overlay.renew(progress)
    return overlay


def units_of(
    factor: FloatArray, shape: tuple[int, int], enterable: BoolArray, box: tuple[slice, slice]
) -> IntArray:
    """Return the factors of the cells in a box in units, rounded down, 0 where not enterable.

    Parameters
    ----------
    factor
        Any float (rows, cols).
    shape
        Rows and columns of the map.
    enterable
        bool, the cells of the box that may be entered.
    box
        Its rows and columns.

    Raises
    ------
    InvalidValueError
        When the shape is another one, or a factor of a cell that may be entered is out of range.
    """
    if factor.shape != shape:
        raise InvalidValueError(
            f"factors have shape {factor.shape}, the map has {shape}: give one per cell"
        )
    own = np.where(enterable, factor[box], 1.0)
    if not ((own >= 1) & (own <= MOST_FACTOR)).all():
        bad = own[~((own >= 1) & (own <= MOST_FACTOR))][0]
        raise InvalidValueError(
            f"a factor of a free cell is {bad}, expected a number from 1 to {MOST_FACTOR:.0f}: "
            "close cells that must not be entered"
        )
    units: IntArray = np.where(enterable, np.floor(own * _ONE), 0).astype(np.int32)
    return units


def _numbers(factor: FloatArray) -> FloatArray:
    """Return factors as an array of floats.

    Raises
    ------
    InvalidValueError
        When they are no numbers, or rows differ in length.
    """
    try:
        array = np.asarray(factor)
    except ValueError:
        array = np.empty(0, dtype=np.bool_)
    if array.dtype.kind not in "iuf":
        raise InvalidValueError(
            f"factors are {factor!r:.60}, expected one number per cell: give an array of rows and "
            "columns"
        )
    return array


def _are_whole(factor: FloatArray) -> bool:
    """Return whether factors are whole units."""
    return bool((np.floor(factor * _ONE) == factor * _ONE).all())
