"""Recorded paths as files: bags, tables, trajectories, lines, path lists. Public: `load_paths`."""

import csv
import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from hybridnav._base.extension import extension
from hybridnav._base.files import printable
from hybridnav._base.typing import FloatArray, PathLike
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError, brief
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.occupancy import extent

Unit = Literal["metres", "millimetres", "cells", "image", "matrix"]
UNITS: dict[Unit, str] = {
    "metres": "(x, y) in metres of the map frame",
    "millimetres": "(x, y) in millimetres of the map frame",
    "cells": "(column, row), row 0 at the lowest y",
    "image": "(column, row), row 0 at the top, as MovingAI counts",
    "matrix": "(row, column), row 0 at the top",
}
"""What the two numbers of a point may be; whole numbers of cells are their centres."""

_MOST_BYTES, _MOST_POINTS = 1 << 28, 5_000_000
_MOST_OUTSIDE, _LEAST_INSIDE, _MOST_IN_WALLS = 0.5, 0.9, 0.2
"""Shares of points: outside the map that make a path look wrong, inside that make another unit look
right, and in occupied cells that make a frame look wrong."""
_FEWEST_WHOLE = 3
"""Points from which on whole numbers alone look like cells."""
_BAGS = (".bag", ".mcap", ".db3")
_TIMES = {"t", "time", "times", "timestamp", "stamp", "sec", "secs", "seconds"}
_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_LATEST_S = 1e11
"""Seconds since 1970 beyond which a time is in another unit."""
_PAIR = re.compile(r"\(\s*(-?[\d.]+)\s*,\s*(-?[\d.]+)\s*(?:,[^()]*)?\)")


@dataclass(frozen=True, eq=False)
class RecordedPath:
    """A path as it was recorded.

    Examples
    --------
    >>> from hybridnav.harness import RecordedPath
    >>> path = RecordedPath("driven", np.array([[0.5, 0.5], [3.5, 0.5]]))
    >>> hn.judge(hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0), path.points).loss
    0.0
    """

    name: str
    """Name of the file, with the topic or the number of the path in it."""
    points: FloatArray
    """float64 (n, 2), n >= 1, `(x, y)` in metres, map frame."""
    times_s: FloatArray | None = None
    """float64 (n,), ascending seconds; None without times."""


def load_paths(  # noqa: PLR0913 - all but two have defaults
    path: PathLike,
    grid: OccupancyGrid,
    *,
    unit: Unit | None = None,
    frame: str | None = None,
    topic: str | None = None,
    columns: Sequence[str] | None = None,
) -> tuple[RecordedPath, ...]:
    r"""Read recorded paths. What may be meant otherwise is refused, with a question.

    Bags of ROS 1 and ROS 2 (.bag, .mcap, .db3, or a folder), by the extra `bags`: each
    `nav_msgs/Path` is a path. All poses of a topic of `Odometry`, `PoseStamped` or
    `PoseWithCovarianceStamped` are one. Tables (.csv) with names in their first line. TUM (8
    numbers a line) and KITTI (12 numbers a line), separated by blanks. GeoJSON (.geojson, .json),
    or an object a line (.geojsonl): each `LineString`. Arrays (.npy) of shape (n, 2), or more
    columns with `columns`. Path lists of grid benchmarks: a path a line, `(4,2)->(4,3)->`.

    Parameters
    ----------
    path
        The file.
    grid
        The map.
    unit
        What the two numbers of a point are, one of `UNITS`; None for metres, if nothing in the file
        looks otherwise.
    frame
        The frame of messages that is the map's; None for "map". Other frames are brought into it by
        the transforms of the bag.
    topic
        Topic of a bag; None for the only one with paths, or poses.
    columns
        Names, or numbers from 1, of the columns of x, y and, if there is one, time in seconds (or
        `_ms`, `_us`, `_ns` at the end of its name). None to find them by name. For TUM and KITTI
        "x", "y", "z": the two axes of the plane.

    Returns
    -------
    tuple of RecordedPath
        At least one.

    Raises
    ------
    MapNotFoundError
        When there is no such file.
    MapError
        When it cannot be read, or one must say more: unit, frame, topic or columns.
    InvalidValueError
        When there is no such unit.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import load_paths
    >>> _ = Path("driven.csv").write_text("t,x,y\n0,0.5,0.5\n2,1.5,0.5\n")
    >>> load_paths("driven.csv", hn.example_map("figure1"))[0].times_s
    array([0., 2.])
    """
    if unit is not None and unit not in get_args(Unit):
        known = ", ".join(get_args(Unit))
        raise InvalidValueError(f"unit is {brief(unit)}, expected one of {known}: take one")
    file, where = Path(path), f"path {printable(path)}"
    if not file.exists():
        raise MapNotFoundError(f"{where}: no such file")
    suffix = file.suffix.lower()
    recorded: Iterator[RecordedPath]
    if file.is_dir() or suffix in _BAGS:
        read = extension("formats", "bag").bag_paths
        each = read(file, topic=topic, frame=frame)
        recorded = (RecordedPath(name, *rest) for name, *rest in each)
    else:
        read = {".csv": _table, ".npy": _array, ".geojson": _lines, ".json": _lines}.get(
            suffix, _lines if suffix.endswith("jsonl") else _text
        )
        try:
            if file.stat().st_size > _MOST_BYTES:
                raise MapError(f"{where}: expected at most {_MOST_BYTES} bytes: split it")
            recorded = iter(read(file, where, columns))
        except (OSError, ValueError, LookupError, csv.Error, RecursionError) as error:
            if isinstance(error, MapError):
                raise
            raise MapError(f"{where}: cannot be read: {error!s:.100}") from None
    read_paths = tuple(_placed(each, grid, unit, where) for each in recorded)
    if not read_paths:
        raise MapError(f"{where}: no path in it, expected one at least")
    return read_paths


