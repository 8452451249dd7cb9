"""The numbers that determine the portals of a map."""

from __future__ import annotations

from dataclasses import dataclass

from hybridnav.errors import InvalidValueError


@dataclass(frozen=True)
class PortalOptions:
    """The sizes and limits with which `prepare_portals` builds fields, portals and tables.

    The defaults suit maps of buildings with cells of 5 cm. Every choice yields shortest paths:
    options move time and memory alone.

    Parameters
    ----------
    least_regions
        Least number of regions: none has more than this part of the cells that may be entered.
        Fewer, larger regions have fewer border cells, but start and goal lie in the same one more
        often, which is then searched cell by cell.
    largest_field_factor
        A level is left out if a field has more than this many times the cells that a region may
        have: a place can be that large.
    spacing_cells
        Side of the lattice squares of portals where every border cell is a gate, in cells.
    all_border_cells_levels
        Number of levels to try with a gate at every border cell, before fewer gates: the regions,
        then those below.
    sparse_spacings_cells
        Sides of the lattice squares of portals and gates, in cells, to try in this order if a gate
        at every border cell takes too much memory: open floors have long borders.
    most_bytes_per_cell, most_sparse_bytes_per_cell
        Memory that portals and tables may take for each cell that may be entered: with a gate at
        every border cell, and with fewer.
    least_bytes
        Memory that portals and tables of any map may take.
    rows_at_once
        Rows of a table that are computed together: more take more memory meanwhile.
    dropped_bits
        Least number of bits that tables drop of every distance. With 0 they drop only as many as
        the longest path needs.

    Raises
    ------
    InvalidValueError
        When a number is out of its range.

    Examples
    --------
    >>> from hybridnav.portals import PortalOptions
    >>> PortalOptions(all_border_cells_levels=0, sparse_spacings_cells=(32,)).spacing_cells
    16
    """

    least_regions: int = 10
    largest_field_factor: int = 2
    spacing_cells: int = 16
    all_border_cells_levels: int = 2
    sparse_spacings_cells: tuple[int, ...] = (16, 32, 64, 128, 256)
    most_bytes_per_cell: float = 640.0
    most_sparse_bytes_per_cell: float = 160.0
    least_bytes: float = 16e6
    rows_at_once: int = 256
    dropped_bits: int = 0

    def __post_init__(self) -> None:
        for name, least in _WHOLE.items():
            self._check(name, _is_whole(getattr(self, name), least), f"a whole number >= {least}")
        for name in ("most_bytes_per_cell", "most_sparse_bytes_per_cell", "least_bytes"):
            self._check(name, _is_real(getattr(self, name)), "a number >= 0")
        self._check("dropped_bits", self.dropped_bits <= _MOST_BITS, f"at most {_MOST_BITS}")
        spacings = self.sparse_spacings_cells
        is_list = isinstance(spacings, tuple) and all(_is_whole(at, 2) for at in spacings)
        self._check("sparse_spacings_cells", is_list, "a tuple of whole numbers >= 2")

    def _check(self, name: str, holds: bool, expected: str) -> None:  # noqa: FBT001 - private
        if not holds:
            raise InvalidValueError(
                f"{name} of portals is {getattr(self, name)!r:.60}, expected {expected}: "
                "leave it out for its default"
            )


def _is_whole(value: object, least: int) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= least


def _is_real(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value >= 0


_WHOLE = {
    "least_regions": 1,
    "largest_field_factor": 1,
    "spacing_cells": 1,
    "all_border_cells_levels": 0,
    "rows_at_once": 1,
    "dropped_bits": 0,
}
"""The least of each whole number."""
_MOST_BITS = 30

DEFAULT_OPTIONS = PortalOptions()
