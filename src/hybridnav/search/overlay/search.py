"""The overlay of a map in use: prepared from levels of its pyramid as fields, and searched for
paths of least cost.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.threads import Pool
from hybridnav.errors import HybridNavError, InvalidValueError
from hybridnav.maps.checks import checked_type
from hybridnav.search.overlay.build import TOP_BYTES_PER_CELL, Overlay, build_overlay
from hybridnav.search.overlay.kernels import queries as kernels
from hybridnav.search.overlay.kernels.lanes import FAR, NO_PATH
from hybridnav.search.overlay.layout import NodeWork
from hybridnav.topology import TopologicalMap

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.pyramid import DualGraphPyramid

_LEAST_GROWTH = 3
"""Least factor between the sizes of fields of two levels: closer levels save nothing."""
_LEVELS_WITHOUT_TABLES = 2
"""The finest levels, which keep none from their border cells to those below."""
_LEAST_FIELDS = 4
"""Fields above the finest hold at most this part of the cells: fewer fields save nothing either."""


@dataclass(frozen=True)
class OverlayOptions:
    """The sizes with which `prepare_overlay` chooses levels.

    The defaults suit maps of buildings with cells of 5 cm. Every choice yields paths of least cost:
    options move time and memory alone.

    Parameters
    ----------
    field_cells
        Cells of the fields of each level of the overlay, the finest first, rising: the highest
        level of the pyramid on which a cell lies, on average, in a field of at most so many. The
        first speeds up preparation, changes, and the way from the ends of a path to the border of
        a field of the second. From the third on, a level of fields half as large is the last one
        where the costs over it fit.
    region_cells
        Most cells of the regions of the pyramid; see `DualGraphPyramid.with_regions`.
    top_bytes_per_cell
        Most bytes, for each cell that may be entered, of the costs over the last level. Where these
        take more, queries search the border cells.
    table_bytes_per_cell
        Most bytes, for each cell that may be entered, of all costs from the border cells of one of
        the coarser levels to those of the level below; about a third of them is stored. A level
        with more is left out: fields of open halls have long borders, and costs across them would
        fill the memory.

    Raises
    ------
    InvalidValueError
        When a number is out of its range.

    Examples
    --------
    >>> from hybridnav.search.overlay import OverlayOptions
    >>> OverlayOptions(field_cells=(500, 10_000)).region_cells
    80000
    """

    field_cells: tuple[int, ...] = (300, 2_000, 80_000, 1_000_000)
    region_cells: int = 80_000
    top_bytes_per_cell: float = TOP_BYTES_PER_CELL
    table_bytes_per_cell: float = 150.0

    def __post_init__(self) -> None:
        are_numbers = isinstance(self.field_cells, Iterable) and all(
            isinstance(cells, int | float) for cells in self.field_cells
        )
        rising = (
            are_numbers
            and self.field_cells[:1]
            and all(
                low < high
                for low, high in zip((0, *self.field_cells), self.field_cells, strict=False)
            )
        )
        if not rising:
            raise InvalidValueError(
                f"field_cells of an overlay is {self.field_cells!r:.60}, expected rising numbers "
                "of cells: leave it out for its default"
            )
        if not (isinstance(self.region_cells, int | np.integer) and self.region_cells > 0):
            raise InvalidValueError(
                f"region_cells of an overlay is {self.region_cells!r:.60}, expected a whole number "
                "of cells > 0: leave it out for its default"
            )
        for name in ("top_bytes_per_cell", "table_bytes_per_cell"):
            most = getattr(self, name)
            if not (isinstance(most, int | float | np.number) and most >= 0):
                raise InvalidValueError(
                    f"{name} of an overlay is {most!r:.60}, expected a number >= 0: leave it out "
                    "for its default"
                )


DEFAULT_OPTIONS = OverlayOptions()


def prepare_overlay(
    topology: TopologicalMap,
    factor: FloatArray | None = None,
    *,
    allow_unexplored: bool = False,
    options: OverlayOptions = DEFAULT_OPTIONS,
    progress: Progress = no_progress,
) -> Overlay:
    """Build the overlay of a map on levels of its pyramid, below and above the places.

    Parameters
    ----------
    topology
        The map; its pyramid goes on above the places.
    factor
        Any float (rows, cols), from 1 to 1000: a move costs its length times the mean of its two
        cells; None for 1 everywhere.
    allow_unexplored
        Whether unexplored cells may be entered.
    options
        Sizes.
    progress
        Called after each level with the number of steps done and of all.

    Returns
    -------
    Overlay
        Fields and costs, ready for `OverlaySearch`.

    Raises
    ------
    InvalidValueError
        When factors have another shape or are out of range, or corners may be cut.
    PathsTooLongError
        When a path inside one of the finest fields costs more than 16,000 cells.

    Examples
    --------
    >>> from hybridnav.search.overlay import OverlaySearch, prepare_overlay
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> search = OverlaySearch(prepare_overlay(topology))
    >>> search.path((8, 3), (8, 20)).cost_cells
    17.0
    """
    checked_type("options", options, OverlayOptions)
    if checked_type("topology", topology, TopologicalMap).grid.corner_cutting:
        raise InvalidValueError(
            "the grid lets paths cut corners, expected one without corner cutting: load the map "
            "without it, or search its cells"
        )
    enterable = topology.grid.enterable(allow_unexplored=allow_unexplored)
    return build_overlay(
        enterable,
        overlay_fields(topology.pyramid, enterable, options),
        factor,
        top_bytes=options.top_bytes_per_cell * max(int(enterable.sum()), 1),
        progress=progress,
    )


def overlay_fields(
    pyramid: DualGraphPyramid, enterable: BoolArray, options: OverlayOptions = DEFAULT_OPTIONS
) -> list[IntArray]:
    """Return the fields of the levels of a pyramid that suit an overlay, the finest first.

    Parameters
    ----------
    pyramid
        The pyramid of a map; it goes on above the places.
    enterable
        bool (rows, cols), cells that may be entered.
    options
        Sizes of the fields.

    Returns
    -------
    list
        int32 (rows, cols) each, at least one.
    """
    pyramid = pyramid.with_regions(options.region_cells)
    n_cells = int(enterable.sum())
    found: list[IntArray] = []
    before = 0.0
    for cells in options.field_cells:
        most = cells if not found else min(cells, n_cells / _LEAST_FIELDS)
        has_table = len(found) >= _LEVELS_WITHOUT_TABLES
        for size in (most / 2, most) if has_table else (most,):
            if before * _LEAST_GROWTH > size:
                continue
            field_of = _fields_of(pyramid, enterable, size)
            own = _typical_size(field_of[enterable])
            if own < _LEAST_GROWTH * before or not _fits(field_of, found, enterable, options):
                continue
            is_last = has_table and _fits_top(field_of, enterable, options)
            if is_last or size == most:
                found.append(field_of)
                before = own
            if is_last:
                return found
    return found


def _fields_of(pyramid: DualGraphPyramid, enterable: BoolArray, most: float) -> IntArray:
    """Return the fields of the highest level whose typical size is at most some number of cells."""
    sizes = [size.vertices for size in pyramid.stats.sizes]
    index = len(sizes) - 1
    while index > 0 and sizes[0] > most * sizes[index]:
        index -= 1
    while index > 0 and _typical_size(pyramid[index].field_of[enterable]) > most:
        index -= 1
    field_of: IntArray = pyramid[index].field_of
    return field_of


def _fits_top(fields: IntArray, enterable: BoolArray, options: OverlayOptions) -> bool:
    """Return whether the costs over a level take no more than they may, if it is the last one."""
    gates = int(_on_border(fields, enterable).sum()) / 2
    return 2 * gates**2 <= options.top_bytes_per_cell * int(enterable.sum())


def _fits(
    fields: IntArray, found: list[IntArray], enterable: BoolArray, options: OverlayOptions
) -> bool:
    """Return whether the tables of a level above others take no more than they may."""
    if len(found) < _LEVELS_WITHOUT_TABLES:
        return True
    size = int(fields.max()) + 1
    own = np.bincount(fields[_on_border(fields, enterable)], minlength=size)
    inner = np.bincount(fields[_on_border(found[-1], enterable)], minlength=size)
    return bool(4.0 * own @ inner <= options.table_bytes_per_cell * int(enterable.sum()))


def _on_border(fields: IntArray, enterable: BoolArray) -> BoolArray:
    """Return the cells beside whose sides another field begins."""
    border = np.zeros(fields.shape, dtype=np.bool_)
    for one, other in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        differs = (fields[one] != fields[other]) & enterable[one] & enterable[other]
        border[one] |= differs
        border[other] |= differs
    return border


def _typical_size(fields: IntArray) -> float:
    """Return the cells of the field in which a cell lies, on average over all cells."""
    counts = np.bincount(fields).astype(np.float64)
    return float((counts**2).sum() / max(counts.sum(), 1.0))


KERNEL = kernels.find_path
"""The kernel whose compiled form shows that a search was run before."""

_MOST_NEAR = 1_000_000
"""Most cells of the first search; its open list takes 80 bytes for each."""
_NEAR = 250
"""Cells of the first search where tables answer: a twentieth of the time of such a query."""
_NEAR_WHERE_STALE = 4_000
_NEAR_IN_HALLS = 256_000
_CELLS_A_NODE = 35
"""Half the cells that A* expands while a border cell is expanded."""
_SAMPLES, _TRIES = 16, 4_000

Cell = tuple[int, int]


@dataclass(frozen=True, eq=False)
class OverlayPath:
    """A path of least cost between two cells; its cells are None if there is none."""

    cells: LongArray | None
    """int64 (n, 2), (row, col) of the cells passed."""
    cost_cells: float
    """Cost of the path in cells, of the factors as given; infinite for none."""
    lower_bound_cells: float
    """No path costs less: the least cost in units of the rounded factors, which are not larger."""
    expanded: int
    """Cells that searches among cells expanded, near both ends or inside a field."""
    expanded_border_cells: int
    """Border cells that searches over cliques expanded."""


class _Work:
    """Work arrays of one query."""

    def __init__(self, n_cells: int, n_nodes: int) -> None:
        self.cells = np.full(n_cells, FAR, dtype=np.int32)
        self.nodes = NodeWork(
            distance=np.full(n_nodes, NO_PATH, dtype=np.int64),
            before=np.empty(n_nodes, dtype=np.int32),
            ahead=np.full(n_nodes, -1, dtype=np.int64),
            seen=np.empty(n_nodes, dtype=np.int32),
            counts=np.zeros(1, dtype=np.int64),
        )


@copies_alike
class OverlaySearch:
    """Search of an overlay; threads may share it, also while another one updates the overlay.

    Parameters
    ----------
    overlay
        Fields and costs.
    near_cells
        Cells that A* expands at most, >= 0, before fields are looked at: it settles pairs of cells
        that are close together in less time. Every number finds paths of least cost. None measures
        it on 16 pairs of cells: 250 where tables lead over the map; in open halls, where searches
        over border cells do, as many as take half their time, up to 256,000; and 4,000 at least
        while tables are stale.

    Raises
    ------
    InvalidValueError
        When `near_cells` is out of range.

    Examples
    --------
    >>> from hybridnav.search.overlay import OverlaySearch, build_overlay
    >>> free, factor = np.ones((3, 6), dtype=bool), np.ones((3, 6))
    >>> factor[1, 2:4] = 3.0
    >>> halves = np.arange(6, dtype=np.int32) // 3 + np.zeros((3, 1), dtype=np.int32)
    >>> overlay = build_overlay(free, [halves], factor)
    >>> path = OverlaySearch(overlay).path((1, 0), (1, 5))
    >>> round(path.cost_cells, 3), len(path.cells)
    (5.828, 6)
    >>> overlay.update(np.ones((3, 6)), changed=(1, 2, 2, 4))
    >>> OverlaySearch(overlay).path((1, 0), (1, 5)).cost_cells
    5.0
    """

    def __init__(self, overlay: Overlay, *, near_cells: int | None = None) -> None:
        if near_cells is not None and not (
            isinstance(near_cells, int | np.integer) and 0 <= near_cells <= _MOST_NEAR
        ):
            raise InvalidValueError(
                f"near_cells is {near_cells!r:.60}, expected a whole number from 0 to {_MOST_NEAR}:"
                " leave it out for its default"
            )
        self._overlay = overlay
        self._is_measured = near_cells is None
        self._near_cells = 0 if near_cells is None else int(near_cells)
        self._make_works()
        if self._is_measured:
            self._near_cells = self._measured_near()

    def _make_works(self) -> None:
        self._n_nodes = len(self._overlay.levels.cell_of)
        n_cells = self._overlay.shape[0] * self._overlay.shape[1]
        self._works = Pool(partial(_Work, n_cells, self._n_nodes))

    def _measured_near(self) -> int:
        """Return the cells of the first search, by the border cells of queries without it."""
        rng, cols = np.random.default_rng(0), self._overlay.shape[1]
        flat = rng.integers(self._overlay.shape[0] * cols, size=_TRIES)
        cells = filter(self._overlay.is_open, zip(*divmod(flat, cols), strict=True))
        sampled = list(islice(cells, 2 * _SAMPLES))
        pairs = zip(sampled[:_SAMPLES], sampled[_SAMPLES:], strict=False)
        found = [self._path(*pair, 0.0, 0) for pair in pairs]
        expanded = [path.expanded_border_cells for path in found if path.cells is not None]
        median = float(np.median(expanded)) if expanded else 0.0
        return min(_NEAR + round(_CELLS_A_NODE * median), _NEAR_IN_HALLS)

    def path(self, start: Cell, goal: Cell, *, epsilon: float = 0.0) -> OverlayPath:
        """Find a path of least cost between two cells that may be entered.

        Parameters
        ----------
        start, goal
            (row, col); there is no path from or to a closed cell.
        epsilon
            The search ends once no path can be cheaper by more than this part, finite, >= 0.

        Raises
        ------
        InvalidValueError
            When a cell is not on the map, or epsilon is out of range.
        """
        overlay = self._overlay
        if not 0 <= epsilon < math.inf:
            raise InvalidValueError(f"epsilon must be a finite number >= 0, got {epsilon!r:.80}")
        for cell in (start, goal):
            if not all(0 <= at < size for at, size in zip(cell, overlay.shape, strict=True)):
                raise InvalidValueError(
                    f"cell {cell} is not on the map of {overlay.shape} rows and columns"
                )
        is_stale = self._is_measured and not overlay.is_current
        near_cells = max(self._near_cells, _NEAR_WHERE_STALE) if is_stale else self._near_cells
        return self._path(start, goal, epsilon, near_cells)

    def _path(self, start: Cell, goal: Cell, epsilon: float, near_cells: int) -> OverlayPath:
        overlay = self._overlay
        cols = overlay.shape[1]
        ends = (int(start[0]) * cols + int(start[1]), int(goal[0]) * cols + int(goal[1]))
        with overlay.turn():
            if self._n_nodes != len(overlay.levels.cell_of):
                self._make_works()
            with self._works.lent() as work:
                cost, bound, cells, sums, expanded, expanded_nodes = kernels.find_path(
                    overlay.ground,
                    overlay.levels,
                    overlay.top,
                    ends,
                    float(epsilon),
                    near_cells,
                    work.cells,
                    work.nodes,
                )
            if cost == kernels.TORN:
                raise HybridNavError(
                    f"the stored costs of this overlay lead to no path from {start} to {goal} "
                    "although they state one: build it anew, and report this as a fault"
                )
            if cost >= NO_PATH:
                return OverlayPath(None, math.inf, math.inf, expanded, expanded_nodes)
            real = overlay.cost_of(cells, sums)
        return OverlayPath(cells, real, bound * overlay.cost_unit, expanded, expanded_nodes)
