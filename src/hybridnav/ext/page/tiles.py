"""Tiles: square pictures of a part of a map, at any halving of its size."""

from __future__ import annotations

import io
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass, field
from threading import Lock
from typing import Any, Literal

import numpy as np
from matplotlib import colormaps
from PIL import Image

from hybridnav._base.typing import BoolArray, ByteArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid, RoomLabels
from hybridnav.maps.costs import CostLayer
from hybridnav.pyramid import Level
from hybridnav.viz import style
from hybridnav.viz.moving import heights_of
from hybridnav.viz.places import colour_vertices
from hybridnav.viz.room_colours import colour_rooms

Theme = Literal["light", "dark"]

TILE = 256
"""Side of a tile in pixels."""
_MOST_KEPT = 400
"""Tiles of a layer that are kept, 0.26 MB each: a screen of 2560 pixels shows 70."""
_FREE, _UNEXPLORED, _BLOCKED, _OCCUPIED, _PLACES = range(5)
_UNEXPLORED_PLACES = _PLACES + len(style.PLACES)
_DARK = "#1c2126"
_DARK_GROUND = ("#23292f", "#3a4148", "#5b646d", "#dfe3e6")
_DARK_STRENGTH = 0.48
"""Share of its colour that a place keeps on a dark page."""
_COST_ALPHA = 215
_CLOSED_BY_COSTS = (123, 50, 148, 230)
_DECADE = 10.0
_BANDS = 24
"""Colours of heights."""


