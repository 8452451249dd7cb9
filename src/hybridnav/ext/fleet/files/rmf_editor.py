"""Reader of the building maps of Open-RMF's traffic editor, `*.building.yaml`.

Coordinates and the choice of lanes follow open-rmf/rmf_traffic_editor,
`rmf_building_map_tools/building_map`: `building.py`, `level.py`, `lift.py`, `transform.py`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import shapely

from hybridnav._base.trig import cos, dist, hypot, sin
from hybridnav.errors import MapError
from hybridnav.ext.fleet import BuildingGraph, DoorLine
from hybridnav.ext.fleet.files import rmf_read as rmf
from hybridnav.graphs.gather import number_of, pair_of, shown

_OPTIONS = 4
"""Place of the options of a vertex: x, y, z and name stand before."""
_MOST_GRAPHS = 10
"""The editor numbers graphs from 0 to 9."""
_MOST_CROSSINGS = 2_000_000
"""Pairs of a lane and a door of one level that may cross."""
_MOST_OFF_M = 0.5
"""Metres between a fiducial and its place by the fit from which it is a finding."""
_MOST_RATIO = 1.1
"""Ratio of a level's scales by fiducials and by measurements from which it is a finding."""
_GAP_M = 0.05
"""Gap between a cabin and its shaft, `gap` of `lift.py`."""
_IN_FILE_ONLY = ("bidirectional", "graph_idx", "orientation")
_OPPOSITE = {"forward": "backward", "backward": "forward"}


def is_drawn(data: Mapping[str, Any]) -> bool:
    """Return whether a file of Open-RMF is a building map: its vertices have a number as third
    item."""
    for level in data["levels"].values():
        vertices = level.get("vertices") if isinstance(level, dict) else None
        for vertex in vertices if isinstance(vertices, list) else []:
            if isinstance(vertex, list) and len(vertex) > 2:  # noqa: PLR2004
                return isinstance(vertex[2], int | float)
    return False


def read_drawn(
    data: dict[str, Any], where: str, name: str, *, graph_index: int | None = None
) -> BuildingGraph:
    """Read a building map.

    `data`: the file as parsed; `where`: what messages begin with; `name`: name of a building that
    has none; `graph_index`: which of the graphs to read, from 0 to 9; None for the first that has
    lanes. Returns a floor for each level on which the graph has lanes, from the lowest to the
    highest, in metres, with y up, in the frame of the reference level. Raises `MapError` when it is
    not of this form, its coordinates are degrees, or no lane belongs to the graph.
    """
    levels = rmf.mapping_of(data["levels"], where, "levels", rmf.MOST_FLOORS)
    contents = {
        level: rmf.mapping_of(content, f"{where}, level {shown(level)}", "the level")
        for level, content in levels.items()
    }
    index = _graph_index(contents, where, graph_index)
    drawings = drawings_of(data, contents, where)
    reference = str(data.get("reference_level_name", next(iter(contents), "")))
    lifts = {
        lift: _Cabin(rmf.mapping_of(facts, at, "the lift"), reference, drawings, at)
        for lift, facts in rmf.mapping_of(
            data.get("lifts"), where, "lifts", rmf.MOST_FLOORS
        ).items()
        for at in [f"{where}, lift {shown(lift)}"]
    }
    built = {lift: rmf.RmfLift(cabin.dims_m) for lift, cabin in lifts.items()}
    taken: set[rmf.Name] = set()
    floors = []
    for level, content in contents.items():
        floor = rmf.RmfFloor(level, where, _elevation(content))
        if any(_index_of(lane) == index for lane in _lanes(content)):
            _fill(floor, content, drawing_of(drawings, level, where), index, taken)
        for lift, cabin in lifts.items():
            inside = (point for point in floor.points if cabin.holds(level, point))
            end = next(inside, None)
            if end is not None:
                built[lift].ends[level] = end
        floors.append(floor)
    floors.sort(key=lambda floor: floor.elevation_m or 0.0)
    for lift, cabin in lifts.items():
        if len(built[lift].ends) > 1:  # else the whole lift is a finding
            _find_lost_stops(floors, f"lift {shown(lift)}", cabin.levels - built[lift].ends.keys())
    title = str(data.get("building_name") or data.get("name") or name)
    return rmf.building_of(floors, built, title, where)


