"""What the page may ask for, each request checked whole before anything is done, and is told."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from hybridnav._base.trig import hypots
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet import BuildingPlan
from hybridnav.guide.words import Instruction, sentences
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid, RoomLabels, RoomUse
from hybridnav.planning import PlanResult
from hybridnav.rooms.files.outlines import outlines_of
from hybridnav.rooms.files.paint import cells_inside

_FAR = 1e7
"""Grid units beyond which nothing lies: a map has fewer cells."""

Number = Annotated[float, Field(ge=-_FAR, le=_FAR, allow_inf_nan=False)]
Point = Annotated[list[Number], Field(min_length=2, max_length=2)]
FloorNumber = Annotated[int, Field(ge=0, lt=100)]
Name = Annotated[str, StringConstraints(min_length=1, max_length=200)]
_PresetName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]{1,60}$")]


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class FloorPoint(_Strict):
    """A point in grid units of a floor, by the number of the floor; words call it by its name."""

    floor: FloorNumber
    point: Point
    name: Name | None = None


class FloorClosed(_Strict):
    """What is closed on a floor: doors by number, rooms by name, polygons in grid units, and rules
    of what is passed one way."""

    floor: FloorNumber
    doors: Annotated[list[int], Field(max_length=10_000)] = []
    rooms: Annotated[list[Name], Field(max_length=10_000)] = []
    one_way: Annotated[list[Name], Field(max_length=1000)] = []
    polygons: Annotated[
        list[Annotated[list[Point], Field(min_length=3, max_length=1000)]], Field(max_length=100)
    ] = []

    def __bool__(self) -> bool:
        """Return whether anything is closed."""
        return bool(self.doors or self.rooms or self.polygons or self.one_way)


class Closed(_Strict):
    """What is closed: links by name, and the rest by floor."""

    links: Annotated[list[Name], Field(max_length=10_000)] = []
    floors: Annotated[list[FloorClosed], Field(max_length=100)] = []


class PathQuery(_Strict):
    """A query between two points of any floors."""

    start: FloorPoint
    goal: FloorPoint
    preset: _PresetName
    closed: Closed = Closed()
    stairs: bool = True
    language: Annotated[str, StringConstraints(max_length=10)] = "en"
    """The language of the words."""
    profile: Name | None = None
    all_open: bool = False
    """Whether also what is out of order is passed."""


class PlanQuery(PathQuery):
    """A plan; brief while an end is dragged."""

    brief: bool = False


class AlternativesQuery(PathQuery):
    """Some routes between two points: by other doors, over floors by other links."""

    count: Annotated[int, Field(ge=2, le=5)] = 3


class PartQuery(PathQuery):
    """The part of a route on one floor, to be written."""

    floor: FloorNumber


class ClosingChange(_Strict):
    """A link, door or room to close until it is opened again, or to open; see `OutOfOrder`."""

    what: Name
    closed: bool
    why: Annotated[str, Field(max_length=200)] = ""
    by: Annotated[str, Field(max_length=200)] = ""


class At(_Strict):
    """A point whose room is asked for."""

    point: Point


class Stand(_Strict):
    """A room or named point by its name, or the room at a point: where a robot may stand there."""

    name: Name | None = None
    point: Point | None = None


class Find(_Strict):
    """A text as it is typed, for rooms and points that it may mean."""

    text: Annotated[str, StringConstraints(max_length=200)]


class Favour(_Strict):
    """A room or point that is a favourite from now on, or no longer."""

    floor: FloorNumber
    name: Name
    kept: bool


class Undo(_Strict):
    """Take the last change of a version back."""

    version: Annotated[int, Field(ge=0, le=10**9)]


class Edit(Undo):
    """A change of the rooms that everybody saw at a version."""

    change: Annotated[dict[str, Any], Field(max_length=8)]


class Save(Undo):
    """Write the rooms of a version; `replace` writes over a file that others have changed."""

    replace: bool = False


class Rename(_Strict):
    """Another name for a room."""

    op: Literal["rename"]
    room: Name
    name: Name


class Merge(_Strict):
    """One room of two; it has the name of the first."""

    op: Literal["merge"]
    room: Name
    other: Name


class Split(_Strict):
    """Two rooms of one, on both sides of a line; the part on its right has the new name."""

    op: Literal["split"]
    room: Name
    line: Annotated[list[Point], Field(min_length=2, max_length=2)]
    name: Name


class Move(_Strict):
    """A corner of a room's outline elsewhere."""

    op: Literal["move"]
    room: Name
    corner: Point
    to: Point


Change = Rename | Merge | Split | Move
_KINDS: dict[str, type[Change]] = {"rename": Rename, "merge": Merge, "split": Split, "move": Move}
_T = TypeVar("_T", bound=BaseModel)


def checked(kind: type[_T], value: Any) -> _T:
    """Return a request of some kind.

    Raises `InvalidValueError` when a key or value is not as expected; the message names the first.
    """
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "request"
        raise InvalidValueError(f"{where}: {first['msg']}"[:300]) from None


