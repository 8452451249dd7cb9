"""What a program may ask, and the shape of what it gets: checked whole before anything is done.
Public: `Tool` and `TOOLS`.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    ValidationError,
    WrapValidator,
)
from pydantic_core import PydanticCustomError

from hybridnav.errors import HybridNavError, InvalidValueError, brief
from hybridnav.maps.names import did_you_mean

# Language models send lists as their JSON text, one thing for a list of one, and true for a number.


def _decoded(value: object) -> Any:
    """Return the list that a text is the JSON of; every other value as it is."""
    if isinstance(value, str) and value.lstrip().startswith("["):
        try:
            return json.loads(value)
        except (ValueError, RecursionError):
            return value
    return value


def as_list(value: object) -> Any:
    """Return a list of one for one thing, and the list that a text is the JSON of."""
    value = _decoded(value)
    return [value] if isinstance(value, str) or type(value) is int else value


def _no_truth(value: object) -> Any:
    if isinstance(value, bool):
        raise PydanticCustomError("number", "expected a number")
    return value


def said(expected: str) -> WrapValidator:
    """Return a validator that decodes lists, and states in words what it expects."""

    def checked(value: object, check: Callable[[Any], Any]) -> Any:
        try:
            return check(_decoded(value))
        except ValidationError:
            raise PydanticCustomError("place", expected) from None

    return WrapValidator(checked)


NUMBER = BeforeValidator(_no_truth)
_FAR_M = 1e6
Metres = Annotated[float, NUMBER, Field(ge=-_FAR_M, le=_FAR_M, allow_inf_nan=False)]
_Pair = Annotated[list[Metres], Field(min_length=2, max_length=2, description="x, y in metres")]
Point = Annotated[_Pair, said("a point is [x, y], two numbers in metres")]
Text = Annotated[str, StringConstraints(min_length=1, max_length=200)]
Place = Annotated[
    Text | _Pair,
    said("a place is a name, or a point [x, y] of two numbers"),
    Field(description="a room, a named point, or x, y in metres"),
]
Width = Annotated[
    float,
    NUMBER,
    Field(gt=0, le=100, description="width in metres of who goes; the map's robot if null"),
]
Things = Annotated[
    list[Annotated[int, NUMBER, Field(ge=1, strict=True)] | Text],
    BeforeValidator(as_list),
    Field(max_length=1000),
]
Doors = Annotated[Things, Field(description='doors by number or as "door 12"')]
Avoiding = Annotated[
    Things, Field(max_length=100, description='rooms by name, doors as "door 12" or by number')
]
Language = Annotated[str, StringConstraints(pattern=r"^[a-z]{2}$")]


class Asked(BaseModel):
    """Arguments of a call, none but these."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class DescribeMap(Asked):
    """What the map is: its size, rooms, doors, the robot, and what is closed now."""


class ListRooms(Asked):
    """The rooms, in natural order, with kind, area, a point in each, and doors."""

    kind: Literal["room", "corridor", "hall"] | None = None
    name: Annotated[str, StringConstraints(max_length=200)] = ""
    """Part of a name, in any case."""
    first: Annotated[int, NUMBER, Field(ge=0, le=100_000)] = 0
    count: Annotated[int, NUMBER, Field(ge=1, le=200)] = 10


class WhereAmI(Asked):
    """The room of a point, what lies next to it, and the nearest door."""

    point: Point


class Journey(Asked):
    """Two places, and how one goes."""

    start: Place
    goal: Place
    avoiding: Avoiding = []
    width: Width | None = None


class RouteAsked(Journey):
    """A route, and what is wanted of it."""

    words: bool = True
    words_from: Annotated[int, NUMBER, Field(ge=0, le=10_000)] = 0
    """Lines to leave out, for the rest of a long description."""
    points: bool = False
    """Whether the points of the path are wanted too, at most 200."""
    language: Language = "en"


class RouteBetween(RouteAsked):
    """The shortest path between two places, with a proof, the rooms and doors passed, and words."""

    within: Annotated[float, NUMBER, Field(ge=0, le=_FAR_M)] | None = None
    """Metres from the goal at which a path may end, if the goal cannot be reached."""


class CanReach(Journey):
    """Whether one place can be reached from another, how wide the narrowest passage is, and the
    reason if it cannot."""


class Explain(Journey):
    """Why there is a way or none: the widest that fits, where it is tight, which doors to open."""

    language: Language = "en"


class Nearest(Asked):
    """The nearest rooms or doors by the way one goes, not by the crow."""

    of: Text
    """`rooms`, `doors`, `corridors`, `halls`, or part of a name."""
    start: Place
    count: Annotated[int, NUMBER, Field(ge=1, le=5)] = 1


class Close(Asked):
    """Close doors or rooms for this session; `undo` takes it back."""

    doors: Doors = []
    rooms: Annotated[Things, Field(description="rooms by name")] = []


class Open(Close):
    """Open doors or rooms that are closed in this session."""


class TakeBack(Asked):
    """Take back the last `close`, `open` or `name_room` of this session."""


