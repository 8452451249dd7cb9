"""What may be crossed in one direction only, and its sides of cells. Public: `OneWay`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import reduce
from itertools import pairwise
from operator import or_
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.rows import unique_rows
from hybridnav.closures.areas import shown
from hybridnav.closures.ids import arc_on, door_on
from hybridnav.errors import InvalidValueError
from hybridnav.pyramid import LevelArc
from hybridnav.rooms import Door
from hybridnav.search.directed import DirectedSides
from hybridnav.topology.map import no_places

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._base.typing import FloatArray, IntArray, LongArray
    from hybridnav.maps import Frame, OccupancyGrid, OneWayRule
    from hybridnav.topology import TopologicalMap

_T = TypeVar("_T")
_FARTHEST_CELLS = 1e6
"""Cells from the map's origin beyond which the points of a line count as a mistake."""


@copies_alike
@dataclass(frozen=True, eq=False)
class OneWay:
    """Lines, doors and arcs that may be crossed in one direction only.

    Each is a chain of sides of cells; a path may pass a side in its direction, and never back. It
    may go round the end of a chain, and touch it there. `first | second` is the union of two: what
    one of them forbids is forbidden.

    Parameters
    ----------
    lines
        Each a shapely `LineString` or points `(x, y)`, shape (n, 2), metres, map frame. They may be
        crossed from their left to their right; draw a line the other way round for the other
        direction. Its points are snapped to the nearest corners of cells, and it to their sides. It
        ends where it is drawn: draw it into the walls.
    doors
        `(door, room)`: a number or a `Door`, and the name of the room that it leads into; None for
        the nameless space.
    arcs
        `(arc, place)`: the id of an arc of the places and of the place that it leads into; or a
        `LevelArc` and the vertex of its level.
    sides
        `row_from, col_from, row_to, col_to` of 4-neighbour cells, shape (n, 4): may be crossed from
        the first to the second and not back. A side that is listed both ways is shut.
    named
        Others by what reasons call them.

    Raises
    ------
    InvalidValueError
        When an item is of another kind, a line has fewer than two points or is not finite, or the
        cells of a side are no 4-neighbours.

    Examples
    --------
    >>> one_way = hn.OneWay(lines=[[(1, 0), (1, 2)]]) | hn.OneWay(sides=[(0, 4, 0, 5)])
    >>> grid = hn.OccupancyGrid(np.zeros((2, 6)), robot_radius_m=0)
    >>> one_way.on(grid).sides
    array([[0, 0, 0, 1],
           [0, 4, 0, 5],
           [1, 0, 1, 1]], dtype=int32)
    """

    lines: Sequence[BaseGeometry | ArrayLike] = ()
    doors: Sequence[tuple[int | Door, str | None]] = ()
    arcs: Sequence[tuple[int | LevelArc, int]] = ()
    sides: ArrayLike = ()
    named: Mapping[str, OneWay] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check and convert what was given."""
        checked = {
            "lines": tuple(map(_checked_line, _listed("lines", self.lines))),
            "doors": _checked_pairs("doors", self.doors, (int, Door), (str, type(None))),
            "arcs": _checked_pairs("arcs", self.arcs, (int, LevelArc), (int,)),
            "sides": _checked_sides(self.sides),
            "named": checked_named(self.named, OneWay),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    @classmethod
    def of(cls, rules: Iterable[OneWayRule]) -> OneWay:
        """Return what rules state: those of rooms, of files and of graphs."""
        listed = list(rules)
        doors = [(rule.door, rule.into) for rule in listed if rule.door is not None]
        return cls(lines=[rule.line for rule in listed if rule.line], doors=doors)

    def __or__(self, other: OneWay) -> OneWay:
        """Return the union of two."""
        if not isinstance(other, OneWay):
            return NotImplemented
        both: dict[str, Any] = {
            name: (*getattr(self, name), *getattr(other, name))
            for name in ("lines", "doors", "arcs")
        }
        sides = np.concatenate([np.asarray(self.sides), np.asarray(other.sides)])
        return OneWay(**both, sides=sides, named=union(self.named, other.named))

    @property
    def key(self) -> tuple[object, ...]:
        """Key for look-ups, equal for equal values."""
        lines = tuple(line.tobytes() for line in map(np.asarray, self.lines))
        named = tuple((name, one.key) for name, one in self.named.items())
        return "one way", lines, self.doors, self.arcs, np.asarray(self.sides).tobytes(), named

    def on(self, grid: OccupancyGrid, topology: TopologicalMap | None = None) -> DirectedSides:
        """Find the sides on a map.

        Parameters
        ----------
        grid
            The map.
        topology
            Its places, for doors and arcs; None where there are none of these.

        Returns
        -------
        DirectedSides
            The sides, and those of each item: `door 5`, `arc 7`, `line 1`, `sides`, or its name.

        Raises
        ------
        InvalidValueError
            When the map has no such door, room, arc, place or cell, a line lies beside the map, or
            an arc is a self-loop.
        """
        return DirectedSides.of(self._parts(grid, topology), grid.shape)

    def _parts(
        self, grid: OccupancyGrid, topology: TopologicalMap | None
    ) -> Iterable[tuple[str, LongArray]]:
        if (self.doors or self.arcs) and topology is None:
            no_places()
        for number, line in enumerate(self.lines, start=1):
            yield f"line {number}", sides_along(np.asarray(line), grid.frame)
        if topology is not None:
            for door, room in self.doors:
                own = door_on(topology.rooms, door)
                yield f"{own.kind} {own.number}", _sides_of_door(topology, own, room)
            for arc, place in self.arcs:
                name = (
                    f"arc {arc}"
                    if isinstance(arc, int)
                    else f"arc {arc.index} of level {arc.level}"
                )
                yield name, _sides_of_arc(topology, arc, place)
        sides = np.asarray(self.sides)
        if len(sides):
            if not ((sides >= 0) & (sides < [*grid.shape, *grid.shape])).all():
                raise InvalidValueError(
                    f"sides must lie on the map of {grid.shape[0]} x {grid.shape[1]} cells, got "
                    f"{shown(sides.tolist())}"
                )
            yield "sides", sides
        for name, one in self.named.items():
            yield name, one.on(grid, topology).sides.astype(np.int64)


OneWayLike = OneWay | BaseGeometry | Mapping[str, Any]
"""Types that a planner accepts as `one_way`: a `OneWay`, one line, or a mapping from the names of
the attributes of a `OneWay`."""


def as_one_way(value: OneWayLike) -> OneWay:
    """Convert any accepted form to a `OneWay`.

    Raises `InvalidValueError` when the value is of another kind, has other names, or invalid
    content.
    """
    if isinstance(value, OneWay):
        return value
    if isinstance(value, BaseGeometry):
        return OneWay(lines=[value])
    if not isinstance(value, Mapping):
        raise InvalidValueError(
            "one_way must be a OneWay, a LineString or a mapping, as "
            f"{{'doors': [(4, 'room-3')]}}, got {shown(value)}"
        )
    names = tuple(one.name for one in fields(OneWay))
    if unknown := [name for name in value if name not in names]:
        raise InvalidValueError(
            f"one_way takes {', '.join(names)}, got {', '.join(map(str, unknown)):.80}"
        )
    return OneWay(**value)


def joined(each: Iterable[OneWayLike | None]) -> OneWay | None:
    """Return the union of some, None for none."""
    given = [as_one_way(one) for one in each if one is not None]
    return reduce(or_, given) if given else None


def directions_on(topology: TopologicalMap, one_way: OneWay | None = None) -> DirectedSides | None:
    """Return the sides of what the rooms of a map let cross in one direction only, with more.

    `one_way`: what else has a direction. Returns None for nothing. Raises `InvalidValueError` when
    the map has no such door.
    """
    rooms = topology.room_labels
    lasting = None if rooms is None or not rooms.one_way else OneWay.of(rooms.one_way)
    both = joined([lasting, one_way])
    return None if both is None else both.on(topology.grid, topology)


def sides_along(points: ArrayLike, frame: Frame) -> LongArray:
    """Return the sides of cells along a line, `(from, to)` from its left to its right.

    `points`: float64 (n, 2), `(x, y)` in metres, map frame. Corners of cells nearest to the points
    are joined by chains of sides, whose corners lie nearest to the line; a chain that runs back on
    itself is cut. Returns int64 (m, 4); cells may lie off the map.

    Raises `InvalidValueError` when a point lies too far from the map, or all lie at one corner.
    """
    positions = frame.positions_of(np.asarray(points, dtype=np.float64))
    if not (np.abs(positions) <= _FARTHEST_CELLS).all():
        raise InvalidValueError(
            f"a line must lie within {_FARTHEST_CELLS:g} cells of the map, got {shown(points)}"
        )
    corners = np.floor(positions + 0.5).astype(np.int64)
    chain = [tuple(corners[0].tolist())]
    for first, last in pairwise(corners):
        for corner in map(tuple, _between(first, last).tolist()):
            if len(chain) > 1 and corner == chain[-2]:
                chain.pop()
            else:
                chain.append(corner)
    if len(chain) == 1:
        raise InvalidValueError(
            f"a line must be longer than a cell of {frame.resolution_m:g} m and not run back on "
            f"itself, got {shown(points)}: draw it longer"
        )
    at = np.array(chain)
    (low, across), step = np.minimum(at[:-1], at[1:]).T, np.diff(at, axis=0)
    # North (a row up): from west to east. East: from the row above to the one below.
    up, right = step.T
    side = np.stack([low - (right < 0), across - (up > 0), low - (right > 0), across - (up < 0)])
    return side.T


def _between(first: LongArray, last: LongArray) -> LongArray:
    """Return the corners after the first one to the last one, the same in both directions."""
    if tuple(first.tolist()) > tuple(last.tolist()):
        back = _between(last, first)[:-1][::-1]
        return np.concatenate([back, last[None]])
    rows, cols = np.abs(last - first).tolist()
    # The line passes from the half of one step to that of the next at odd multiples of these.
    passed = np.concatenate([(2 * np.arange(rows) + 1) * cols, (2 * np.arange(cols) + 1) * rows])
    is_row = np.arange(rows + cols) < rows
    order = np.argsort(passed, kind="stable")
    steps = np.stack([is_row[order], ~is_row[order]], axis=1) * np.sign(last - first)
    return first + np.cumsum(steps, axis=0)


def _sides_of_door(topology: TopologicalMap, door: Door, room: str | None) -> LongArray:
    """Return the sides across a door into a room, on the map as measured."""
    if room not in door.rooms:
        between = " and ".join(name or "unnamed space" for name in door.rooms)
        raise InvalidValueError(
            f"{door.kind} {door.number} joins {between}, and leads into no {shown(room)}: name the "
            "room that it leads into, None for unnamed space"
        )
    rooms = topology.rooms
    moves = rooms.moves_through(door.number)
    into = -1 if room is None else rooms.labels.index(room)
    inside = rooms.labels.label_of.ravel()[moves] == into
    return _directed(moves, inside, topology.grid.shape[1])


def _sides_of_arc(topology: TopologicalMap, arc: int | LevelArc, place: int) -> LongArray:
    located = arc_on(topology, arc)
    level = topology.pyramid[located.level]
    ends = level.arcs[located.index].tolist()
    shown_ends = ends if isinstance(arc, LevelArc) else topology.place_ids[ends].tolist()
    if ends[0] == ends[1] or place not in shown_ends:
        raise InvalidValueError(
            f"{arc if isinstance(arc, LevelArc) else f'arc {arc}'} joins {shown_ends[0]} and "
            f"{shown_ends[1]}, and has no direction into {place}: name one of two places"
        )
    pairs = level.boundary(located.index).reshape(-1, 4)
    return pairs if place == shown_ends[1] else pairs[:, [2, 3, 0, 1]]


def _directed(moves: LongArray, inside: LongArray, cols: int) -> LongArray:
    """Return pairs of flat cells as sides that lead to the one that is inside."""
    pairs = np.where(inside[:, :1], moves[:, ::-1], moves)
    return np.stack(np.divmod(pairs, cols), axis=2).reshape(-1, 4)


def _listed(name: str, items: Any) -> list[Any]:
    if isinstance(items, BaseGeometry | str) or not hasattr(items, "__iter__"):
        raise InvalidValueError(f"{name} must be a sequence, got {shown(items)}: put it in a list")
    return list(items)


def _checked_line(line: Any) -> FloatArray:
    if isinstance(line, BaseGeometry) and line.geom_type in {"LineString", "LinearRing"}:
        line = shapely.get_coordinates(line)
    try:
        points = np.array(line, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        points = np.empty(0)
    is_line = points.ndim == 2 and len(points) > 1 and points.shape[1] == 2  # noqa: PLR2004
    if not is_line or not np.isfinite(points).all():
        raise InvalidValueError(
            "a one-way line must be a LineString or two or more finite points (x, y), got "
            f"{shown(line)}"
        )
    return frozen(points)


def _checked_pairs(
    name: str, pairs: Any, firsts: tuple[type, ...], seconds: tuple[type, ...]
) -> tuple[tuple[Any, Any], ...]:
    checked = []
    for pair in _listed(name, pairs):
        is_pair = isinstance(pair, Sequence) and not isinstance(pair, str) and len(pair) == 2  # noqa: PLR2004
        one, into = pair if is_pair else (None, None)
        one, into = (int(each) if isinstance(each, np.integer) else each for each in (one, into))
        wrong = isinstance(one, bool) or isinstance(into, bool)
        if not is_pair or wrong or not isinstance(one, firsts) or not isinstance(into, seconds):
            example = "(4, 'room-3')" if name == "doors" else "(7, 12)"
            raise InvalidValueError(
                f"{name} must be pairs of what has a direction and where it leads into, as "
                f"{example}, got {shown(pair)}"
            )
        checked.append((one, into))
    return tuple(checked)


def _checked_sides(sides: Any) -> IntArray:
    try:
        array = np.array(sides)
    except ValueError:
        array = np.empty(())
    if array.size == 0 and array.ndim:
        array = np.empty((0, 4), np.int64)
    is_table = array.ndim == 2 and array.shape[1] == 4 and array.dtype.kind in "iu"  # noqa: PLR2004
    limits = np.iinfo(np.int32)
    if not is_table or (array.size and not limits.min < array.min() <= array.max() < limits.max):
        raise InvalidValueError(
            "sides must be integers (row_from, col_from, row_to, col_to) of shape (n, 4), got "
            f"{shown(sides)}"
        )
    array = array.astype(np.int64)
    apart = np.abs(array[:, :2] - array[:, 2:]).sum(axis=1)
    if (apart != 1).any():
        raise InvalidValueError(
            "the two cells of a side must be 4-neighbours, got "
            f"{tuple(array[np.argmax(apart != 1)].tolist())}"
        )
    rows = unique_rows(array).rows if len(array) else array
    return frozen(rows.astype(np.int32))


def checked_named(named: Any, kind: type[_T]) -> dict[str, _T]:
    """Return a mapping of names to closures, checked."""
    if not isinstance(named, Mapping) or not all(
        isinstance(name, str) and isinstance(each, kind) for name, each in named.items()
    ):
        expected = f"named must be a mapping of names to {kind.__name__}"
        raise InvalidValueError(f"{expected}, got {shown(named)}")
    return dict(named)


def union(first: Mapping[str, Any], other: Mapping[str, Any]) -> dict[str, Any]:
    """Return the closures of two mappings, those of one name joined."""
    both = {name: each | other[name] for name, each in first.items() if name in other}
    return {**first, **other, **both}