def checked_change(value: dict[str, Any]) -> Change:
    """Return a change of the rooms.

    Raises `InvalidValueError` when it is none.
    """
    op = value.get("op")
    kind = _KINDS.get(op) if isinstance(op, str) else None
    if kind is None:
        raise InvalidValueError(f"op must be one of {', '.join(_KINDS)}, got {op!r:.80}")
    return checked(kind, value)


# Changes of rooms: names, unions, cuts along a line, corners of outlines.

_NEAR = 1.0
"""Grid units within which a corner is meant."""


def changed(rooms: RoomLabels, change: Change, grid: OccupancyGrid) -> RoomLabels:
    """Return rooms after a change.

    `rooms`: the rooms before; `change`: what to do, in grid units. Raises `InvalidValueError` when
    there is no such room, a name is taken or no name, two rooms do not touch, a line cuts nothing
    off, or a room would lose its last free cell.
    """
    if isinstance(change, Rename):
        after = _renamed(rooms, change)
    elif isinstance(change, Merge):
        after = _merged(rooms, change)
    elif isinstance(change, Split):
        after = _split(rooms, change, grid)
    else:
        after = _moved(rooms, change, grid)
    if not after.one_way:
        return after
    from hybridnav.rooms.doors import one_way_that_holds  # noqa: PLC0415 - loads numba

    return replace(after, one_way=tuple(one_way_that_holds(after.one_way, after, grid)))


def rings_of(rooms: RoomLabels, grid: OccupancyGrid) -> list[list[list[list[float]]]]:
    """Return the outline of each room, rings of corners `[column, row]` in grid units."""
    outlines = outlines_of(rooms.label_of, len(rooms.names), grid)
    return [
        [np.round(grid.frame.positions_of(ring)[:, ::-1], 3).tolist() for ring in rings]
        for rings in outlines
    ]


def _renamed(rooms: RoomLabels, change: Rename) -> RoomLabels:
    label = rooms.index(change.room)
    if change.name != change.room and change.name in rooms.names:
        raise InvalidValueError(f"another room is called {change.name!r:.80}: merge the two")
    names = tuple(change.name if at == label else name for at, name in enumerate(rooms.names))
    points = {change.name if name == change.room else name: p for name, p in rooms.points.items()}
    uses = {change.name if name == change.room else name: u for name, u in rooms.uses.items()}
    rules = tuple(rule.renamed({change.room: change.name}) for rule in rooms.one_way)
    return replace(rooms, names=names, points=points, uses=uses, one_way=rules)


def _merged(rooms: RoomLabels, change: Merge) -> RoomLabels:
    kept, gone = rooms.index(change.room), rooms.index(change.other)
    if kept == gone:
        raise InvalidValueError(f"{change.room!r:.80} is one room: choose another one to merge")
    label_of = rooms.label_of
    # Loads scipy's filters, which most requests do not need.
    from scipy.ndimage import binary_dilation  # noqa: PLC0415

    if not (binary_dilation(label_of == kept) & (label_of == gone)).any():
        raise InvalidValueError(
            f"{change.room!r:.80} and {change.other!r:.80} do not touch: only neighbours merge"
        )
    renumbered = np.where(label_of == gone, kept, label_of)
    renumbered = np.where(renumbered > gone, renumbered - 1, renumbered)
    names = tuple(name for at, name in enumerate(rooms.names) if at != gone)
    points = {name: at for name, at in rooms.points.items() if name != change.other}
    uses = {name: use for name, use in rooms.uses.items() if name != change.other}
    one, other = (rooms.uses.get(name, RoomUse()) for name in (change.room, change.other))
    uses[change.room] = replace(  # the stricter of both
        one, private=one.private or other.private, cost=max(one.cost, other.cost)
    )
    rules = tuple(rule.renamed({change.other: change.room}) for rule in rooms.one_way)
    return replace(rooms, names=names, label_of=renumbered, points=points, uses=uses, one_way=rules)


def _split(rooms: RoomLabels, change: Split, grid: OccupancyGrid) -> RoomLabels:
    label = rooms.index(change.room)
    if change.name in rooms.names:
        raise InvalidValueError(f"another room is called {change.name!r:.80}: give a new name")
    (x, y), (to_x, to_y) = change.line
    row, col = np.nonzero(rooms.label_of == label)
    right = (to_x - x) * (row + 0.5 - y) - (to_y - y) * (col + 0.5 - x) < 0
    free = grid.measured[row, col] == CellClass.FREE
    if not (free & right).any() or not (free & ~right).any():
        raise InvalidValueError(f"the line does not cut {change.room!r:.80} in two")
    label_of = rooms.label_of.copy()
    label_of[row[right], col[right]] = len(rooms.names)
    points = {name: at for name, at in rooms.points.items() if name != change.room}
    names, uses = (*rooms.names, change.name), dict(rooms.uses)
    if change.room in uses:  # a part of a private room is private
        uses[change.name] = uses[change.room]
    return replace(rooms, names=names, label_of=label_of, points=points, uses=uses)


