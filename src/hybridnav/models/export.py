"""Paths, rooms and places as CSV and GeoJSON, in metres of the map frame.

Each feature of GeoJSON has a property `feature`: path, room, door, place or arc.
"""

import csv
import io
import itertools
import json
import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from hybridnav._base.files import NewFile, printable
from hybridnav._base.typing import FloatArray, PathLike, SignArray
from hybridnav.errors import InvalidValueError
from hybridnav.guide import Tour
from hybridnav.maps import CellClass
from hybridnav.maps.checks import checked_type
from hybridnav.planning import PlanResult
from hybridnav.rooms import Door, Rooms
from hybridnav.topology import TopologicalMap

_DECIMALS = 6
_TABLE, _FEATURES, _PLAIN = ".csv", (".geojson",), ".json"
_POSE, _DRIVEN = ("x", "y", "yaw", "direction"), ("speed_m_s", "time_s")
_ROOM = ("room", "x", "y", "area_m2", "fits", "doors")
_PLACE = ("place", "x", "y", "class", "area_m2", "room")
_PATH_ENDINGS = (_TABLE, _PLAIN, *_FEATURES)
_MAP_ENDINGS = (_TABLE, *_FEATURES)


def export_path(
    outcome: PlanResult | Tour, path: PathLike, *, spacing_m: float = 0.05, frame: str = "map"
) -> None:
    """Write the path of a plan, or of all plans of a tour one after the other.

    CSV has a line of names and a line for each pose: x, y in metres, yaw in radians, and the
    direction. The direction is that in which the robot leaves it, 1 for ahead, -1 for backwards. No
    pose occurs twice in a row; a turn on the spot, and nothing else, is two poses at one point.
    With limits, which the preset `robot` has, follow `speed_m_s` and `time_s`, the seconds since
    the first pose of all. JSON is one object, with the `names` and a list of the same numbers for
    each pose. GeoJSON has a `LineString` for each plan, through the points of the path, or through
    the poses where the path is curved or has limits. Its properties are `headings_rad`, with limits
    `speed_m_s` and `time_s` too, `length_m`, `cost`, `metric`, `start`, `goal` and `preset`.
    Without a path there are no poses and no lines.

    Parameters
    ----------
    outcome
        The plan or tour.
    path
        The file, ending in .csv, .json or .geojson; one that exists is replaced.
    spacing_m
        Most metres between two poses.
    frame
        Name of the map frame, in GeoJSON.

    Raises
    ------
    InvalidValueError
        When the outcome is no plan, the spacing is out of range, or the frame has no name.
    MapError
        When the name ends otherwise, or the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> result = hn.HybridPlanner(topology).plan((0.5, 0.5), (1.5, 0.5))
    >>> hn.export_path(result, "path.csv", spacing_m=1.0)
    >>> print(Path("path.csv").read_text().strip())
    x,y,yaw,direction
    0.5,0.5,0.0,1
    1.5,0.5,0.0,1
    """
    results = outcome.results if isinstance(outcome, Tour) else (outcome,)
    for result in results:
        checked_type("outcome", result, PlanResult)
    file = _file(path, "a path", _PATH_ENDINGS, frame)
    planned = [result for result in results if result.path is not None]
    tracks, began_s = [], 0.0
    for result in planned:
        tracks.append(_poses(result, spacing_m, began_s))
        began_s += result.duration_s or 0.0
    if file.path.suffix.lower() in _FEATURES:
        lines = [_line(result, track) for result, track in zip(planned, tracks, strict=True)]
        file.write(_collection(lines, frame))
        return
    rows = _distinct(list(itertools.chain.from_iterable(tracks)))
    names = _POSE if results[0].limits is None else _POSE + _DRIVEN
    if file.path.suffix.lower() == _PLAIN:
        file.write((json.dumps({"names": names, "poses": rows}, allow_nan=False) + "\n").encode())
    else:
        file.write(_table(names, rows))