_OF_LIST = " path "
"""In the name of a path of a list of cells, whose unit no format states."""


def _placed(path: RecordedPath, grid: OccupancyGrid, unit: Unit | None, where: str) -> RecordedPath:
    """Return a path in metres of the map frame, checked."""
    at = f"{where}, {path.name}"
    points, times = path.points, path.times_s
    is_line = points.ndim == 2 and points.shape[1] == 2  # noqa: PLR2004
    if not (is_line and 0 < len(points) <= _MOST_POINTS and np.isfinite(points).all()):
        raise MapError(f"{at}: expected 1 to {_MOST_POINTS} points of finite numbers: mend it")
    if times is not None and (not np.isfinite(times).all() or (np.diff(times) < 0).any()):
        raise MapError(f"{at}: the times descend or are no numbers: sort its points by time")
    if times is not None and np.abs(times).max() > _LATEST_S:
        raise MapError(
            f"{at}: the times reach {np.abs(times).max():.3g}, too much for seconds: name the "
            "column of times so that it ends in _ms, _us or _ns, or leave it out by --columns x,y"
        )
    if unit is None:
        _ask(points, grid, at, is_list=_OF_LIST in path.name)
    return replace(path, points=_in_metres(points, grid, unit or "metres"))


def _in_metres(points: FloatArray, grid: OccupancyGrid, unit: Unit) -> FloatArray:
    if unit in {"metres", "millimetres"}:
        return points / (1000.0 if unit == "millimetres" else 1.0)
    cells = points if unit == "matrix" else points[:, ::-1]
    if unit != "cells":
        cells = np.stack([grid.shape[0] - 1 - cells[:, 0], cells[:, 1]], axis=1)
    return grid.frame.points_of(cells)


def _ask(points: FloatArray, grid: OccupancyGrid, at: str, *, is_list: bool) -> None:
    """Raise `MapError` where points do not look like metres of the map frame."""
    inside, walls = _met(points, grid)
    likely: list[Unit] = []
    for unit in get_args(Unit)[1:]:
        other, closed = _met(_in_metres(points, grid, unit), grid)
        if other >= _LEAST_INSIDE and closed <= _MOST_IN_WALLS:
            likely.append(unit)
    is_whole = len(points) >= _FEWEST_WHOLE and bool((points == np.round(points)).all())
    if is_list:
        what = "a list of cells may be (column, row) or (row, column)"
    elif 1 - inside > _MOST_OUTSIDE:
        what = f"{1 - inside:.0%} of its points lie outside the map, {extent(grid)}"
    elif is_whole:
        what = "all its numbers are whole, as those of cells"
    elif walls > _MOST_IN_WALLS:
        what = f"{walls:.0%} of its points lie in occupied cells, as in another frame"
    else:
        return
    looks = (
        f"; it may be {', or '.join(f'{one}, {UNITS[one]}' for one in likely)}" if likely else ""
    )
    raise MapError(
        f"{at}: {what}; expected {UNITS['metres']}{looks}: state --unit, metres if it is right, or "
        "bring it into the frame of the map"
    )


