"""The numbers that portals are built with."""

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
    merge_distance_factor
        Merge distance of the fields by that of the places: fewer, larger fields route faster.
    least_fields
        With fewer large fields than this, half the merge distance is tried: a field is searched
        cell by cell where start and goal share it.
    spacing_cells
        Side of the lattice squares of portals where every border cell is a gate, in cells.
    all_gates_levels
        Levels that are tried with a gate at every border cell, before fewer gates are.
    sparse_spacings_cells
        Sides of the lattice squares of portals and gates, in cells, which are tried in this order
        where a gate at every border cell takes too much memory: open floors have long borders.
    most_bytes_per_cell, most_sparse_bytes_per_cell
        Memory that portals and tables may take for each cell that may be entered: with a gate at
        every border cell, and with fewer.
    least_bytes
        Memory that portals and tables of any map may take.
    rows_at_once
        Rows of a table that are computed together: more take more memory meanwhile.
    dropped_bits
        Bits that tables drop of every distance at least. 0 drops those alone that the longest path
        has too many of.

    Raises
    ------
    InvalidValueError
        When a number is out of its range.

    Examples
    --------
    >>> from hybridnav.portals import PortalOptions
    >>> PortalOptions(all_gates_levels=0, sparse_spacings_cells=(32,)).spacing_cells
    16
    """

    merge_distance_factor: float = 2.0
    least_fields: int = 16
    spacing_cells: int = 16
    all_gates_levels: int = 2
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
        factor = self.merge_distance_factor
        is_size = _is_real(factor) and 0 < factor <= _LARGEST_FACTOR
        self._check("merge_distance_factor", is_size, f"a number > 0 and <= {_LARGEST_FACTOR:g}")
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
    "least_fields": 1,
    "spacing_cells": 1,
    "all_gates_levels": 0,
    "rows_at_once": 1,
    "dropped_bits": 0,
}
"""The least of each whole number."""
_MOST_BITS = 30
_LARGEST_FACTOR = 1e6

DEFAULT_OPTIONS = PortalOptions()
