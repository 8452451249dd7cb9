"""The project's own maps, generated: `python -m hybridnav.grid.worlds maps` writes their files."""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from hybridnav._files import replace_file
from hybridnav.errors import InvalidValueError, brief
from hybridnav.grid.frame import Frame
from hybridnav.grid.limits import MAX_CELLS
from hybridnav.grid.worlds_base import FREE, OCCUPIED, UNEXPLORED, World
from hybridnav.grid.worlds_office import office_world

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import ByteArray, PathLike

__all__ = ["World", "figure1_world", "main", "office_world", "tiled", "write_world"]

_LINK_M = 1.0
_LINK_WALL_CELLS = 2


def figure1_world() -> World:
    """Return two regions that meet twice, and a third inside one: a map after the paper's Fig. 1.

    The free region A fills the left, the unexplored region B the right of a walled area of 40 x
    30 cells. An obstacle lies across the line between them, so that A and B meet along two
    separate boundaries, above and below it; the unexplored island C lies inside A. There is no
    noise. With a robot radius of 0, a merge distance that spans the map and any linkage, the
    topological map has

    * 3 places: A (free), B and C (unexplored);
    * 4 arcs: two between A and B, one between A and C, and the self-loop of A round C;
    * 3 faces: two protected ones (the obstacle and the wall) and the face between the arc of C and
    the self-loop round it, so that V - E + F = 2.

    Returns
    -------
    World
        0.1 m cells, origin (0, 0).
    """
    row, col = np.indices((30, 40))
    # The line between A and B leans by one cell every four rows: no boundary is a straight one.
    cells = np.where(col < 19 + row // 4, FREE, UNEXPLORED)
    cells[(row - 15) ** 2 + (col - 9) ** 2 <= 18] = UNEXPLORED  # noqa: PLR2004
    cells[(row - 15) ** 2 + (col - 22) ** 2 <= 20] = OCCUPIED  # noqa: PLR2004
    cells[[0, -1], :] = OCCUPIED
    cells[:, [0, -1]] = OCCUPIED
    return World(cells[::-1], Frame(resolution_m=0.1), "figure1")


def tiled(world: World, *, rows: int, cols: int) -> World:
    """Return a large world of copies of a small one, joined by passages 1 m wide.

    A passage runs straight, along the line on which the free space of the two copies is nearest,
    through walls and unexplored margins, and has walls where it crosses unexplored ground. The
    connected space of all copies is connected.

    Parameters
    ----------
    world
        The world to repeat.
    rows, cols
        Number of copies along y and along x, >= 1.

    Returns
    -------
    World
        `rows * cols` times as many cells; the lower-left copy keeps its place in the map frame.

    Raises
    ------
    InvalidValueError
        When a count is below 1, the result would exceed `MAX_CELLS`, or the free space of the
        world is nowhere a passage wide.
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

    Parameters
    ----------
    world
        The world to write; equal worlds produce equal bytes.
    folder
        Target folder, created if it does not exist.
    name
        File name without an ending, of letters, digits, `_`, `-` and dots.

    Returns
    -------
    Path
        The YAML file.

    Raises
    ------
    InvalidValueError
        When the name is no plain file name.
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


def main(arguments: Sequence[str]) -> int:
    """Write the maps of the project into the folder that is the only argument."""
    if len(arguments) != 1:
        sys.stderr.write("usage: python -m hybridnav.grid.worlds FOLDER\n")
        return 2
    for world in (office_world(), figure1_world()):
        write_world(world, Path(arguments[0]) / world.name, world.name)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