def _met(points: FloatArray, grid: OccupancyGrid) -> tuple[float, float]:
    """Return the share of points on a map, and of those the share in occupied cells."""
    cells = grid.frame.cells_of(points)
    on = ((cells >= 0) & (cells < grid.shape)).all(axis=1)
    walls = grid.measured[tuple(cells[on].T)] == CellClass.OCCUPIED
    return float(on.mean()), float(walls.mean()) if on.any() else 0.0


# Readers: each returns the paths of a file, in its own unit.


def _table(file: Path, where: str, columns: Sequence[str] | None) -> list[RecordedPath]:
    text = file.read_text("utf-8-sig")
    first = text.partition("\n")[0]
    delimiter = max(",;\t", key=first.count)
    head, *rows = [row for row in csv.reader(text.splitlines(), delimiter=delimiter) if row]
    names = [name.strip().lstrip("#%").strip() for name in head]
    if all(map(_is_number, names)):
        if columns is None:
            raise MapError(
                f"{where}: its first line is {brief(first)}, expected names of columns: state "
                "--columns, numbers from 1 of x, y and times"
            )
        rows.insert(0, head)
        names = [str(number + 1) for number in range(len(head))]
    chosen = _chosen(names, where) if columns is None else _named(names, columns, where)
    values = np.array([[row[k] for k in chosen] for row in rows], dtype=np.float64)
    values = values.reshape(-1, len(chosen))
    per_s = _PER_SECOND["s"]
    if len(chosen) > 2:  # noqa: PLR2004 - x, y, time
        ending = "ns" if head[chosen[2]].strip() == "%time" else names[chosen[2]].rpartition("_")[2]
        per_s = _PER_SECOND.get(ending.lower(), 1.0)
    times = values[:, 2] / per_s if len(chosen) > 2 else None  # noqa: PLR2004
    return [RecordedPath(file.stem, values[:, :2], times)]


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _parts(name: str) -> list[str]:
    """Return the parts of a column's name: `/odom/pose/pose/position/x` ends in `x`."""
    return [part for part in re.split(r"[^a-z0-9]+", name.lower()) if part]


def _chosen(names: list[str], where: str) -> list[int]:
    own_columns = []
    for axis in "xy":
        own = [k for k, name in enumerate(names) if _parts(name)[-1:] == [axis]]
        own = own or [k for k, name in enumerate(names) if _parts(name)[-2:] == [axis, "m"]]
        own = own or [
            k for k, name in enumerate(names) if name.lower() in {f"pos{axis}", f"p{axis}"}
        ]
        exact = [k for k in own if "position" in _parts(names[k]) or "pos" in _parts(names[k])]
        own_columns.append(own if len(own) == 1 else exact)
    if any(len(own) != 1 for own in own_columns):
        raise MapError(
            f"{where}: no one column is x, and one y, of {brief(names)}: state --columns, their "
            "names and that of the times"
        )
    times = [k for k, name in enumerate(names) if set(_parts(name)[-2:]) & _TIMES]
    return [own_columns[0][0], own_columns[1][0], *(times if len(times) == 1 else [])]


def _named(names: list[str], columns: Sequence[str], where: str) -> list[int]:
    """Return the columns that are named, or numbered from 1."""
    numbers = {str(number + 1): number for number in range(len(names))}
    picked = [
        names.index(name) if name in names else numbers.get(name) for name in map(str, columns)
    ]
    if len(picked) not in {2, 3} or None in picked:
        raise MapError(
            f"{where}: columns are {brief(list(columns))}, expected x, y and perhaps times of "
            f"{brief(names)}: name them"
        )
    return [number for number in picked if number is not None]