def _find_lost_stops(floors: list[rmf.RmfFloor], lift: str, levels: set[str]) -> None:
    """Add the levels at which a lift has doors and no vertex, but those without lanes."""
    by_name = {floor.name: floor for floor in floors}
    first = next(floor for floor in floors if not floor.is_empty)
    for level in sorted(levels):
        on = by_name.get(level)
        if on is None:
            text = f"{lift}: level_doors names {shown(level)}, which is not there"
            first.gathered.findings.add("stop-unread", text)
        elif not on.is_empty:
            text = f"{lift}: no vertex in its cabin on level {shown(level)}"
            on.gathered.findings.add("stop-unread", text)


def _graph_index(contents: dict[str, Any], where: str, wanted: int | None) -> int:
    used = {_index_of(lane) for content in contents.values() for lane in _lanes(content)}
    indices = sorted(index for index in used if 0 <= index < _MOST_GRAPHS)
    if wanted is None and indices:
        return indices[0]
    if wanted in indices:
        return int(wanted or 0)
    text = ", ".join(map(str, indices)) or "none"
    raise MapError(f"{where}: no lane of graph {wanted or 0}; graphs with lanes: {text}")


def _lanes(content: dict[str, Any]) -> Iterator[list[Any]]:
    lanes = content.get("lanes")
    yield from (lane for lane in lanes if isinstance(lane, list)) if isinstance(lanes, list) else ()


def _index_of(lane: list[Any]) -> int:
    options = lane[2] if len(lane) > 2 and isinstance(lane[2], dict) else {}  # noqa: PLR2004
    value = _value(options.get("graph_idx", [2, 0]))
    return value if type(value) is int else -1


def _value(parameter: Any) -> Any:
    """Return the value of a parameter `[type, value]`."""
    is_pair = isinstance(parameter, list) and len(parameter) == 2  # noqa: PLR2004
    return parameter[1] if is_pair else None


def _elevation(content: dict[str, Any]) -> float:
    value = number_of(content.get("elevation", 0.0))
    return 0.0 if math.isnan(value) else value


def _fill(
    floor: rmf.RmfFloor, content: dict[str, Any], drawing: Drawing, index: int, taken: set[rmf.Name]
) -> None:
    """Add the vertices that lanes of a graph use, in the order of their first use, the lanes and
    the doors."""
    at = f"{floor.where}, level {shown(floor.name)}"
    vertices = rmf.list_of(content.get("vertices"), at, "vertices")
    lanes = rmf.list_of(content.get("lanes"), at, "lanes")
    for kind, doubt in drawing.doubts:
        floor.gathered.findings.add(kind, f"level {shown(floor.name)}: {doubt}")
    chosen = []
    for number, lane in enumerate(lanes):
        ends = rmf.lane_ends(lane, f"{at}, lane {number}")
        if _index_of(lane) == index:
            chosen.append((ends, _parameters(lane, 2, f"{at}, lane {number}")))
    numbers: dict[int, int] = {}
    for end in itertools.chain.from_iterable(ends for ends, _ in chosen):
        if end in numbers or not 0 <= end < len(vertices):
            continue
        numbers[end] = len(numbers)
        _add_vertex(floor, vertices[end], drawing, taken, f"{at}, vertex {end}")
    for number, entry in enumerate(rmf.list_of(content.get("doors"), at, "doors")):
        floor.doors.append(_door(entry, vertices, drawing, f"{at}, door {number}"))
    ends_of = [[numbers.get(end, -1 - end) for end in ends] for ends, _ in chosen]
    passed = _doors_passed([[_point_at(floor, end) for end in ends] for ends in ends_of], floor)
    for (tail, head), door, (_, facts) in zip(ends_of, passed, chosen, strict=True):
        own = {key: value for key, value in facts.items() if key not in _IN_FILE_ONLY and value}
        _add_lanes(floor, (tail, head), own | ({"door_name": door} if door else {}), facts)