def export_rooms(
    rooms: Rooms,
    path: PathLike,
    *,
    tolerance_m: float = 0.05,
    frame: str = "map",
    everything: bool = False,
) -> None:
    """Write the rooms of a map, and their doors.

    CSV has a line for each room: its name, x and y of its point, the area of its free cells in m².
    Then follow whether the robot fits, and the numbers of its doors. GeoJSON has a `Polygon` or
    `MultiPolygon` for each room with the same properties, and a `Point` in each door, with its
    `number`, `rooms`, `kind`, `width_m`, `passage_m` and `passable`. Narrow rooms that the robot
    cannot enter, doors to them, and gaps are left out, as in lists.

    Parameters
    ----------
    rooms
        The rooms of a topological map, `topology.rooms`.
    path
        The file, ending in .csv or .geojson; one that exists is replaced.
    tolerance_m
        Corners go that cut off less than a square of this side, in metres.
    frame
        Name of the map frame, in GeoJSON.
    everything
        Whether to write rooms that are not listed and doors to them too; gaps are left out.

    Raises
    ------
    InvalidValueError
        When these are no rooms, the tolerance is not positive and finite, or the frame has no name.
    MapError
        When the name ends otherwise, a room has no free cell, or the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> labels = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    >>> hn.export_rooms(topology.rooms, "rooms.csv")
    >>> print(Path("rooms.csv").read_text().strip())
    room,x,y,area_m2,fits,doors
    kitchen,0.5,0.5,2.0,true,1
    hall,2.5,0.5,2.0,true,1
    """
    checked_type("rooms", rooms, Rooms)
    if not 0 < tolerance_m < math.inf:
        raise InvalidValueError(f"tolerance_m must be positive and finite, got {tolerance_m}")
    file = _file(path, "a file of rooms", _MAP_ENDINGS, frame)
    # These load scipy and shapely.
    from hybridnav.rooms.files.entries import Read  # noqa: PLC0415
    from hybridnav.rooms.files.outlines import outlines_of  # noqa: PLC0415
    from hybridnav.rooms.files.read import check_rooms  # noqa: PLC0415

    read = Read(f"rooms {printable(file.path)}", list(rooms.names))
    check_rooms(read, rooms.labels.label_of, rooms.grid)
    doors = [door for door in rooms.doors if not door.is_gap] if everything else rooms.listed_doors
    shown = [everything or is_listed for is_listed in rooms.is_listed.tolist()]
    known = [_room(rooms, label, doors) for label, is_one in enumerate(shown) if is_one]
    if file.path.suffix.lower() == _TABLE:
        file.write(_table(_ROOM, map(_texts, known)))
        return
    outlines = outlines_of(rooms.labels.label_of, len(rooms.names), rooms.grid, tolerance_m)
    features = [
        _feature({"feature": "room"} | room, _area(rings))
        for room, rings in zip(known, itertools.compress(outlines, shown), strict=True)
    ]
    file.write(_collection(features + [_door(door) for door in doors], frame))


def export_places(topology: TopologicalMap, path: PathLike, *, frame: str = "map") -> None:
    """Write the places of a topological map, and its arcs.

    CSV has a line for each place: its id, x and y of its surviving cell, its class, and its area in
    m². If the map was grown with rooms, its room follows. GeoJSON has a `Point` for each place with
    the same properties, and one in the middle of the boundary of each arc. An arc has its id as
    `arc`, its `places`, `max_distance_m` and `through_m`.

    Parameters
    ----------
    topology
        The map.
    path
        The file, ending in .csv or .geojson; one that exists is replaced.
    frame
        Name of the map frame, in GeoJSON.

    Raises
    ------
    InvalidValueError
        When this is no topological map, or the frame has no name.
    MapError
        When the name ends otherwise, or the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> hn.export_places(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), "places.csv")
    >>> print(Path("places.csv").read_text().strip())
    place,x,y,class,area_m2,room
    0,2.5,0.5,free,4.0,
    """
    checked_type("topology", topology, TopologicalMap)
    file = _file(path, "a file of places", _MAP_ENDINGS, frame)
    places = [_place(topology, place) for place in range(topology.n_places)]
    if file.path.suffix.lower() == _TABLE:
        file.write(_table(_PLACE, map(_texts, places)))
        return
    features = [
        _feature({"feature": "place"} | place, _point(place["x"], place["y"])) for place in places
    ]
    file.write(_collection(features + _arcs(topology), frame))


def _poses(result: PlanResult, spacing_m: float, began_s: float) -> list[list[float]]:
    """Return a row for each pose: `_POSE`, and `_DRIVEN` with limits, from a time on."""
    path, limits = result.path, result.limits
    assert path is not None  # noqa: S101 - those without are left out
    if limits is None:
        return _rows(path.poses(spacing_m), path.directions(spacing_m))
    profile = path.profile(limits, spacing_m)
    driven = np.column_stack([profile.speed_m_s, began_s + profile.time_s])
    return _rows(profile.poses, profile.directions, driven)


def _rows(poses: FloatArray, directions: SignArray, *others: FloatArray) -> list[list[float]]:
    values = (np.round(np.column_stack([poses, *others]), _DECIMALS) + 0.0).tolist()
    return [
        [*row[:3], direction, *row[3:]]
        for row, direction in zip(values, directions.tolist(), strict=True)
    ]


def _distinct(rows: list[list[float]]) -> list[list[float]]:
    """Return the rows but those whose pose the next one repeats, as where two plans meet."""
    pairs = itertools.pairwise(rows)
    return [row for row, after in pairs if row[:3] != after[:3]] + rows[-1:]


