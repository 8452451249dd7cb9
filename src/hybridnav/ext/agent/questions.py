"""What a program may ask, and the shape of what it gets: checked whole before anything is done."""

from __future__ import annotations

from typing import Annotated, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

_FAR_M = 1e6
_Metres = Annotated[float, Field(ge=-_FAR_M, le=_FAR_M, allow_inf_nan=False)]
Point = Annotated[list[_Metres], Field(min_length=2, max_length=2, description="x, y in metres")]
Text = Annotated[str, StringConstraints(min_length=1, max_length=200)]
Place = Annotated[Text | Point, Field(description="a room, a named point, or x, y in metres")]
Width = Annotated[
    float, Field(gt=0, le=100, description="width in metres of who goes; the map's robot if null")
]
Avoiding = Annotated[
    list[Text], Field(max_length=100, description='rooms by name, doors as "door 12"')
]
Language = Annotated[str, StringConstraints(pattern=r"^[a-z]{2}$")]


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class DescribeMap(_Strict):
    """What the map is: its size, rooms, doors, the robot, and what is closed now."""


class ListRooms(_Strict):
    """The rooms, in natural order, with kind, area, a point in each, and doors."""

    kind: Literal["room", "corridor", "hall"] | None = None
    name: Annotated[str, StringConstraints(max_length=200)] = ""
    """Part of a name, in any case."""
    first: Annotated[int, Field(ge=0, le=100_000)] = 0
    count: Annotated[int, Field(ge=1, le=200)] = 10


class WhereAmI(_Strict):
    """The room of a point, what lies next to it, and the nearest door."""

    point: Point


class Journey(_Strict):
    """Two places, and how one goes."""

    start: Place
    goal: Place
    avoiding: Avoiding = []
    width: Width | None = None


class RouteBetween(Journey):
    """The shortest path between two places, with a proof, the rooms and doors passed, and words."""

    words: bool = True
    points: bool = False
    """Whether the points of the path are wanted too, at most 200."""
    language: Language = "en"


class CanReach(Journey):
    """Whether one place can be reached from another, how wide the narrowest passage is, and the
    reason if it cannot."""


class Explain(Journey):
    """Why there is a way or none: the widest that fits, where it is tight, which doors to open."""

    language: Language = "en"


class Nearest(_Strict):
    """The nearest rooms or doors by the way one goes, not by the crow."""

    of: Text
    """`room`, `door`, `corridor`, `hall`, or part of a name."""
    start: Place
    count: Annotated[int, Field(ge=1, le=5)] = 1


class Close(_Strict):
    """Close doors or rooms for this session; `undo` takes it back."""

    doors: Annotated[list[int], Field(max_length=1000)] = []
    rooms: Annotated[list[Text], Field(max_length=1000)] = []


class Open(Close):
    """Open doors or rooms that are closed in this session."""


class Undo(_Strict):
    """Take back the last `close`, `open` or `name_room` of this session."""


class NameRoom(_Strict):
    """Give a room a name, and save it in the rooms file of the map."""

    room: Text
    name: Text


class Picture(_Strict):
    """A picture (PNG) of the map with its rooms, or of a route."""

    start: Place | None = None
    goal: Place | None = None


class Answer(BaseModel):
    """What every call returns; further fields are those that the call is about."""

    model_config = ConfigDict(extra="allow")
    ok: bool
    """Whether the question was answered; if not, `text` says what to do."""
    text: str
    """The answer in words."""
    choices: list[dict[str, Any]] = []
    """What a name may mean, if it may mean several things."""


class Tool(NamedTuple):
    """A function that programs call.

    Examples
    --------
    >>> from hybridnav.ext.agent import TOOLS
    >>> [tool.name for tool in TOOLS if tool.edits]
    ['close', 'open', 'undo', 'name_room']
    """

    name: str
    asks: type[BaseModel]
    """Its arguments; the docstring says what it is for."""
    edits: bool
    """Whether it changes what others see, and is refused unless edits are allowed."""


TOOLS = (
    Tool("describe_map", DescribeMap, False),
    Tool("list_rooms", ListRooms, False),
    Tool("where_am_i", WhereAmI, False),
    Tool("route", RouteBetween, False),
    Tool("can_reach", CanReach, False),
    Tool("nearest", Nearest, False),
    Tool("explain", Explain, False),
    Tool("picture", Picture, False),
    Tool("close", Close, True),
    Tool("open", Open, True),
    Tool("undo", Undo, True),
    Tool("name_room", NameRoom, True),
)
"""All functions, for every protocol."""