def _point_at(floor: rmf.RmfFloor, number: int) -> rmf.Point | None:
    return floor.points[number] if 0 <= number < len(floor.points) else None


def _add_vertex(
    floor: rmf.RmfFloor, entry: Any, drawing: Drawing, taken: set[rmf.Name], where: str
) -> None:
    values = rmf.list_of(entry, where, "[x, y, z, name, ...]")
    raw = pair_of(values)
    name = values[3] if len(values) > 3 else None  # noqa: PLR2004
    facts = _parameters(values, _OPTIONS, where)
    point = None if raw is None else drawing.point(raw)
    floor.add_vertex("" if name is None else str(name), point, facts, taken)


def _parameters(entry: list[Any], at: int, where: str) -> dict[str, Any]:
    return {key: _value(value) for key, value in rmf.options_of(entry, at, where).items()}


def _add_lanes(
    floor: rmf.RmfFloor, vertices: tuple[int, int], common: dict[str, Any], facts: dict[str, Any]
) -> None:
    """Add a lane, and the one back if it leads in both directions."""
    tail, head = vertices
    way = facts.get("orientation")
    ahead = {"orientation_constraint": way} if way in _OPPOSITE else {}
    floor.add_lane((tail, head), common | ahead)
    if facts.get("bidirectional") is True:
        back = {"orientation_constraint": _OPPOSITE[way]} if way in _OPPOSITE else {}
        floor.add_lane((head, tail), common | back)


def _door(entry: Any, vertices: list[Any], drawing: Drawing, where: str) -> DoorLine:
    ends = []
    for number in rmf.lane_ends(entry, where):
        raw = pair_of(vertices[number]) if 0 <= number < len(vertices) else None
        if raw is None:
            raise MapError(f"{where}: vertex {number} is not there, or has no point")
        ends.append(drawing.point(raw))
    name = _parameters(entry, 2, where).get("name")
    if not isinstance(name, str | int) or isinstance(name, bool):
        raise MapError(f"{where}: expected a name [1, NAME], got {name!r:.60}")
    return DoorLine(str(name), (ends[0], ends[1]))


class _Cabin:
    """The rectangle of a lift, in the frame of the reference level."""

    def __init__(
        self, facts: dict[str, Any], reference: str, drawings: dict[str, Drawing], where: str
    ) -> None:
        raw = pair_of((facts.get("x"), facts.get("y")))
        width, depth, yaw = (number_of(facts.get(key)) for key in ("width", "depth", "yaw"))
        if raw is None or not (width > 0 and depth > 0 and math.isfinite(yaw)):
            raise MapError(f"{where}: expected x, y, yaw, and width and depth in metres")
        drawing = drawing_of(drawings, str(facts.get("reference_floor_name", reference)), where)
        self.dims_m = width, depth
        self._at, self._yaw = drawing.point(raw), yaw
        self.levels = {
            str(key) for key in rmf.mapping_of(facts.get("level_doors"), where, "level_doors")
        }

    def holds(self, level: str, point: rmf.Point | None) -> bool:
        """Return whether a point lies inside, on a level where the lift has doors."""
        if point is None or level not in self.levels:
            return False
        dx, dy = point[0] - self._at[0], point[1] - self._at[1]
        cosine, sine = cos(self._yaw), sin(self._yaw)
        across, along = abs(dx * cosine + dy * sine), abs(dy * cosine - dx * sine)
        return across <= self.dims_m[0] / 2 + _GAP_M and along <= self.dims_m[1] / 2 + _GAP_M