def _line(result: PlanResult, track: list[list[float]]) -> dict[str, Any]:
    path = result.path
    assert path is not None  # noqa: S101 - those without are left out
    driven: dict[str, Any] = {}
    if path.is_curved or result.limits is not None:
        columns = np.array(track * 2 if len(track) == 1 else track)
        points, headings = columns[:, :2], columns[:, 2]
        driven = dict(zip(_DRIVEN, columns[:, 4:].T.tolist(), strict=False))
    else:
        points, headings = path.points, path.headings_at_points
    if len(points) == 1:  # a line has two positions or more
        points, headings = points.repeat(2, axis=0), headings.repeat(2)
    properties = {
        "feature": "path",
        "status": str(result.status),
        "length_m": path.length_m,
        "cost": result.cost if result.solved else None,
        "metric": result.metric,
        "start": result.start,
        "goal": result.goal,
        "preset": result.settings.get("preset"),
        "headings_rad": np.round(headings, _DECIMALS).tolist(),
        **driven,
    }
    known = {name: value for name, value in properties.items() if value is not None}
    line = {"type": "LineString", "coordinates": np.round(points, _DECIMALS).tolist()}
    return _feature(known, line)


def _room(rooms: Rooms, label: int, doors: Iterable[Door]) -> dict[str, Any]:
    name = rooms.names[label]
    x, y = rooms.point_of(name)
    own = [door.number for door in doors if name in door.rooms]
    area_m2 = _rounded(float(rooms.areas_m2[label]))
    values = (name, _rounded(x), _rounded(y), area_m2, bool(rooms.fits[label]), own)
    return dict(zip(_ROOM, values, strict=True))


def _door(door: Door) -> dict[str, Any]:
    known = {
        "feature": "door",
        "number": door.number,
        "rooms": [name for name in door.rooms if name is not None],
        "kind": door.kind,
        "width_m": _rounded(door.width_m),
        "passable": door.passable,
    }
    if math.isfinite(door.passage_m):
        known["passage_m"] = _rounded(door.passage_m)
    return _feature(known, _point(*door.position))


def _place(topology: TopologicalMap, place: int) -> dict[str, Any]:
    x, y = topology.positions[place].tolist()
    kind = CellClass(topology.classes[place]).name.lower()
    room = None
    if topology.has_rooms:
        row, col = topology.level.cells[place].tolist()
        room = topology.rooms.name_of(int(topology.rooms.labels.label_of[row, col]))
    area_m2 = _rounded(float(topology.areas_m2[place]))
    values = (int(topology.place_ids[place]), _rounded(x), _rounded(y), kind, area_m2, room)
    return dict(zip(_PLACE, values, strict=True))


def _arcs(topology: TopologicalMap) -> list[dict[str, Any]]:
    level = topology.level
    return [
        _feature(
            {
                "feature": "arc",
                "arc": int(topology.arc_ids[arc]),
                "places": topology.place_ids[level.arcs[arc]].tolist(),
                "max_distance_m": _rounded(float(level.max_distance_m[arc])),
                "through_m": _rounded(float(level.through_m[arc])),
            },
            _point(*level.boundary_middles[arc].tolist()),
        )
        for arc in range(topology.n_arcs)
    ]


def _area(rings: Sequence[Any]) -> dict[str, Any]:
    """Return the area inside rings by the even-odd rule."""
    import shapely  # noqa: PLC0415 - rooms alone need it

    area = shapely.build_area(shapely.MultiLineString([[*ring, ring[0]] for ring in rings]))
    return json.loads(shapely.to_geojson(shapely.orient_polygons(area)))


def _point(x: float, y: float) -> dict[str, Any]:
    return {"type": "Point", "coordinates": [_rounded(x), _rounded(y)]}


def _feature(properties: dict[str, Any], geometry: dict[str, Any]) -> dict[str, Any]:
    known = {name: value for name, value in properties.items() if value is not None}
    return {"type": "Feature", "properties": known, "geometry": geometry}


def _collection(features: Iterable[dict[str, Any]], frame: str) -> bytes:
    """Return a file of features, one a line, so that people can read and compare files."""
    lines = ",\n".join(json.dumps(feature, allow_nan=False) for feature in features)
    head = f'{{"type": "FeatureCollection", "frame": {json.dumps(frame)}, "features": ['
    return f"{head}\n{lines}\n]}}\n".encode()


def _table(names: Sequence[str], rows: Iterable[Sequence[Any]]) -> bytes:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(rows)
    return text.getvalue().encode()


def _texts(values: dict[str, Any]) -> list[Any]:
    """Return the cells of a row: lists are divided by spaces."""
    cells: list[Any] = []
    for value in values.values():
        if isinstance(value, list):
            cells.append(" ".join(map(str, value)))
        else:
            cells.append(str(value).lower() if isinstance(value, bool) else value)
    return cells


def _rounded(value: float) -> float:
    return round(value, _DECIMALS) + 0.0


def _file(path: PathLike, kind: str, endings: tuple[str, ...], frame: str) -> NewFile:
    file = NewFile.named(path, "file", kind, endings)
    if not isinstance(frame, str) or not frame:
        raise InvalidValueError(f"frame must be the name of the map frame, got {frame!r:.80}")
    return file
