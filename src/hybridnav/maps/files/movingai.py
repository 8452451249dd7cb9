"""MovingAI benchmarks: octile maps and their scenarios."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from hybridnav._base.files import NewFile, printable
from hybridnav._base.typing import ByteArray, PathLike
from hybridnav._base.yaml_file import open_file
from hybridnav.errors import MapError, MapNotFoundError
from hybridnav.maps import DEFAULT_MAX_CELLS, CellClass, OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.maps.files.limits import check_max_cells, check_size

_PASSABLE = b".GS"
_BLOCKED = b"@OTW"
_INVALID = 2
_MAX_LINE = 256
_MAX_HEADER_LINES = 16
_MAX_SCENARIO_BYTES = 2**26
_COLUMNS = 9
_FREE_THRESHOLD, _OCCUPIED_THRESHOLD = 0.196, 0.65


@dataclass(frozen=True, slots=True)
class Scenario:
    """One problem of a scenario file.

    Parameters
    ----------
    bucket
        Length class of the benchmark: the optimum divided by 4, rounded down.
    map_name
        Name of the map in the file.
    rows, cols
        Size of the map that the problem was made for.
    start, goal
        Cells `(row, col)`; row 0 has the lowest y and is the last line of the map file.
    optimum_cells
        Length of a shortest octile path in cells, without corner cutting, as rounded in the file.
    """

    bucket: int
    map_name: str
    rows: int
    cols: int
    start: tuple[int, int]
    goal: tuple[int, int]
    optimum_cells: float


def load_movingai_map(
    path: PathLike,
    *,
    robot_radius_m: float | None = None,
    free_threshold: float | None = None,
    occupied_threshold: float | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> OccupancyGrid:
    r"""Load an octile map: cells of 1 m, the lower-left corner at (0, 0).

    Parameters
    ----------
    path
        The .map file. Its last line is row 0.
    robot_radius_m
        Radius in metres by which blocked cells are inflated; None is the default, 0.25 m. A radius
        below one cell, like the default, blocks no further cells.
    free_threshold, occupied_threshold
        U1 and U2 of the grid; every cell has the occupancy 0 or 1, so they do not change the
        classes.
    max_cells
        The most cells that the map may have; see `load_map`.

    Returns
    -------
    OccupancyGrid
        `.`, `G` and `S` are free; `@`, `O`, `T` and `W` occupied.

    Raises
    ------
    MapNotFoundError
        When the file is not there.
    MapError
        When the file is no such map, or holds too many cells; the text names the line.
    InvalidValueError
        When the radius, a threshold or the limit is out of range.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.maps.files import load_movingai_map
    >>> _ = Path("tiny.map").write_text("type octile\nheight 1\nwidth 3\nmap\n.@.\n")
    >>> load_movingai_map("tiny.map").classes
    array([[1, 0, 1]], dtype=uint8)
    """
    check_max_cells(max_cells)
    where = f"map {printable(path)}"
    with open_file(path, what="map", error=MapError, missing=MapNotFoundError) as stream:
        rows, cols, line = _read_header(stream, where)
        check_size(cols, rows, max_cells=max_cells, where=where)
        # Two bytes may end a line; a few more bytes than fit are read, to notice extra content.
        body = stream.read(rows * (cols + 2) + _MAX_LINE)
    occupied = _occupied(body, (rows, cols), line + 1, where)
    return OccupancyGrid(
        occupied[::-1].astype(np.float32),
        free_threshold=_FREE_THRESHOLD if free_threshold is None else free_threshold,
        occupied_threshold=(
            _OCCUPIED_THRESHOLD if occupied_threshold is None else occupied_threshold
        ),
        robot_radius_m=robot_radius_m,
        name=Path(path).stem,
    )


def _read_header(stream: BinaryIO, where: str) -> tuple[int, int, int]:
    """Return the rows, the columns and the number of the line `map`."""
    header: dict[bytes, bytes] = {}
    for number in range(1, _MAX_HEADER_LINES + 1):
        words = stream.readline(_MAX_LINE).split()
        if words == [b"map"]:
            if header.get(b"type") != b"octile":
                raise MapError(f"{where}: the header lacks 'type octile'")
            rows, cols = (_extent(header, key, where) for key in (b"height", b"width"))
            return rows, cols, number
        if len(words) == 2:  # noqa: PLR2004
            header[words[0]] = words[1]
        elif words:
            break
    raise MapError(
        f"{where}: not a MovingAI map, expected the header lines type, height, width and map"
    )


def _extent(header: dict[bytes, bytes], key: bytes, where: str) -> int:
    text = header.get(key, b"")
    if not (text.isdigit() and len(text) <= 9 and int(text) > 0):  # noqa: PLR2004
        raise MapError(
            f"{where}: the header must state a positive {key.decode()}, "
            f"got {text.decode('latin-1')!a}"
        )
    return int(text)


def _occupied(body: bytes, shape: tuple[int, int], first_line: int, where: str) -> ByteArray:
    """Return 1 for blocked and 0 for passable cells, the top row first."""
    rows, cols = shape
    body = body.replace(b"\r\n", b"\n").rstrip(b"\r\n") + b"\n"
    text = np.frombuffer(body, dtype=np.uint8)
    if text.size != rows * (cols + 1) or (text[cols :: cols + 1] != ord("\n")).any():
        raise MapError(f"{where}{_misfit(body, shape, first_line)}")
    table = np.full(256, _INVALID, dtype=np.uint8)
    table[np.frombuffer(_PASSABLE, dtype=np.uint8)] = 0
    table[np.frombuffer(_BLOCKED, dtype=np.uint8)] = 1
    cells: ByteArray = table[text.reshape(rows, cols + 1)[:, :cols]]
    if (cells == _INVALID).any():
        row, col = divmod(int(np.argmax(cells == _INVALID)), cols)
        character = ascii(chr(text[row * (cols + 1) + col]))
        expected = f"{(_PASSABLE + _BLOCKED).decode()}"
        raise MapError(
            f"{where}, line {first_line + row}: column {col + 1} holds {character}, "
            f"expected one of {expected}"
        )
    return cells


def _misfit(body: bytes, shape: tuple[int, int], first_line: int) -> str:
    rows, cols = shape
    lines = body[:-1].split(b"\n")
    for number, line in enumerate(lines[:rows], start=first_line):
        if len(line) != cols:
            return f", line {number}: {len(line)} characters, expected {cols} (the width)"
    count = f"at least {len(lines)}" if len(lines) > rows else f"only {len(lines)}"
    return f": {count} rows, expected {rows} (the height)"


def load_scenarios(path: PathLike, *, shape: tuple[int, int] | None = None) -> list[Scenario]:
    r"""Read a scenario file.

    Parameters
    ----------
    path
        The .scen file, version 1, or version 0, which may lack its first line and states no size of
        the map; columns separated by tabs or spaces.
    shape
        Rows and columns of the map, which a file of version 0 needs: it counts rows from the top.

    Returns
    -------
    list of Scenario
        In the order of the file.

    Raises
    ------
    MapNotFoundError
        When the file is not there.
    MapError
        When the file is no such file; the text names the line.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.maps.files import load_scenarios
    >>> _ = Path("tiny.scen").write_text("version 1\n0 tiny.map 3 1 0 0 2 0 2.0\n")
    >>> load_scenarios("tiny.scen")[0].goal
    (0, 2)
    """
    where = f"scenarios {printable(path)}"
    with open_file(path, what="scenarios", error=MapError, missing=MapNotFoundError) as stream:
        content = stream.read(_MAX_SCENARIO_BYTES + 1)
    if len(content) > _MAX_SCENARIO_BYTES:
        raise MapError(f"{where}: more than {_MAX_SCENARIO_BYTES} bytes")
    # Any byte is a character of latin-1; words that are no numbers are noticed below.
    lines = content.decode("latin-1").split("\n")
    first = lines[0].split()
    is_old = first in (["version", "0"], ["version", "0.0"])
    if len(first) == _COLUMNS - 2:  # HOG2's loader takes a file without a version for version 0
        is_old, lines = True, ["", *lines]
    elif not is_old and first not in (["version", "1"], ["version", "1.0"]):
        raise MapError(f"{where}, line 1: expected 'version 1', got {lines[0][:30]!a}")
    if is_old and shape is None:
        raise MapError(f"{where}: version 0 states no size of its map: state it as shape")
    size = shape if is_old else None
    scenarios = []
    for number, line in enumerate(lines[1:], start=2 if lines[0] else 1):
        if line.strip():
            try:
                scenarios.append(_parse(line, size))
            except ValueError as failure:
                raise MapError(f"{where}, line {number}: {failure}") from None
    return scenarios


def _parse(line: str, size: tuple[int, int] | None) -> Scenario:
    """Return the scenario of a line, which states the size of the map unless it is given."""
    expected = _COLUMNS if size is None else _COLUMNS - 2
    words = line.split("\t") if line.count("\t") == expected - 1 else line.split()
    if len(words) != expected:
        raise ValueError(f"{len(words)} columns, expected {expected}")
    if size is not None:
        words[2:2] = [str(size[1]), str(size[0])]
    bucket, cols, rows, x, y, goal_x, goal_y = (
        _natural(words[column]) for column in (0, 2, 3, 4, 5, 6, 7)
    )
    if not (x < cols and y < rows and goal_x < cols and goal_y < rows):
        raise ValueError(f"start or goal lies outside the map of {cols} x {rows}")
    try:
        optimum = float(words[8])
    except ValueError:
        optimum = math.nan
    if not (math.isfinite(optimum) and optimum >= 0):
        raise ValueError(f"expected a length in column {expected}, got {words[8][:30]!a}")
    start, goal = (rows - 1 - y, x), (rows - 1 - goal_y, goal_x)
    return Scenario(bucket, words[1].strip(), rows, cols, start, goal, optimum)


def _natural(word: str) -> int:
    text = word.strip()
    if not (text.isascii() and text.isdigit() and len(text) <= 9):  # noqa: PLR2004
        raise ValueError(f"expected a whole number, got {word[:30]!a}")
    return int(text)


def write_movingai_map(grid: OccupancyGrid, path: PathLike) -> None:
    """Write a map in the format of the MovingAI benchmarks, as `load_map` reads it.

    Free cells become `.`, all others `@`: the format has no unexplored cells. It has no frame
    either: a cell is 1 m wide when it is read again, and its corner lies at (0, 0). The robot's
    radius and dropped islands are no part of such a map: what was measured is written.

    Parameters
    ----------
    grid
        The map.
    path
        The file, ending in .map; one that exists is replaced.

    Raises
    ------
    InvalidValueError
        When the map is none.
    MapError
        When the name does not end so, or the file cannot be written.

    Examples
    --------
    >>> hn.write_movingai_map(hn.example_map("figure1"), "figure1.map")
    >>> hn.load_map("figure1.map").shape == hn.example_map("figure1").shape
    True
    """
    checked_type("grid", grid, OccupancyGrid)
    file = NewFile.named(path, "map", "a MovingAI map", (".map",))
    rows, cols = grid.shape
    letters = np.full((rows, cols + 1), ord("@"), dtype=np.uint8)
    letters[:, :-1][grid.measured == CellClass.FREE] = ord(".")
    letters[:, -1] = ord("\n")
    head = f"type octile\nheight {rows}\nwidth {cols}\nmap\n".encode()
    file.write(head + letters[::-1].tobytes())