def _doors_passed(lanes: list[list[rmf.Point | None]], floor: rmf.RmfFloor) -> list[str]:
    """Return the last door of the file that each lane crosses, empty for none."""
    passed = [""] * len(lanes)
    whole = [[end for end in ends if end is not None] for ends in lanes]
    kept = [at for at, ends in enumerate(whole) if len(ends) == 2]  # noqa: PLR2004
    if not floor.doors or not kept:
        return passed
    if len(floor.doors) * len(kept) > _MOST_CROSSINGS:
        raise MapError(
            f"{floor.where}, level {shown(floor.name)}: {len(floor.doors)} doors and {len(kept)} "
            f"lanes, at most {_MOST_CROSSINGS} pairs of them are tested"
        )
    doors = shapely.linestrings([door.ends for door in floor.doors])
    segments = shapely.linestrings([whole[at] for at in kept])
    crossings = shapely.STRtree(doors).query(segments, predicate="intersects")
    for lane, door in sorted(crossings.T.tolist()):
        (a, b), (c, d) = whole[kept[lane]], floor.doors[door].ends
        along, across = np.subtract(b, a), np.subtract(d, c)
        if along[0] * across[1] != along[1] * across[0]:  # they are not parallel
            passed[kept[lane]] = floor.doors[door].name
    return passed


# From the coordinates of a drawing to metres.

_PIXELS, _METRES = "reference_image", "cartesian_meters"


@dataclass(frozen=True)
class Drawing:
    """How a level is drawn: as complex numbers, a point z lies at `turn * z + shift` metres."""

    turn: complex = 1.0 + 0.0j
    shift: complex = 0.0 + 0.0j
    y_up: bool = True
    doubts: tuple[tuple[str, str], ...] = ()
    """Kinds of findings, and what is wrong."""

    def point(self, raw: rmf.Point) -> rmf.Point:
        """Return the point of coordinates of the drawing, `(x, y)` in metres."""
        at = self.turn * self.flat(raw) + self.shift
        return at.real, at.imag

    def flat(self, raw: rmf.Point) -> complex:
        """Return coordinates with y up."""
        return complex(raw[0], raw[1] if self.y_up else -raw[1])


def drawings_of(
    data: dict[str, Any], contents: dict[str, dict[str, Any]], where: str
) -> dict[str, Drawing]:
    """Return how each level is drawn.

    In a drawing over an image y points down, and the scale is the mean of metres per pixel over the
    measurements, 1 without any. The reference level, or else the first, has its origin at the
    corner of the image; other levels are brought to it by two or more fiducials of one name, and
    without them have a scale and an origin of their own. Metres (`cartesian_meters`) are taken as
    they are: the editor does not apply `offset_x` and `offset_y` to them.

    `where`: what messages begin with. Raises `MapError` when coordinates are degrees, or the
    reference level is not there.
    """
    system = data.get("coordinate_system", _PIXELS)
    if system == _METRES:
        return dict.fromkeys(contents, Drawing())
    if system != _PIXELS:
        raise MapError(
            f"{where}: coordinate_system {system!r:.40} is not read, expected {_PIXELS} or "
            f"{_METRES}"
        )
    reference = str(data.get("reference_level_name", next(iter(contents), "")))
    if reference not in contents:
        raise MapError(f"{where}: the reference level {reference!r:.60} is not there")
    at = f"{where}, level {shown(reference)}"
    of_reference = _measured(contents[reference], at)
    marks = _fiducials(contents[reference], at)
    drawings = {reference: of_reference}
    for level, content in contents.items():
        if level == reference:
            continue
        at = f"{where}, level {shown(level)}"
        own, measured = _fiducials(content, at), _measured(content, at)
        pairs = {name: (marks[name], own[name]) for name in marks if name in own}
        if len(pairs) > 1:
            drawings[level] = _fitted(pairs, of_reference.turn.real, measured, at)
        else:
            names = ", ".join(map(shown, pairs)) or "none"
            doubt = f"fiducials as on {shown(reference)}: {names}, expected two: it is not aligned"
            doubts = (*measured.doubts, ("level-unaligned", doubt))
            drawings[level] = replace(measured, doubts=doubts)
    return drawings


def drawing_of(drawings: dict[str, Drawing], level: str, where: str) -> Drawing:
    """Return how a level is drawn.

    Raises `MapError` when it is not there.
    """
    if level not in drawings:
        raise MapError(
            f"{where}: level {shown(level)} is not there, expected one of the file: correct "
            "reference_floor_name"
        )
    return drawings[level]