class NameRoom(Asked):
    """Give a room a name, and save it in the rooms file of the map."""

    room: Text
    name: Text


class Picture(Asked):
    """A picture (PNG) of the map with its rooms, or of a route."""

    start: Place | None = None
    goal: Place | None = None


# Answers: what cannot be answered has the first three fields alone.


class Answer(BaseModel):
    """What every call returns."""

    model_config = ConfigDict(extra="forbid")
    ok: bool
    """Whether there is an answer. If there is none, `text` says what to ask or to change."""
    text: str
    """The answer in words."""
    choices: list[Room | dict[str, str]] | None = None
    """What a name may mean, if it may mean several things."""


class Room(BaseModel):
    """A room in a list."""

    name: str
    floor: str | None = None
    kind: Literal["room", "corridor", "hall"]
    area_m2: float
    point: list[float]
    """A point in it, x and y in metres."""
    doors: list[int]


class ClosedNow(BaseModel):
    """What is closed in this session; in a building doors and rooms with their floor."""

    doors: list[int | str]
    rooms: list[str]
    links: list[str] | None = None


class Tight(BaseModel):
    """Where the widest way is tightest."""

    point: list[float]
    door: int | None


class Beside(BaseModel):
    """A door, and what lies behind it."""

    door: int
    to: str | None
    kind: str


class NearDoor(BaseModel):
    """The door that is nearest by the crow."""

    number: int
    straight_m: float


class Near(BaseModel):
    """A room or a door, and how far it is by the way one goes."""

    length_m: float
    lower_bound_m: float
    """No path to it is shorter, or in a building cheaper."""
    cost_m: float | None = None
    """In a building: the length, and what rides are charged."""
    floor: str | None = None
    name: str | None = None
    kind: str | None = None
    area_m2: float | None = None
    point: list[float] | None = None
    doors: list[int] | None = None
    number: int | None = None
    rooms: list[str | None] | None = None


class Facts(BaseModel):
    """What describes a floor."""

    floor: str
    size_m: list[float]
    corners: list[list[float]]
    free_m2: float
    rooms: dict[str, int]
    doors: int


class LinkFacts(BaseModel):
    """A lift, stairs or a ramp, and the floors where it stops."""

    name: str
    kind: str
    floors: list[str]


class RoutePart(BaseModel):
    """The way on one floor, and the ride that it ends with."""

    floor: str
    length_m: float
    rooms: list[str]
    doors: list[int]
    ride: dict[str, str | float] | None = None


class MapAnswer(Answer):
    """The answer of `describe_map`."""

    name: str | None = None
    size_m: list[float] | None = None
    corners: list[list[float]] | None = None
    free_m2: float | None = None
    rooms: dict[str, int] | None = None
    doors: int | None = None
    robot_radius_m: float | None = None
    floors: list[Facts] | None = None
    """The floors of a building, from the lowest, in place of the figures of a map."""
    links: list[LinkFacts] | None = None
    closed: ClosedNow | None = None
    edits_allowed: bool | None = None


class RoomsAnswer(Answer):
    """The answer of `list_rooms`."""

    total: int | None = None
    rooms: list[Room] | None = None


class PlaceAnswer(Answer):
    """The answer of `where_am_i`."""

    room: str | None = None
    floor: str | None = None
    ground: Literal["free", "occupied", "unexplored"] | None = None
    beside: list[Beside] | None = None
    nearest_door: NearDoor | None = None


class WhyAnswer(Answer):
    """The answer of `explain`, and of ways that are not there."""

    status: str | None = None
    reason: list[str] | None = None
    doors_to_open: list[int] | None = None
    to_open: list[str] | None = None
    """In a building: what has to open for a route, all of it, as `open` takes it."""
    widest_m: float | None = None
    tight: Tight | None = None
    has_path: bool | None = None
    through_unexplored: bool | None = None


class RouteAnswer(WhyAnswer):
    """The answer of `route`."""

    length_m: float | None = None
    lower_bound_m: float | None = None
    """No path is shorter, or in a building cheaper."""
    gap: float | None = None
    cost_m: float | None = None
    """In a building: the length, and what rides are charged."""
    travel_s: float | None = None
    parts: list[RoutePart] | None = None
    """In a building: the way on each floor, in order."""
    short_m: float | None = None
    """Metres from the end of the path to the goal, if it cannot be reached."""
    start: list[float] | None = None
    goal: list[float] | None = None
    rooms: list[str] | None = None
    doors: list[int] | None = None
    words: list[str] | None = None
    words_left: int | None = None
    """Lines after these: ask with `words_from`."""
    points: list[list[float | str]] | None = None


class ReachAnswer(WhyAnswer):
    """The answer of `can_reach`."""

    can_reach: bool | None = None
    length_m: float | None = None
    cost_m: float | None = None


class NearestAnswer(Answer):
    """The answer of `nearest`."""

    nearest: list[Near] | None = None
    others_at_least_m: float | None = None
    """No other one is nearer than that; None if there is no other."""


class ChangeAnswer(Answer):
    """The answer of what changes something."""

    closed: ClosedNow | None = None
    room: Room | None = None