def _array(file: Path, where: str, columns: Sequence[str] | None) -> list[RecordedPath]:
    values = np.load(file, allow_pickle=False)
    if values.ndim != 2 or values.dtype.kind not in "iuf":  # noqa: PLR2004
        raise MapError(f"{where}: {values.dtype} of shape {values.shape}, expected points (n, 2)")
    names = [str(number + 1) for number in range(values.shape[1])]
    if columns is None and len(names) != 2:  # noqa: PLR2004
        raise MapError(
            f"{where}: its points have {len(names)} numbers, expected 2: state --columns, numbers "
            "from 1 of x, y and times"
        )
    chosen = [0, 1] if columns is None else _named(names, columns, where)
    values = values[:, chosen].astype(np.float64)
    return [RecordedPath(file.stem, values[:, :2], *values.T[2:])]


def _lines(file: Path, where: str, columns: Sequence[str] | None) -> list[RecordedPath]:
    del columns
    text = file.read_text("utf-8-sig")
    each = text.splitlines() if file.suffix.lower().endswith("jsonl") else [text]
    rows = [one for part in each if part.strip() for one in _coordinates(json.loads(part))]
    names = [file.stem] if len(rows) == 1 else [f"{file.stem} {k + 1}" for k in range(len(rows))]
    try:
        lines = [np.array([point[:2] for point in line], dtype=np.float64) for line in rows]
    except (TypeError, ValueError):
        raise MapError(f"{where}: expected LineStrings of positions [x, y]: mend it") from None
    return list(map(RecordedPath, names, lines))


def _coordinates(data: Any) -> Iterator[list[Any]]:
    """Yield the coordinates of all lines in an object of GeoJSON."""
    if not isinstance(data, dict):
        return
    kind, inner = data.get("type"), data.get("coordinates")
    if kind in {"LineString", "MultiLineString"} and isinstance(inner, list):
        yield from inner if kind == "MultiLineString" else [inner]
    for part in (
        data.get("geometry"),
        *(data.get("features") or ()),
        *(data.get("geometries") or ()),
    ):
        yield from _coordinates(part)


def _text(file: Path, where: str, columns: Sequence[str] | None) -> list[RecordedPath]:
    """Read a trajectory of TUM or KITTI, or a list of paths of cells."""
    lines = [line.strip() for line in file.read_text("utf-8-sig").splitlines()]
    rows = [line.split() for line in lines if line and not line.startswith("#")]
    if rows and all(_PAIR.search(line) for line in lines if line):
        cells = [[(float(a), float(b)) for a, b in _PAIR.findall(line)] for line in lines if line]
        return [
            RecordedPath(f"{file.stem}{_OF_LIST}{k}", np.array(each))
            for k, each in enumerate(cells)
        ]
    width = len(rows[0]) if rows else 0
    if width not in {8, 12} or any(len(row) != width for row in rows):
        raise MapError(
            f"{where}: lines of {width} words, expected 8 numbers (TUM) or 12 (KITTI), or a list "
            "(row,column)->: give a .csv with names of its columns"
        )
    values = np.array(rows, dtype=np.float64)
    is_tum = width == 8  # noqa: PLR2004
    xyz = values[:, 1:4] if is_tum else values[:, 3::4]
    flat = _plane(xyz, columns, where)
    return [RecordedPath(file.stem, xyz[:, flat], values[:, 0] if is_tum else None)]


_MOST_HEIGHT_M = 0.5
"""Metres that the third axis of a trajectory may span before one is asked which one it is."""


def _plane(xyz: FloatArray, columns: Sequence[str] | None, where: str) -> list[int]:
    """Return the two axes of a trajectory that are those of the map."""
    if columns is not None:
        if len(columns) != 2 or not set(columns) <= set("xyz"):  # noqa: PLR2004
            raise MapError(f"{where}: columns are {brief(list(columns))}, expected two of x, y, z")
        return ["xyz".index(axis) for axis in columns]
    spans = np.ptp(xyz, axis=0)
    if spans[2] > _MOST_HEIGHT_M or spans[2] > max(spans[:2]):
        raise MapError(
            f"{where}: it spans {spans[0]:.2f}, {spans[1]:.2f} and {spans[2]:.2f} m along x, y and "
            "z, expected a plane x, y: state --columns, such as x,z for a camera's frame"
        )
    return [0, 1]
