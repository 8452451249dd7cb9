"""From the coordinates of a traffic editor's drawing to metres."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from hybridnav.errors import MapError
from hybridnav.ext.graphs.files.rmf_read import Point, lane_ends, list_of
from hybridnav.ext.graphs.gather import number_of, pair_of, shown

_PIXELS, _METRES = "reference_image", "cartesian_meters"


@dataclass(frozen=True)
class Drawing:
    """How a level is drawn: as complex numbers, a point z lies at `turn * z + shift` metres."""

    turn: complex = 1.0 + 0.0j
    shift: complex = 0.0 + 0.0j
    y_up: bool = True

    def point(self, raw: Point) -> Point:
        """Return the point of coordinates of the drawing, `(x, y)` in metres."""
        at = self.turn * self.flat(raw) + self.shift
        return at.real, at.imag

    def flat(self, raw: Point) -> complex:
        """Return coordinates with y up."""
        return complex(raw[0], raw[1] if self.y_up else -raw[1])


def drawings_of(
    data: dict[str, Any], contents: dict[str, dict[str, Any]], where: str
) -> dict[str, Drawing]:
    """Return how each level is drawn, as far as its scale is known.

    In a drawing over an image y points down, and the scale is the mean of metres per pixel over the
    measurements. The reference level, or else the first, has its origin at the corner of the image;
    other levels are brought to it by two or more fiducials of one name, and without them have a
    scale and an origin of their own. Metres (`cartesian_meters`) are taken as they are: the editor
    does not apply `offset_x` and `offset_y` to them.

    Parameters
    ----------
    data
        The file.
    contents
        Its levels.
    where
        What messages begin with.

    Raises
    ------
    MapError
        When coordinates are degrees, or the reference level is not there.
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
    scale = _scale(contents[reference], at)
    marks = _fiducials(contents[reference], at)
    drawings = {}
    for level, content in contents.items():
        at = f"{where}, level {shown(level)}"
        own = _fiducials(content, at)
        common = [name for name in marks if name in own]
        if level == reference and scale is not None:
            drawings[level] = Drawing(complex(scale), y_up=False)
        elif level != reference and scale is not None and len(common) > 1:
            pairs = [(marks[name], own[name]) for name in common]
            drawings[level] = _fitted(pairs, scale, at)
        else:
            known = _scale(content, at)
            if known is not None:
                drawings[level] = Drawing(complex(known), y_up=False)
    return drawings


def drawing_of(drawings: dict[str, Drawing], level: str, where: str) -> Drawing:
    """Return how a level is drawn.

    Raises
    ------
    MapError
        When its scale is not known.
    """
    found = drawings.get(level)
    if found is None:
        raise MapError(
            f"{where}, level {shown(level)}: its scale is not known, expected measurements, or two "
            "fiducials of the reference level"
        )
    return found


def _scale(content: dict[str, Any], where: str) -> float | None:
    """Return metres per pixel, the mean over measurements; None without any."""
    vertices = list_of(content.get("vertices"), where, "vertices")
    scales = []
    for number, entry in enumerate(list_of(content.get("measurements"), where, "measurements")):
        at = f"{where}, measurement {number}"
        ends = [
            pair_of(vertices[end]) if 0 <= end < len(vertices) else None
            for end in lane_ends(entry, at)
        ]
        options = entry[2] if len(entry) > 2 and isinstance(entry[2], dict) else {}  # noqa: PLR2004
        given = options.get("distance")
        metres = number_of(given[1]) if isinstance(given, list) and len(given) > 1 else math.nan
        if ends[0] is None or ends[1] is None or not metres > 0 or ends[0] == ends[1]:
            raise MapError(
                f"{at}: expected two points and distance: [3, METRES], got {entry!r:.60}"
            )
        scales.append(metres / math.dist(ends[0], ends[1]))
    return math.fsum(scales) / len(scales) if scales else None


def _fiducials(content: dict[str, Any], where: str) -> dict[str, complex]:
    """Return fiducials by name, with y up."""
    found = {}
    for number, entry in enumerate(list_of(content.get("fiducials"), where, "fiducials")):
        point = pair_of(entry)
        if point is None or len(entry) < 3:  # noqa: PLR2004
            raise MapError(f"{where}, fiducial {number}: expected [x, y, name], got {entry!r:.60}")
        found[str(entry[2])] = complex(point[0], -point[1])
    return found


def _fitted(pairs: list[tuple[complex, complex]], scale: float, where: str) -> Drawing:
    """Return the drawing of a level whose fiducials are known on the reference level, as
    `set_from_fiducials` computes it: circular mean of turns, mean of relative scales, and mean
    shift."""
    between = [
        (pairs[i][0] - pairs[j][0], pairs[i][1] - pairs[j][1])
        for i in range(len(pairs))
        for j in range(i + 1, len(pairs))
    ]
    if any(one == 0 or other == 0 for one, other in between):
        raise MapError(f"{where}: two fiducials lie at one point")
    turns = sum((_unit(one) * _unit(other).conjugate() for one, other in between), 0j)
    relative = math.fsum(abs(other) / abs(one) for one, other in between) / len(between)
    turn = (_unit(turns) if turns else 1.0) * scale / relative
    shift = sum(scale * one - turn * other for one, other in pairs) / len(pairs)
    return Drawing(turn, shift, y_up=False)


def _unit(vector: complex) -> complex:
    return vector / math.hypot(vector.real, vector.imag)
