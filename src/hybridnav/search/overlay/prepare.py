"""The overlay of a map: levels of its pyramid as fields."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.progress import no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.maps.checks import checked_type
from hybridnav.search.overlay.build import TOP_BYTES_PER_CELL, build_overlay
from hybridnav.topology import TopologicalMap

if TYPE_CHECKING:
    from hybridnav._base.progress import Progress
    from hybridnav._base.typing import BoolArray, FloatArray, IntArray
    from hybridnav.pyramid import DualGraphPyramid
    from hybridnav.search.overlay.build import Overlay

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