class PictureAnswer(WhyAnswer):
    """The answer of `picture`; the picture itself comes beside it."""


class Tool(NamedTuple):
    """A function that programs call.

    Examples
    --------
    >>> from hybridnav.ext.agent import TOOLS
    >>> [tool.name for tool in TOOLS if tool.edits]
    ['close', 'open', 'undo', 'name_room']
    """

    name: str
    """Name by which programs call it."""
    asks: type[BaseModel]
    """The model of its arguments. The docstring of the model describes the tool to its callers."""
    gives: type[Answer]
    """The model of its answer."""
    edits: bool = False
    """Whether it changes the map for others, and is refused unless edits are allowed."""


TOOLS = (
    Tool("describe_map", DescribeMap, MapAnswer),
    Tool("list_rooms", ListRooms, RoomsAnswer),
    Tool("where_am_i", WhereAmI, PlaceAnswer),
    Tool("route", RouteBetween, RouteAnswer),
    Tool("can_reach", CanReach, ReachAnswer),
    Tool("nearest", Nearest, NearestAnswer),
    Tool("explain", Explain, WhyAnswer),
    Tool("picture", Picture, PictureAnswer),
    Tool("close", Close, ChangeAnswer, edits=True),
    Tool("open", Open, ChangeAnswer, edits=True),
    Tool("undo", TakeBack, ChangeAnswer, edits=True),
    Tool("name_room", NameRoom, ChangeAnswer, edits=True),
)
"""All functions, for every protocol."""


# Calls, for every protocol.

LIMIT_S = 30.0
"""Seconds after which a call is answered with an error."""
INSTRUCTIONS = (
    "A map of a building for robots and people: rooms, doors, and shortest paths with a proof. "
    "Places are names of rooms or points {point} in metres. Begin with describe_map and "
    "list_rooms. An answer with ok=false says in `text` what to do, and in `choices` what a name "
    "may mean."
)
"""What a client reads first, with the form of a point."""


class UnclearError(HybridNavError):
    """A name that means nothing, or several things."""

    def __init__(self, text: str, choices: Iterable[dict[str, Any]] = ()) -> None:
        super().__init__(text)
        self.choices = list(choices)


def answer_of(
    functions: Mapping[Tool, Callable[[Any], dict[str, Any]]],
    name: str,
    arguments: dict[str, Any],
    *,
    allow_edits: bool,
) -> dict[str, Any]:
    """Answer a call by one of some functions, or say what to ask instead."""
    tool = next((one for one in functions if one.name == name), None)
    try:
        if tool is None:
            names = tuple(one.name for one in tools(functions, allow_edits=allow_edits))
            raise InvalidValueError(f"no function {name!r:.80}{did_you_mean(name, names)}")
        if tool.edits and not allow_edits:
            raise InvalidValueError(
                f"{name} changes what others see: start the server with --allow-edits"
            )
        return {"ok": True, **functions[tool](tool.asks.model_validate(arguments))}
    except ValidationError as error:
        assert tool is not None  # noqa: S101 - its model has refused
        return _refused(mistake(error, tuple(tool.asks.model_fields))[:300])
    except UnclearError as error:
        return _refused(str(error)) | {"choices": error.choices}
    except HybridNavError as error:
        return _refused(str(error))


def _refused(text: str) -> dict[str, Any]:
    return {"ok": False, "text": text}


async def answered(
    call: Callable[[str, dict[str, Any]], dict[str, Any]], name: str, arguments: dict[str, Any]
) -> dict[str, Any]:
    """Answer a call in a thread, within its time."""
    try:
        return await asyncio.wait_for(asyncio.to_thread(call, name, arguments), LIMIT_S)
    except asyncio.TimeoutError:
        return {"ok": False, "text": f"no answer within {LIMIT_S:g} s: ask again, and for less"}


def tools(known: Iterable[Tool] = TOOLS, *, allow_edits: bool) -> tuple[Tool, ...]:
    """Return the functions that a client may call."""
    return tuple(tool for tool in known if allow_edits or not tool.edits)


def mistake(error: ValidationError, known: Sequence[str]) -> str:
    """Return what is wrong with arguments: the argument, what was expected, what was given.

    `known`: the names of the arguments.
    """
    first = error.errors()[0]
    # Names of arguments and places in lists; the rest are pydantic's names of kinds.
    name, *rest = [*first["loc"], ""]
    at = "".join([str(name), *(f"[{part}]" for part in rest if isinstance(part, int))])
    if first["type"] == "extra_forbidden":
        return f"no argument {name!r:.80}{did_you_mean(str(name), tuple(known))}"
    if first["type"] == "missing":
        return f"{at} is missing: the arguments are {', '.join(known)}"
    message = first["msg"].replace("Input should be", "expected").replace("\n", " ")
    return f"{at or 'arguments'}: {message}, got {brief(first['input'])}"


def schema_of(asks: Any) -> dict[str, Any]:
    """Return the JSON schema of the arguments of a function."""
    schema: dict[str, Any] = asks.model_json_schema()
    schema.pop("description", None)
    return schema
