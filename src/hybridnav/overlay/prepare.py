"""The overlay of a map: levels of its pyramid as fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._progress import no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.overlay.build import build_overlay

if TYPE_CHECKING:
    from hybridnav._progress import Progress
    from hybridnav._typing import BoolArray, FloatArray, IntArray
    from hybridnav.overlay.build import Overlay
    from hybridnav.pyramid import DualGraphPyramid
    from hybridnav.topology import TopologicalMap

_LEAST_GROWTH = 3
"""Least factor between the sizes of fields of two levels: closer levels save nothing."""
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
        a field of the second.
    region_cells
        Most cells of the regions of the pyramid; see `DualGraphPyramid.with_regions`.
    top_bytes_per_cell
        Most bytes, for each cell that may be entered, of the costs between all border cells of the
        last level. Where these take more, queries search the border cells.

    Raises
    ------
    InvalidValueError
        When a number is out of its range.

    Examples
    --------
    >>> from hybridnav.overlay import OverlayOptions
    >>> OverlayOptions(field_cells=(500, 10_000)).region_cells
    80000
    """

    field_cells: tuple[int, ...] = (300, 2_000, 80_000, 1_000_000)
    region_cells: int = 80_000
    top_bytes_per_cell: float = 50.0

    def __post_init__(self) -> None:
        are_numbers = all(isinstance(cells, int | float) for cells in self.field_cells)
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
        if not self.top_bytes_per_cell >= 0:
            raise InvalidValueError(
                f"top_bytes_per_cell of an overlay is {self.top_bytes_per_cell!r:.60}, expected a "
                "number >= 0: leave it out for its default"
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
    >>> from hybridnav.overlay import OverlaySearch, prepare_overlay
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> search = OverlaySearch(prepare_overlay(topology))
    >>> search.path((8, 3), (8, 20)).cost_cells
    17.0
    """
    if topology.grid.corner_cutting:
        raise InvalidValueError("an overlay needs a grid without corner cutting")
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
    sizes = [size.vertices for size in pyramid.stats.sizes]
    found: list[IntArray] = []
    before = 0.0
    for cells in options.field_cells:
        most = cells if not found else min(cells, int(enterable.sum()) / _LEAST_FIELDS)
        if before * _LEAST_GROWTH > most:
            continue
        index = len(sizes) - 1
        while index > 0 and sizes[0] > most * sizes[index]:
            index -= 1
        field_of = pyramid[index].field_of
        size = _typical_size(field_of[enterable])
        while index > 0 and size > most:
            index -= 1
            field_of = pyramid[index].field_of
            size = _typical_size(field_of[enterable])
        if size >= _LEAST_GROWTH * before:
            found.append(field_of)
            before = size
    return found


def _typical_size(fields: IntArray) -> float:
    """Return the cells of the field in which a cell lies, on average over all cells."""
    counts = np.bincount(fields).astype(np.float64)
    return float((counts**2).sum() / max(counts.sum(), 1.0))
