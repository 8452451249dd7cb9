"""The line that a person walks: its legs, one inside each room, and its bends."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hybridnav._base.poses import wrapped
from hybridnav._base.trig import atan2, directions, hypot, hypots
from hybridnav._base.typing import FloatArray
from hybridnav.guide.words import Space
from hybridnav.guide.words.instruction import LEAST_BEND_RAD, Shape
from hybridnav.planning import Path
from hybridnav.rooms import Door


@dataclass(frozen=True)
class Leg:
    """The part of a path inside one room."""

    room: str | None
    """Name of the room, None outside rooms."""
    length_m: float
    door: Door | None = None
    """The door at the end of the leg; None on the last leg, and at a boundary that is no door (to
    or from unexplored cells)."""
    waypoint: str | None = None
    """Waypoint at the end of the leg: its name or its coordinates."""
    endpoint: tuple[float, float] = (0.0, 0.0)
    """Point where it ends, `(x, y)` in metres, map frame."""
    shape: Shape = "room"
    """Shape of the space outside rooms; in instructions also of rooms that nobody has named."""

    @property
    def space(self) -> Space:
        """The room, or the space outside rooms, by its shape."""
        return Space(self.room, self.shape)

    def to_dict(self) -> dict[str, Any]:
        """Return the plain values for JSON."""
        return {
            "room": self.room,
            "length_m": self.length_m,
            "door": None if self.door is None else self.door.number,
            "door_kind": None if self.door is None else self.door.kind,
            "door_width_m": None if self.door is None else self.door.width_m,
            "door_m": None if self.door is None else list(self.door.position),
            "waypoint": self.waypoint,
        }


# The line that a person walks, and its bends.


LEAST_SLIGHT_RAD = math.radians(35.0)
"""Turn from which a slight bend counts: several that nobody tells lead elsewhere."""
_TOLERANCE_M = 0.75
"""Deviation below which a path counts as straight: a step round a chair is no bend."""
_ONE_BEND_M = 1.5
"""Distance of slight bends to the same hand that make one bend together."""
_ARC_SPACING_M = 0.1
_ROUNDING_M = 1e-9


@dataclass(frozen=True)
class Bend:
    """A turn of a line: by 55 degrees or more, or a slight one from 35 degrees on."""

    at_m: float
    """Metres from the begin of the line."""
    angle_rad: float
    """Radians in [-pi, pi], counter-clockwise."""
    before_rad: float
    """Heading before it, radians."""
    after_rad: float
    """Heading behind it."""


class Line:
    """The paths of a tour as one line, by its length.

    `paths`: at least one path; each begins where the one before ends.
    """

    def __init__(self, paths: Sequence[Path]) -> None:
        parts = [_points_of(path) for path in paths]
        lengths = [hypots(*np.diff(part, axis=0).T) for part in parts]
        self.points: FloatArray = np.concatenate(parts)
        """float64 (n, 2), metres, map frame."""
        along: list[FloatArray] = []
        for length in lengths:
            begun = along[-1][-1] if along else 0.0
            along.append(begun + np.concatenate([[0.0], np.cumsum(length)]))
        self.along_m: FloatArray = np.concatenate(along)
        """float64 (n,), metres from the begin to each point."""
        self.ends_m: list[float] = [float(part[-1]) for part in along]
        """Where each path ends."""

    @property
    def length_m(self) -> float:
        """Its length."""
        return self.ends_m[-1]

    def at(self, along_m: float) -> tuple[float, float]:
        """Return the point at a length, `(x, y)`."""
        x, y = (float(np.interp(along_m, self.along_m, part)) for part in self.points.T)
        return x, y

    def heading(self, begin_m: float, end_m: float) -> float:
        """Return the direction from one point to another, radians; NaN if they coincide."""
        (x, y), (to_x, to_y) = self.at(begin_m), self.at(end_m)
        if hypot(to_x - x, to_y - y) < _ROUNDING_M:
            return math.nan
        return atan2(to_y - y, to_x - x)

    def between(self, begin_m: float, end_m: float) -> tuple[FloatArray, FloatArray]:
        """Return points at most 0.1 m apart, float64 (n, 2), and the length at each."""
        count = max(2, math.ceil((end_m - begin_m) / _ARC_SPACING_M) + 1)
        along = np.linspace(begin_m, max(begin_m, end_m), count)
        return np.stack([np.interp(along, self.along_m, p) for p in self.points.T], axis=1), along

    def nearest(self, point: tuple[float, float], begin_m: float, guess_m: float) -> float:
        """Return where the line passes a point, not before a length and rather near a guess."""
        end_m = next((end for end in self.ends_m if end > begin_m), self.length_m)
        points, along = self.between(begin_m, end_m)
        away = hypots(*(points - point).T) + 0.1 * np.abs(along - guess_m)
        return float(along[int(np.argmin(away))])

    def bends(self) -> list[Bend]:
        """Return its bends of 35 degrees or more, in order.

        They are turns of the line simplified by 0.75 m (Douglas and Peucker 1973), path by path.
        Slighter turns to one hand, each within 1.5 m of the one before, make one bend.
        """
        points, along = self._simplified()
        steps = np.diff(points, axis=0)
        headings = directions(steps[:, 1], steps[:, 0])
        turns = wrapped(np.diff(headings))
        return [
            Bend(
                self._snapped(float(np.average(along[run + 1], weights=np.abs(turns[run])))),
                float(np.clip(turns[run].sum(), -np.pi, np.pi)),
                float(headings[run[0]]),
                float(headings[run[-1] + 1]),
            )
            for run in _runs(turns, along[1:-1])
            if abs(turns[run].sum()) >= LEAST_SLIGHT_RAD
        ]

    def _snapped(self, along_m: float) -> float:
        """Return a length, or the end of a path that it differs from by rounding."""
        return next((end for end in self.ends_m if abs(end - along_m) < _ROUNDING_M), along_m)

    def first_heading(self) -> float:
        """Return the direction of the first stretch, radians; NaN without motion."""
        points, _ = self._simplified()
        if len(points) < 2:  # noqa: PLR2004
            return math.nan
        x, y = (points[1] - points[0]).tolist()
        return atan2(y, x)

    def _simplified(self) -> tuple[FloatArray, FloatArray]:
        """Return the points that are kept, the ends of all paths among them, and their lengths."""
        import shapely  # noqa: PLC0415 - loads slowly

        kept = []
        for begin_m, end_m in itertools.pairwise([0.0, *self.ends_m]):
            within = (self.along_m >= begin_m) & (self.along_m <= end_m)
            measured = np.column_stack([self.points[within], self.along_m[within]])
            part = shapely.LineString(measured).simplify(_TOLERANCE_M, preserve_topology=False)
            kept.append(shapely.get_coordinates(part, include_z=True))
        rows = np.concatenate(kept)
        moved = np.concatenate([[True], np.diff(rows[:, 2]) > _ROUNDING_M])
        return rows[moved, :2], rows[moved, 2]


def _points_of(path: Path) -> FloatArray:
    """Return points between which a path is straight, at least two."""
    points = path.poses(_ARC_SPACING_M)[:, :2] if path.is_curved else path.points
    return points if len(points) > 1 else np.repeat(points, 2, axis=0)


def _runs(turns: FloatArray, along: FloatArray) -> Iterator[FloatArray]:
    """Yield the indices of turns that make one bend: a great one, or slight ones together."""
    run: list[int] = []
    for at in range(len(turns)):
        is_great = abs(turns[at]) >= LEAST_BEND_RAD
        if run and (
            is_great
            or abs(turns[run[-1]]) >= LEAST_BEND_RAD
            or turns[at] * turns[run[-1]] <= 0
            or along[at] - along[run[-1]] > _ONE_BEND_M
        ):
            yield np.array(run)
            run = []
        run.append(at)
    if run:
        yield np.array(run)
