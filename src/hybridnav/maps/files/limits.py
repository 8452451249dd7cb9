"""Limits of the size of a map, checked before its cells are read."""

from __future__ import annotations

from hybridnav.errors import InvalidValueError, MapError
from hybridnav.maps import MAX_CELLS

_READING_BYTES = 16
"""Bytes per cell while a map is read and inflated; measured 13 of grey and 16 of colours with
opacity, on 16 million cells."""


_PLANNING_BYTES = 300
"""Most bytes per cell with pyramid and a search structure; measured 240 on 4 million free cells,
with the costliest one that there has been, exact costs between the border cells of fields."""


_GB = 1e9


def check_max_cells(max_cells: int) -> None:
    """Refuse a limit that is not a positive number of cells.

    Raises `InvalidValueError` when the limit is not positive.
    """
    if max_cells < 1:
        raise InvalidValueError(f"max_cells must be a positive number of cells, got {max_cells}")


def check_size(cols: int, rows: int, *, max_cells: int, where: str) -> None:
    """Refuse a map with more cells than a grid holds, or than the limit.

    `cols`, `rows`: as the header of the file states them; `where`: the file; the message begins
    with it. Raises `MapError` when there are more; the message states the cells, their memory, and
    the option.
    """
    cells = cols * rows
    if cells > MAX_CELLS:
        raise MapError(f"{where}: {cols} x {rows} cells, a grid holds at most {MAX_CELLS}")
    if cells > max_cells:
        raise MapError(
            f"{where}: {cols} x {rows} = {cells:,} cells, more than the limit of {max_cells:,}; "
            f"reading them takes about {_READING_BYTES * cells / _GB:.1f} GB of memory, planning "
            f"up to {_PLANNING_BYTES * cells / _GB:.1f} GB; raise the limit with "
            f"--max-cells {cells}, in Python max_cells"
        )