def _measured(content: dict[str, Any], where: str) -> Drawing:
    """Return the drawing of a level by its measurements; those without a length are left out."""
    vertices = rmf.list_of(content.get("vertices"), where, "vertices")
    scales: list[float] = []
    doubts: list[tuple[str, str]] = []
    for number, entry in enumerate(rmf.list_of(content.get("measurements"), where, "measurements")):
        at = f"{where}, measurement {number}"
        ends = [
            pair_of(vertices[end]) if 0 <= end < len(vertices) else None
            for end in rmf.lane_ends(entry, at)
        ]
        options = entry[2] if len(entry) > 2 and isinstance(entry[2], dict) else {}  # noqa: PLR2004
        given = options.get("distance")
        metres = number_of(given[1]) if isinstance(given, list) and len(given) > 1 else math.nan
        if ends[0] is None or ends[1] is None or math.isnan(metres):
            raise MapError(
                f"{at}: expected two points and distance: [3, METRES], got {entry!r:.60}"
            )
        pixels = dist(ends[0], ends[1])
        if pixels > 0 and metres / pixels > 0:
            scales.append(metres / pixels)
        else:
            text = f"measurement {number} is {metres:g} m on {pixels:g} pixels, and left out"
            doubts.append(("scale-unsure", text))
    if not scales:
        doubts.append(("scale-unsure", "no measurement has a length: a pixel is taken as 1 m"))
    scale = math.fsum(scales) / len(scales) if scales else 1.0
    return Drawing(complex(scale), y_up=False, doubts=tuple(doubts))


def _fiducials(content: dict[str, Any], where: str) -> dict[str, complex]:
    """Return fiducials by name, with y up."""
    places = {}
    for number, entry in enumerate(rmf.list_of(content.get("fiducials"), where, "fiducials")):
        point = pair_of(entry)
        if point is None or len(entry) < 3:  # noqa: PLR2004
            raise MapError(f"{where}, fiducial {number}: expected [x, y, name], got {entry!r:.60}")
        places[str(entry[2])] = complex(point[0], -point[1])
    return places


def _fitted(
    marks: dict[str, tuple[complex, complex]], scale: float, measured: Drawing, where: str
) -> Drawing:
    """Return the drawing of a level whose fiducials are known on the reference level, as
    `set_from_fiducials` computes it: circular mean of turns, mean of relative scales, and mean
    shift. Doubts are fiducials far from their fit, and a scale unlike the measured
    one, which is all that two fiducials can show."""
    pairs = list(marks.values())
    between = [
        (pairs[i][0] - pairs[j][0], pairs[i][1] - pairs[j][1])
        for i in range(len(pairs))
        for j in range(i + 1, len(pairs))
    ]
    if not all(_length(one) and _length(other) for one, other in between):
        raise MapError(f"{where}: two fiducials lie at one point")
    turns = sum((_unit(one) * _unit(other).conjugate() for one, other in between), 0j)
    relative = math.fsum(_length(other) / _length(one) for one, other in between) / len(between)
    turn = (_unit(turns) if turns else 1.0) * scale / relative
    shift = sum(scale * one - turn * other for one, other in pairs) / len(pairs)
    off, name = max(
        (_length(turn * other + shift - scale * one), name) for name, (one, other) in marks.items()
    )
    doubts = []
    if off > _MOST_OFF_M:
        doubts.append(f"fiducials lie up to {off:.2f} m from their fit, {shown(name)} the farthest")
    own = measured.turn.real
    if not measured.doubts and not 1 / _MOST_RATIO < own * relative / scale < _MOST_RATIO:
        doubts.append(
            f"a pixel is {scale / relative:.3g} m by fiducials, {own:.3g} m by measurements"
        )
    return Drawing(turn, shift, y_up=False, doubts=tuple(("fiducial-off", each) for each in doubts))


def _unit(vector: complex) -> complex:
    return vector / _length(vector)


def _length(vector: complex) -> float:
    return hypot(vector.real, vector.imag)  # `abs` takes that of the C library
