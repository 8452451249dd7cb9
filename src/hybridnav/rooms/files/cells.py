"""The image beside a file of rooms: the room of each cell, exactly."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from hybridnav._base.typing import IntArray
from hybridnav.errors import MapError, MapNotFoundError, RoomsError, RoomsNotFoundError, brief
from hybridnav.maps import NO_ROOM, OccupancyGrid
from hybridnav.maps.files.image import read_raster
from hybridnav.rooms.files.entries import Read, signature_of

_KEY = "hybridnav rooms"
"""Keyword of the text in the image: numbers of the map and of the outlines of each room, in
hexadecimal digits."""


@dataclass(frozen=True, eq=False)
class CellImage:
    """The rooms of the outlines that nobody has changed since they were written."""

    label_of: IntArray
    """int32 (rows, cols), -1 for no room and where outlines have changed."""
    written: frozenset[int]
    """The fingerprints of these outlines."""


def cells_file(path: Path) -> Path:
    """Return the image that is written beside a file of rooms."""
    return path.resolve().with_suffix(".cells.png")


def image_of(
    label_of: IntArray, fingerprints: Sequence[Sequence[int]], grid: OccupancyGrid
) -> bytes:
    """Return a PNG of rooms; its top row is the map's last.

    `label_of`: int32 (rows, cols), -1 for no room; `fingerprints`: those of each room's outlines.
    """
    depth = np.min_scalar_type(len(fingerprints))
    parts = [",".join(f"{number:x}" for number in each) for each in fingerprints]
    info, stream = PngInfo(), BytesIO()
    info.add_text(_KEY, ";".join([f"{signature_of(grid):x}", *parts]))
    Image.fromarray((label_of[::-1] + 1).astype(depth)).save(stream, "PNG", pnginfo=info)
    return stream.getvalue()


def read_image(read: Read, grid: OccupancyGrid) -> CellImage:
    """Return the cells that the image of a file holds, none if it is one of another map.

    The cells of a room count while its outlines are all there, unchanged, under one name. Raises
    `RoomsNotFoundError` when there is no image, and `RoomsError` when it is damaged or none of
    rooms.
    """
    where = f"{read.where}: cells"
    instead = "or delete the line 'cells': the outlines alone then count"
    try:
        file = read.folder / str(read.cells)
        raster = read_raster(file, what=where, check_size=lambda _cols, _rows: None)
        signature, *parts = raster.text[_KEY].split(";")
        written = [[int(number, 16) for number in part.split(",")] for part in parts]
        is_of_map = int(signature, 16) == signature_of(grid)
    except MapNotFoundError as error:
        raise RoomsNotFoundError(f"{error}: copy it there, {instead}") from None
    except MapError as error:
        raise RoomsError(f"{error}, {instead}") from None
    except (KeyError, ValueError):
        problem = f"{brief(read.cells)} is no image that save_rooms has written"
        raise RoomsError(f"{where}: {problem}: name that one, {instead}") from None
    if not is_of_map or raster.level.shape != grid.shape:
        return CellImage(np.full(grid.shape, NO_ROOM, np.int32), frozenset())
    rooms_of: dict[int, list[int]] = {}
    for outline in read.outlines:
        rooms_of.setdefault(outline.fingerprint, []).append(outline.room)
    of_level = np.full(np.iinfo(raster.level.dtype).max + 1, NO_ROOM, np.int32)
    known: set[int] = set()
    for level, numbers in enumerate(written[: len(of_level) - 1], 1):
        rooms = [room for number in numbers for room in rooms_of.get(number, ())]
        if len(rooms) == len(numbers) and len(set(rooms)) == 1:
            of_level[level] = rooms[0]
            known.update(numbers)
    return CellImage(of_level[raster.level[::-1]], frozenset(known))
