"""Versions made from dense pyramids, and dense pyramids from versions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.online.places import PLACE, PlaceTable
from hybridnav.online.state import State
from hybridnav.online.tiles import CELL, NO_PLACE, Box, Tiles
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.record import SURVIVES, BuildStats, Record

if TYPE_CHECKING:
    from hybridnav._typing import AnyArray, LongArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.pyramid import Linkage


class Settings(Protocol):
    """What a version of a pyramid was built from."""

    @property
    def grid(self) -> OccupancyGrid:
        """The map."""
        ...

    @property
    def merge_distance_m(self) -> float:
        """U_d in metres."""
        ...

    @property
    def linkage(self) -> Linkage:
        """The distance that stays below it."""
        ...

    @property
    def seed(self) -> int:
        """Breaks ties."""
        ...


def state_of(pyramid: DualGraphPyramid) -> State:
    """Return the first version of a pyramid, without the levels above its places."""
    level = pyramid[pyramid.place_level]
    record = pyramid.record.up_to(level.index)
    rows, cols = shape = pyramid.grid.shape
    cells = np.zeros(shape, CELL)
    end = record.vertex_end.reshape(shape)
    cells["class"], cells["end"], cells["place"] = pyramid.grid.classes, end, level.field_of
    cells["edges"] = record.edge_end.reshape(rows, cols, 2)
    row, col = np.nonzero((end > 0) & (end < SURVIVES))
    parent = record.vertex_parent.reshape(shape)[row, col]
    cells["parent"][row, col, 0] = parent // cols - row
    cells["parent"][row, col, 1] = parent % cols - col
    tiles = Tiles({})
    tiles.write(Box(0, 0, rows, cols), cells)
    tiles.close()
    table = np.zeros(level.n_vertices, PLACE)
    table["area"], table["cell"] = level.areas, level.cells
    table["box"] = level.boxes + np.array([0, 0, 1, 1])
    places = PlaceTable()
    places.write(range(level.n_vertices), table)
    places.close()
    n_ends = np.bincount(end.ravel(), minlength=SURVIVES + 1).astype(np.int64)
    return State(tiles, places, n_ends, level.n_vertices)


def pyramid_of(state: State, box: Box, settings: Settings) -> DualGraphPyramid:
    """Return a version as dense arrays.

    Parameters
    ----------
    state
        The version.
    box
        The cells of its grid among those of the tiles.
    settings
        Its grid, and what it was built with.
    """
    cells = state.tiles.read(box)
    differs = cells["class"] != settings.grid.classes
    if differs.any():
        row, col = np.argwhere(differs)[0].tolist()
        raise InvalidValueError(
            f"{int(differs.sum())} cells changed outside what the updates stated, the first at "
            f"row {row}, column {col}: pass changed=None to compare all cells"
        )
    _close_levels(cells, state.vertex_ends)
    record = _record_of(cells)
    record.vertex_parent[cells["place"].ravel() == NO_PLACE] = -1
    stats = BuildStats()
    pyramid = DualGraphPyramid(
        settings.grid,
        settings.merge_distance_m,
        settings.linkage,
        settings.seed,
        stats,
        None,
        record,
    )
    n_levels = int(np.count_nonzero(state.vertex_ends[1:SURVIVES])) + 1
    stats.tops.append(n_levels - 1)
    stats.sizes.extend(record.sizes(settings.grid.shape[1], n_levels))
    return pyramid


def _close_levels(cells: AnyArray, vertex_ends: LongArray) -> None:
    """Give the levels at which cells end the numbers 1, 2, ..."""
    levels = np.flatnonzero(vertex_ends[1:SURVIVES]) + 1
    new_level = np.arange(SURVIVES + 1, dtype=np.uint8)
    new_level[levels] = np.arange(1, len(levels) + 1)
    new_end = np.arange(SURVIVES + 1, dtype=np.uint8)
    new_end[2 * levels] = 2 * new_level[levels]
    new_end[2 * levels + 1] = 2 * new_level[levels] + 1
    cells["end"], cells["edges"] = new_level[cells["end"]], new_end[cells["edges"]]


def _record_of(cells: AnyArray) -> Record:
    """Return the record of a window, flat."""
    rows, cols = cells.shape
    steps = cells["parent"].astype(np.int32)
    parent = np.arange(rows * cols, dtype=np.int32).reshape(rows, cols)
    parent += steps[..., 0] * np.int32(cols) + steps[..., 1]
    return Record(
        cells["end"].ravel(),
        np.where(cells["end"] == SURVIVES, -1, parent).ravel().astype(np.int32),
        cells["edges"].ravel(),
    )
