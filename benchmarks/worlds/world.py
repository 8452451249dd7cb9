"""Generated worlds: the pixels of a map file, their frame and their thresholds; their files."""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from hybridnav._base.copies import copies_alike
from hybridnav._base.files import replace_file
from hybridnav._base.typing import ByteArray, PathLike
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.maps.cells import MAX_CELLS

FREE = np.uint8(254)
UNEXPLORED = np.uint8(205)
OCCUPIED = np.uint8(0)
"""The three grey values that map_server writes."""

_LINK_M = 1.0
_LINK_WALL_CELLS = 2


@copies_alike
@dataclass(frozen=True, eq=False)
class World:
    """A generated map, as in a map_server file.

    `pixels`: grey values as in the image file, shape `(rows, cols)`, uint8: the top row, which has
    the highest y, comes first. 0 is occupied, 205 unexplored, 254 free; copied; `frame`: resolution
    and pose of the map; cell (0, 0) is the lower-left pixel; `name`: name of the map in messages
    and pictures; `free_threshold`, `occupied_threshold`: U1 and U2 of the paper: `free_thresh` and
    `occupied_thresh` of the map file. Raises `InvalidValueError` when the pixels are no
    two-dimensional uint8 array.
    """

    pixels: ByteArray
    frame: Frame
    name: str
    free_threshold: float = 0.196
    occupied_threshold: float = 0.65

    def __post_init__(self) -> None:
        pixels = np.array(self.pixels, order="C")
        if pixels.dtype != np.uint8 or pixels.ndim != 2:
            raise InvalidValueError(
                "the pixels of a world must be a two-dimensional uint8 array, "
                f"got {pixels.dtype} of shape {pixels.shape}"
            )
        pixels.flags.writeable = False
        object.__setattr__(self, "pixels", pixels)

    def grid(self, *, robot_radius_m: float | None = None) -> OccupancyGrid:
        """Return the occupancy grid of the world, with the same classes as its loaded map file.

        `robot_radius_m`: radius in metres by which occupied cells are inflated, 0 for a robot that
        is a point; None as in `OccupancyGrid`. Probabilities are `1 - pixel / 255`, row 0 at
        the lowest y. Raises `InvalidValueError` when the radius is negative or not finite.
        """
        darkness = ((255 - np.arange(256)) / 255).astype(np.float32)
        return OccupancyGrid(
            darkness[self.pixels[::-1]],
            self.frame,
            free_threshold=self.free_threshold,
            occupied_threshold=self.occupied_threshold,
            robot_radius_m=robot_radius_m,
            name=self.name,
        )


def tiled(world: World, *, rows: int, cols: int) -> World:
    """Return a large world of copies of a small one, joined by passages 1 m wide.

    A passage runs straight, along the line on which the free space of the two copies is nearest,
    through walls and unexplored margins, and has walls where it crosses unexplored ground. The
    connected space of all copies is connected.

    `world`: the world to repeat; `rows`, `cols`: number of copies along y and along x, >= 1.
    The lower-left copy keeps its place in the map frame.
    Raises `InvalidValueError` when a count is below 1, the result would exceed `MAX_CELLS`, or the
    free space of the world is nowhere a passage wide.
    """
    if rows < 1 or cols < 1 or rows * cols * world.pixels.size > MAX_CELLS:
        raise InvalidValueError(
            f"tiles must be at least 1 x 1 and have at most {MAX_CELLS} cells together, got "
            f"{rows} x {cols} of {world.pixels.size} cells"
        )
    height, width = world.pixels.shape
    pixels = np.tile(world.pixels, (rows, cols))
    tiles = pixels.reshape(rows, height, cols, width)
    turned = tiles.transpose(2, 3, 0, 1)
    link_cells = max(1, round(_LINK_M / world.frame.resolution_m))
    if cols > 1:
        _join(tiles, world.pixels, link_cells)
    if rows > 1:
        _join(turned, world.pixels.T, link_cells)
    return World(
        pixels,
        world.frame,
        f"{world.name} {rows} x {cols}",
        world.free_threshold,
        world.occupied_threshold,
    )


def _join(tiles: ByteArray, pixels: ByteArray, link_cells: int) -> None:
    """Cut the passages between neighbours along the last axis of `(rows, height, cols, width)`."""
    first, left, right = _nearest_link(pixels, link_cells)
    last = first + link_cells
    for margin in (tiles[:, :, 1:, :left], tiles[:, :, :-1, right:]):
        margin[:, first:last] = FREE
        for wall in (
            margin[:, first - _LINK_WALL_CELLS : first],
            margin[:, last : last + _LINK_WALL_CELLS],
        ):
            wall[wall == UNEXPLORED] = OCCUPIED


def _nearest_link(pixels: ByteArray, link_cells: int) -> tuple[int, int, int]:
    """Return the first row of the best passage, and the columns between which nothing is cut."""
    square = np.pad(pixels == FREE, (0, link_cells - 1))
    for axis in (0, 1):  # whether a free square of link_cells begins at the cell
        square = np.all(sliding_window_view(square, link_cells, axis=axis), axis=-1)
    end = max(0, square.shape[0] - link_cells - _LINK_WALL_CELLS + 1)
    inner = square[_LINK_WALL_CELLS:end]
    usable = inner.any(axis=1)
    if not usable.any():
        raise InvalidValueError(
            f"tiles need a free square with a side of {link_cells} cells to be joined at, "
            f"and {_LINK_WALL_CELLS} cells beside it for walls; this world has none"
        )
    left = inner.argmax(axis=1)
    right = inner.shape[1] - 1 - inner[:, ::-1].argmax(axis=1) + link_cells
    length = np.where(usable, left - right, pixels.shape[1])
    # Ragged walls make one row shorter than the next by chance; take the middle one of all that are
    # about as short, away from the corners of a room.
    short = np.flatnonzero(length <= length.min() + link_cells // 4)
    row = int(short[len(short) // 2])
    return row + _LINK_WALL_CELLS, int(left[row]), int(right[row])


def write_world(world: World, folder: PathLike, name: str) -> Path:
    """Write a world as a map_server map: `name.pgm` (binary) and `name.yaml`.

    `world`: the world to write; equal worlds produce equal bytes; `folder`: target folder, created
    if it does not exist; `name`: file name without an ending, of letters, digits, `_`, `-` and
    dots. Returns the YAML file. Raises `InvalidValueError` when the name is no plain file name.
    """
    if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_.-]*", name):
        raise InvalidValueError(
            f"a map's name must be a plain file name without an ending, got {brief(name)}"
        )
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    height, width = world.pixels.shape
    header = f"P5\n{width} {height}\n255\n".encode("ascii")
    replace_file(target / f"{name}.pgm", header + world.pixels.tobytes())
    frame = world.frame
    # Positional, because YAML reads 1e-05 as a string.
    resolution, x, y, yaw, occupied, free = (
        np.format_float_positional(value, trim="0")
        for value in (
            frame.resolution_m,
            *frame.origin_m,
            frame.yaw_rad,
            world.occupied_threshold,
            world.free_threshold,
        )
    )
    lines = (
        f"image: {name}.pgm",
        "mode: trinary",
        f"resolution: {resolution}",
        f"origin: [{x}, {y}, {yaw}]",
        "negate: 0",
        f"occupied_thresh: {occupied}",
        f"free_thresh: {free}",
    )
    path = target / f"{name}.yaml"
    replace_file(path, "".join(f"{line}\n" for line in lines).encode("ascii"))
    return path
