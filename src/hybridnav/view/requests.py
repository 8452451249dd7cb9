"""What the page may ask for: each request is checked whole before anything is done."""

from __future__ import annotations

from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from hybridnav.errors import InvalidValueError

_FAR = 1e7
"""Grid units beyond which nothing lies: a map has fewer cells."""

Number = Annotated[float, Field(ge=-_FAR, le=_FAR, allow_inf_nan=False)]
Point = Annotated[list[Number], Field(min_length=2, max_length=2)]
FloorNumber = Annotated[int, Field(ge=0, lt=100)]
Name = Annotated[str, StringConstraints(min_length=1, max_length=200)]
_PresetName = Annotated[str, StringConstraints(pattern=r"^[A-Za-z0-9_-]{1,60}$")]


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class Closed(_Strict):
    """What is closed: doors by number, rooms by name, polygons in grid units."""

    doors: Annotated[list[int], Field(max_length=10_000)] = []
    rooms: Annotated[list[Name], Field(max_length=10_000)] = []
    polygons: Annotated[
        list[Annotated[list[Point], Field(min_length=3, max_length=1000)]], Field(max_length=100)
    ] = []

    def __bool__(self) -> bool:
        """Return whether anything is closed."""
        return bool(self.doors or self.rooms or self.polygons)


class PathQuery(_Strict):
    """A query between two points in grid units."""

    start: Point
    goal: Point
    preset: _PresetName
    closed: Closed = Closed()


class PlanQuery(PathQuery):
    """A plan; brief while an end is dragged."""

    brief: bool = False


class AlternativesQuery(PathQuery):
    """Some routes between two points."""

    count: Annotated[int, Field(ge=2, le=5)] = 3
    by: Literal["doors", "homotopy"] = "doors"


class FloorPoint(_Strict):
    """A point in grid units of a floor of a building, by the number of the floor."""

    floor: FloorNumber
    point: Point


class FloorClosed(Closed):
    """What is closed on a floor."""

    floor: FloorNumber


class BuildingClosed(_Strict):
    """What is closed in a building: links by name, and the rest by floor."""

    links: Annotated[list[Name], Field(max_length=10_000)] = []
    floors: Annotated[list[FloorClosed], Field(max_length=100)] = []


class FloorsQuery(_Strict):
    """A query between two points on any floors of a building."""

    start: FloorPoint
    goal: FloorPoint
    preset: _PresetName
    closed: BuildingClosed = BuildingClosed()
    stairs: bool = True


class FloorsPlanQuery(FloorsQuery):
    """A plan over floors; brief while an end is dragged."""

    brief: bool = False


class FloorsAlternativesQuery(FloorsQuery):
    """Some routes by different links."""

    count: Annotated[int, Field(ge=2, le=5)] = 3


class FloorsPathQuery(FloorsQuery):
    """The part of a route on one floor, to be written."""

    floor: FloorNumber


class At(_Strict):
    """A point whose room is asked for."""

    point: Point


class Edit(_Strict):
    """A change of the rooms that everybody saw at a version."""

    version: Annotated[int, Field(ge=0, le=10**9)]
    change: Annotated[dict[str, Any], Field(max_length=8)]


class Undo(_Strict):
    """Take the last change of a version back."""

    version: Annotated[int, Field(ge=0, le=10**9)]


class Save(_Strict):
    """Write the rooms of a version; `replace` writes over a file that others have changed."""

    version: Annotated[int, Field(ge=0, le=10**9)]
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
_KINDS: dict[str, type[Change]] = {
    "rename": Rename,
    "merge": Merge,
    "split": Split,
    "move": Move,
}
_T = TypeVar("_T", bound=BaseModel)


def checked(kind: type[_T], value: Any) -> _T:
    """Return a request of some kind.

    Raises
    ------
    InvalidValueError
        When a key or value is not as expected; the message names the first.
    """
    try:
        return kind.model_validate(value)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(map(str, first["loc"])) or "request"
        raise InvalidValueError(f"{where}: {first['msg']}"[:300]) from None


def checked_change(value: dict[str, Any]) -> Change:
    """Return a change of the rooms.

    Raises
    ------
    InvalidValueError
        When it is none.
    """
    op = value.get("op")
    kind = _KINDS.get(op) if isinstance(op, str) else None
    if kind is None:
        raise InvalidValueError(f"op must be one of {', '.join(_KINDS)}, got {op!r:.80}")
    found: Change = checked(kind, value)
    return found
