"""What a program may ask over the floors of a building, where that is not what it asks one map."""

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, create_model

from hybridnav.ext.agent import questions as ask
from hybridnav.ext.agent.questions import Asked, Metres, Text


def _as_text(value: object) -> Any:
    return str(value) if type(value) is int else value


Floor = Annotated[Text, BeforeValidator(_as_text)]
Place = Annotated[
    Text | tuple[Floor, Metres, Metres],
    ask.said(
        'a place is a name, with its floor as "floor 2, lobby", or a point [floor, x, y]: '
        "the name of a floor and two numbers"
    ),
    Field(description='a room or named point, as "floor 2, lobby", or [floor, x, y] in metres'),
]
Things = Annotated[
    ask.Things,
    Field(
        max_length=100,
        description='"floor 2, door 4", "floor 2, lobby", links by name, "lift@2" on one floor',
    ),
]


def _over_floors(model: type[Asked], about: str, **more: Any) -> type[Asked]:
    """Return a model of arguments whose places are those of a building, with more arguments."""
    fields: dict[str, Any] = {
        name: (Place, ...) if field.is_required() else (Place | None, None)
        for name, field in model.model_fields.items()
        if name in {"start", "goal", "point"}
    }
    about = about or str(model.__doc__)
    made: type[Asked] = create_model(
        model.__name__, __base__=model, __doc__=about, **fields, **more
    )
    return made


_AVOIDING: dict[str, Any] = {"avoiding": (Things, [])}
_VIA = Annotated[
    list[Place],
    BeforeValidator(ask.as_list),
    Field(max_length=10, description="places to pass on the way, in their order"),
]
_CLOSED: dict[str, Any] = {"doors": (Things, []), "rooms": (Things, []), "links": (Things, [])}
_ASKS = {
    "list_rooms": _over_floors(
        ask.ListRooms,
        "The rooms of all floors or of one: floor, kind, area, a point in each, doors.",
        floor=(Floor | None, None),
    ),
    "where_am_i": _over_floors(ask.WhereAmI, ""),
    "route": _over_floors(
        ask.RouteAsked,
        "The cheapest route between two places of any floors, with a proof: the parts on each "
        "floor, the rides between them, and words.",
        via=(_VIA, []),
        **_AVOIDING,
    ),
    "can_reach": _over_floors(
        ask.CanReach, "Whether one can go, by which links, and the reason if not.", **_AVOIDING
    ),
    "nearest": _over_floors(
        ask.Nearest, "The nearest rooms or doors of all floors by the way one goes, with rides."
    ),
    "explain": _over_floors(
        ask.Explain,
        "Why there is a route or none: where it is tight on each floor, what would have to open.",
        **_AVOIDING,
    ),
    "picture": _over_floors(ask.Picture, "A picture (PNG) of the floors, or of a route."),
    "close": _over_floors(
        ask.Close, "Close doors, rooms or links for this session; `undo` takes it back.", **_CLOSED
    ),
    "open": _over_floors(ask.Open, "Open what is closed in this session.", **_CLOSED),
}
TOOLS = tuple(one._replace(asks=_ASKS.get(one.name, one.asks)) for one in ask.TOOLS)
"""All functions of a building: those of one map, with floors."""