def palette(theme: Theme) -> ByteArray:
    """Return the colours of all indices of a layer, uint8 (n, 4), RGBA.

    Free, unexplored, blocked and occupied cells come first, then the colours of places and rooms,
    then those of unexplored places.
    """
    if theme == "light":
        ground = style.rgb(style.FREE, style.UNEXPLORED, style.BLOCKED, style.OCCUPIED)
        places = style.rgb(*style.PLACES, *style.UNEXPLORED_PLACES)
    else:
        ground = style.rgb(*_DARK_GROUND)
        full = style.rgb(*style.PLACES).astype(np.float64)
        dark = style.rgb(_DARK).astype(np.float64)
        mixed = np.round(dark + _DARK_STRENGTH * (full - dark)).astype(np.uint8)
        greys = style.rgb(*style.UNEXPLORED_PLACES).astype(np.int64)
        places = np.concatenate([mixed, (ground[1] + (greys - 206) // 2).astype(np.uint8)])
    colours = np.concatenate([ground, places])
    return np.concatenate([colours, np.full((len(colours), 1), 255, np.uint8)], axis=1)


@dataclass(eq=False)
class MapLayer:
    """A picture of a whole map by the index of a colour for each cell."""

    index: ByteArray
    """uint8 (rows, cols)."""
    tables: dict[Theme, ByteArray]
    """uint8 (n, 4), RGBA of each index."""
    _kept: OrderedDict[tuple[str, int, int, int], ByteArray] = field(default_factory=OrderedDict)
    _lock: Lock = field(default_factory=Lock)

    @property
    def n_zooms(self) -> int:
        """Number of sizes: the whole map fits into one tile of the last."""
        longest = max(self.index.shape)
        return 1 + max(0, int(np.ceil(np.log2(longest / TILE))))

    def png(self, zoom: int, row: int, col: int, theme: Theme, compress_level: int = 1) -> bytes:
        """Return a tile as PNG, its first row the one of the lowest y.

        `zoom`: how often the map is halved, from 0 to `n_zooms` - 1; `row`, `col`: number of the
        tile from the origin of the grid, in tiles. Raises `InvalidValueError` when there is no such
        tile.
        """
        self._check(zoom, row, col)
        with io.BytesIO() as file:
            picture = Image.fromarray(self._tile(zoom, row, col, theme))
            picture.save(file, "PNG", compress_level=compress_level)
            return file.getvalue()

    def _check(self, zoom: int, row: int, col: int) -> None:
        rows, cols = self.index.shape
        side = TILE << zoom if 0 <= zoom < self.n_zooms else 0
        if not (side and 0 <= row * side < rows and 0 <= col * side < cols):
            raise InvalidValueError(
                f"there is no tile {row}, {col} of size {zoom}: the map has {rows} x {cols} cells "
                f"in {self.n_zooms} sizes"
            )

    def _tile(self, zoom: int, row: int, col: int, theme: Theme) -> ByteArray:
        """Return RGBA of a tile, cropped at the rim of the map, uint8 (n, m, 4)."""
        side = TILE << zoom
        if zoom == 0:
            part = self.index[row * side : (row + 1) * side, col * side : (col + 1) * side]
            return self.tables[theme][part]
        key = (theme, zoom, row, col)
        with self._lock:
            tile = self._kept.get(key)
        if tile is None:
            tile = self._halved(zoom, row, col, theme)
            with self._lock:
                self._kept[key] = tile
                while len(self._kept) > _MOST_KEPT:
                    self._kept.popitem(last=False)
        return tile

    def _halved(self, zoom: int, row: int, col: int, theme: Theme) -> ByteArray:
        """Return the average of the four tiles of the next finer size."""
        half = TILE << (zoom - 1)
        rows, cols = self.index.shape
        quarters = [
            [self._tile(zoom - 1, r, c, theme) for c in (2 * col, 2 * col + 1) if c * half < cols]
            for r in (2 * row, 2 * row + 1)
            if r * half < rows
        ]
        whole = np.concatenate([np.concatenate(line, axis=1) for line in quarters])
        odd = [(0, side % 2) for side in whole.shape[:2]]
        even = np.pad(whole, [*odd, (0, 0)], mode="edge").astype(np.uint16)
        sums = even[::2, ::2] + even[1::2, ::2] + even[::2, 1::2] + even[1::2, 1::2]
        return ((sums + 2) // 4).astype(np.uint8)


def _layer(index: ByteArray) -> MapLayer:
    return MapLayer(index, {"light": palette("light"), "dark": palette("dark")})


def _ground(grid: OccupancyGrid) -> ByteArray:
    """Return the index of the colour of each cell by its class alone."""
    of_class = np.array([_BLOCKED, _FREE, _UNEXPLORED], dtype=np.uint8)
    index = of_class[grid.classes]
    index[grid.measured == CellClass.OCCUPIED] = _OCCUPIED
    return index


def map_layer(grid: OccupancyGrid) -> MapLayer:
    """Return the layer of the classes of cells."""
    return _layer(_ground(grid))


def level_layer(level: Level) -> MapLayer:
    """Return the layer of the fields of a level, neighbours in different colours."""
    colours = colour_vertices(level.arcs, level.n_vertices)
    first = np.where(level.classes == CellClass.FREE, _PLACES, _UNEXPLORED_PLACES)
    of_vertex = (colours + first).astype(np.uint8)
    index = _ground(level.grid)
    inside = level.field_of >= 0
    index[inside] = of_vertex[level.field_of[inside]]
    return _layer(index)


def rooms_layer(labels: RoomLabels, grid: OccupancyGrid) -> MapLayer:
    """Return the layer of the rooms, neighbours in different colours."""
    colours = colour_rooms(labels, grid)
    index = _ground(grid)
    measured = grid.measured
    for kind, first in ((CellClass.FREE, _PLACES), (CellClass.UNEXPLORED, _UNEXPLORED_PLACES)):
        inside: BoolArray = (measured == kind) & (labels.label_of != NO_ROOM)
        index[inside] = (colours[labels.label_of[inside]] + first).astype(np.uint8)
    return _layer(index)


def cost_table(closed: bool) -> ByteArray:  # noqa: FBT001 - a colour more or not
    """Return the colours of an overlay of costs, uint8 (256, 4): clear where a metre costs a
    metre."""
    share = np.linspace(0, 1, 255)
    table = np.zeros((256, 4), dtype=np.uint8)
    table[:255, :3] = np.round(colormaps["YlOrRd"](0.1 + 0.8 * share)[:, :3] * 255)
    table[:255, 3] = np.round(_COST_ALPHA * np.sqrt(share))
    if closed:
        table[255] = _CLOSED_BY_COSTS
    return table


def costs_layer(grid: OccupancyGrid, costs: CostLayer) -> tuple[MapLayer, float]:
    """Return the overlay of the costs of free cells, and the greatest factor."""
    free = grid.classes == CellClass.FREE
    most = float(costs.factors[free].max(initial=1.0))
    factors, span = np.clip(costs.factors, 1.0, most), max(most - 1, 1e-3)
    scale = np.log(factors) / np.log(most) if most > _DECADE else (factors - 1) / span
    index = np.round(scale * 254).astype(np.uint8)
    index[~free] = 0
    table = cost_table(costs.closed is not None)
    if costs.closed is not None:
        index[costs.closed & free] = 255
    return MapLayer(index, {"light": table, "dark": table}), most


def heights_layer(grid: OccupancyGrid, proof: dict[str, Any]) -> tuple[MapLayer, float]:
    """Return the overlay of the heights of a proof in bands, and the greatest; see
    `viz.plot_proof`."""
    metres, (row, col) = heights_of(grid, proof).metres, proof["box"][:2]
    most = float(np.nanmax(metres))
    index = np.zeros(np.add(grid.shape, 2), np.uint8)
    bands = np.nan_to_num(1 + np.clip(metres / most, 0, 1) * (_BANDS - 1))
    index[row : row + len(metres), col : col + metres.shape[1]] = bands
    table = np.zeros((_BANDS + 1, 4), np.uint8)
    table[1:] = np.round(colormaps["viridis"](np.linspace(0, 1, _BANDS)) * 255)
    return MapLayer(index[1:-1, 1:-1], {"light": table}), round(most, 1)


def hex_colours(theme: Theme) -> Sequence[str]:
    """Return the palette as `#rrggbb`, for a legend."""
    return [f"#{bytes(row[:3]).hex()}" for row in palette(theme)]