def _moved(rooms: RoomLabels, change: Move, grid: OccupancyGrid) -> RoomLabels:
    label = rooms.index(change.room)
    before = [np.array(ring) for ring in rings_of(rooms, grid)[label]]
    after = _with_corner(before, change.corner, change.to)
    was, now = (cells_inside(rings, grid.shape) for rings in (before, after))
    label_of = rooms.label_of.copy()
    flat = label_of.ravel()
    lost = np.setdiff1d(was, now)
    flat[lost[flat[lost] == label]] = NO_ROOM
    flat[np.setdiff1d(now, was)] = label
    free = label_of[grid.measured == CellClass.FREE]
    counts = np.bincount(free[free >= 0], minlength=len(rooms.names))
    if not counts.all():
        empty = rooms.names[int(counts.argmin())]
        raise InvalidValueError(f"{empty!r:.80} would have no free cell left")
    return replace(rooms, label_of=label_of)


def _with_corner(
    rings: list[FloatArray], corner: Sequence[float], to: Sequence[float]
) -> list[FloatArray]:
    """Return rings with the corner that was meant elsewhere."""
    distances = [hypots(*(ring - corner).T) for ring in rings]
    ring = min(range(len(rings)), key=lambda at: float(distances[at].min()))
    if distances[ring].min() > _NEAR:
        raise InvalidValueError("the outline has no such corner: it has changed meanwhile")
    moved = rings[ring].copy()
    moved[int(distances[ring].argmin())] = to
    return [moved if at == ring else each for at, each in enumerate(rings)]


# What the page is told of a plan: its figures, and lines with the places that they are about.

_DECIMALS = 3
_METRE_DECIMALS = 6
"""Decimals of points in metres: the page converts them there and back."""


def in_grid(points_m: ArrayLike, grid: OccupancyGrid) -> list[Any]:
    """Return points `(x, y)` in metres as `[column, row]` in grid units."""
    points = np.asarray(points_m, dtype=np.float64)
    if not points.size:
        return []
    return np.round(grid.frame.positions_of(points)[..., ::-1], _DECIMALS).tolist()


def in_metres(point: Sequence[float], grid: OccupancyGrid) -> tuple[float, float]:
    """Return a point `[column, row]` in grid units as `(x, y)` in metres."""
    x, y = grid.frame.points_of_grid([point[1], point[0]]).round(_METRE_DECIMALS).tolist()
    return x, y


def named_ends(query: PathQuery, points: Sequence[Any]) -> list[Any]:
    """Return what words call the ends of a query: their names, or their points."""
    ends = (query.start, query.goal)
    return [end.name or point for end, point in zip(ends, points, strict=True)]


def lines_of(
    instructions: Sequence[Instruction], language: str, floors: Sequence[tuple[int, OccupancyGrid]]
) -> list[dict[str, Any]]:
    """Return the lines of instructions, each with the place and the door that it is about.

    `instructions`: what a person does on a route; `language`: code of the language; `floors`:
    number and map of each floor that is visited, in order. Raises `InvalidValueError` when there
    are no sentences in this language.
    """
    lines: list[dict[str, Any]] = []
    visited = 0
    for n_told, each in enumerate(instructions, 1):
        # Two instructions may make one line: it is about the first of them.
        while len(sentences(instructions[:n_told], language)) > len(lines):
            floor, grid = floors[min(visited, len(floors) - 1)]
            crossed = each.doorway or each.landmark
            door = None if crossed is None else crossed.door
            at = in_grid(each.position, grid)
            lines.append({"floor": floor, "at": at, "door": door})
        visited += each.kind == "ride"
    texts = sentences(instructions, language)
    return [line | {"text": text} for line, text in zip(lines, texts, strict=False)]


def facts_of(
    plan: PlanResult | BuildingPlan, parts: list[dict[str, Any]], language: str = "en"
) -> dict[str, Any]:
    """Return the figures of a plan, its lines floor by floor, and why there is none, over floors in
    a language; None stands for what is not finite."""
    if isinstance(plan, PlanResult):
        why = plan.settings.get("profile", {}).get("forbids", "")
    else:
        why = plan.note or " ".join(plan.reasons.get(language, ()))
    return {
        "status": str(plan.status),
        "why": why,
        "solved": plan.solved,
        "metric": plan.metric,
        "parts": parts,
        "seconds": round(sum(plan.stats.seconds.values()), 6),
    } | {name: finite(getattr(plan, name)) for name in ("cost", "lower_bound", "gap")}


def finite(value: float | None) -> float | None:
    """Return a number, None for what JSON cannot hold."""
    return value if value is not None and math.isfinite(value) else None
