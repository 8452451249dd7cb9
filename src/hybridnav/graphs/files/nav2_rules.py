"""Values of a GeoJSON feature that Nav2's route server takes, and those at which it stops.

The rules are those of nav2_route 1.5.0 (Jazzy's 1.3.13 and Kilted's 1.4.2 have the same):
`geojson_graph_file_loader.cpp`, the scorers of edges, `route_planner.cpp`, and
`route_operation_client.hpp`.
"""

import json
import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.graphs.gather import number_of

MOST_ID = 2**32 - 1
"""Nav2 holds ids as unsigned integers of 32 bits."""
_FLOATS = ("speed_limit", "abs_speed_limit", "abs_time_taken", "penalty")
"""Metadata of edges that scorers cast to `float`: an integer is a bad cast, and ends the route."""
_TRIGGERS = ("NODE", "ON_ENTER", "ON_EXIT")
_NO_JSON = re.compile(r"NaN|Infinity|[eE]\+?\d{3}|\d{309}|\\u[dD][89a-fA-F]")
"""What numbers that are not finite, and halves of a letter, look like."""
_NESTED = (dict, list, type(None))


def is_id(value: Any) -> bool:
    """Return whether Nav2's loader takes a value for an id, whatever id that becomes."""
    return isinstance(value, int | float) and _is_json(value)


def held_id(value: Any) -> Any:
    """Return the id that Nav2 holds for a value: without its fraction, and modulo 2^32; the value
    itself where the loader stops."""
    return int(value) % (MOST_ID + 1) if is_id(value) else value


def may_stop(text: str) -> bool:
    """Return whether a file may hold what `no_json` finds."""
    return _NO_JSON.search(text) is not None


def no_json(value: Any, where: str) -> Iterator[str]:
    """Yield what no JSON can hold, and Nav2's parser refuses: NaN, infinity, half a letter."""
    waiting = [(where, value)]
    while waiting:
        at, one = waiting.pop()
        if isinstance(one, list | dict):
            items = one.items() if isinstance(one, dict) else enumerate(one)
            waiting += [(f"{at}.{key}", each) for key, each in items]
        if not _is_json(one) or (isinstance(one, dict) and not all(map(_is_json, one))):
            yield f"{at} holds what no JSON can: NaN, infinity or half a letter"


def _is_json(value: Any) -> bool:
    try:
        is_text = isinstance(value, str) and value.encode() is not None
        return is_text or not isinstance(value, int | float) or math.isfinite(value)
    except (OverflowError, UnicodeEncodeError):
        return False


def refusals(feature: dict[str, Any], facts: dict[str, Any], *, is_edge: bool) -> Iterator[str]:
    """Yield why Nav2's loader stops at a feature and its properties, ids aside."""
    if not is_drawn(feature):
        yield "no geometry"
    expected = (("cost", int | float, "a number"), ("overridable", bool, "true or false"))
    for key, kind, words in expected if is_edge else (("frame", str, "a text"),):
        if key in facts and not isinstance(facts[key], kind):
            yield f"{key} is {_shown(facts[key])}, expected {words}"
    if not is_edge:
        at = feature["geometry"].get("coordinates") if is_drawn(feature) else None
        if isinstance(at, list) and any(isinstance(each, str | None) for each in at[:2]):
            yield f"coordinates are {_shown(at)}, expected numbers"
    yield from _unheld(facts.get("metadata"), "metadata")
    for operation in _operations(facts):
        if not is_operation(operation):
            yield f"an operation is {_shown(operation)}, expected a type, a text, and a trigger"
        else:
            yield from _unheld(operation.get("metadata"), "metadata of an operation")


def is_drawn(feature: dict[str, Any]) -> bool:
    """Return whether a feature has a geometry of some type, without which Nav2's loader stops."""
    geometry = feature.get("geometry")
    return isinstance(geometry, dict) and geometry.get("type") is not None


def is_operation(value: Any) -> bool:
    """Return whether Nav2's loader takes a value for an operation."""
    return isinstance(value, dict) and isinstance(value.get("type"), str) and "trigger" in value


def _unheld(metadata: Any, where: str) -> Iterator[str]:
    """Yield the paths to null, and to lists of other things than plain values."""
    if isinstance(metadata, list):  # read as an object of its numbers; objects in it are lost
        metadata = {str(k): v for k, v in enumerate(metadata) if not isinstance(v, dict)}
    waiting = [(where, metadata)] if isinstance(metadata, dict) else []
    while waiting:
        at, one = waiting.pop()
        for key, each in one.items():
            if isinstance(each, dict):
                waiting.append((f"{at}.{key}", each))
            elif each is None:
                yield f"{at}.{key} is null"
            elif isinstance(each, list) and any(isinstance(item, _NESTED) for item in each):
                yield f"{at}.{key} is a list of lists, objects or null, expected plain values"


def _operations(facts: dict[str, Any]) -> list[Any]:
    """Return the operations of a feature, which stand in a list or, as Nav2 saves them, an object;
    any other value is one operation to Nav2's loop."""
    given = facts.get("operations")
    if isinstance(given, dict):
        return list(given.values())
    return given if isinstance(given, list) else [] if given is None else [given]


def fails_later(facts: dict[str, Any], *, is_edge: bool) -> Iterator[str]:
    """Yield what Nav2 loads and fails at afterwards, or takes for another value."""
    metadata = facts.get("metadata")
    metadata = metadata if isinstance(metadata, dict) else {}
    kind = metadata.get("class", "")
    if not isinstance(kind, str):
        yield f"class is {_shown(kind)}: SemanticScorer fails at all but texts"
    for operation in filter(is_operation, _operations(facts)):
        if operation["trigger"] not in _TRIGGERS:
            known = ", ".join(_TRIGGERS)
            yield f"trigger {_shown(operation['trigger'])} is none of {known}: it becomes NODE"
        service = operation.get("metadata")
        service = service.get("service_name", "") if isinstance(service, dict) else ""
        if not isinstance(service, str):
            yield f"service_name is {_shown(service)}: an operation fails at all but texts"
    if not is_edge:
        return
    for key in _FLOATS:
        if key in metadata and not isinstance(metadata[key], float):
            yield f"{key} is {_shown(metadata[key])}: scorers fail at all but numbers with a point"
    limit = metadata.get("speed_limit")
    if isinstance(limit, float) and not limit > 0:
        yield f"speed_limit is {limit:g}: DistanceScorer divides by it"
    cost = facts.get("cost", 0)
    if facts.get("overridable") is False and isinstance(cost, int | float) and not cost > 0:
        yield f"cost is {_shown(cost)} and not overridable: no valid graph, when Nav2 plans"


def _shown(value: Any) -> str:
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else "a list"
    return "null" if value is None else f"{value!r:.60}"


# The other way: facts as Nav2 takes them.

_DEEPEST = 64
_LARGEST = 2**1023
"""Integers beyond have more digits than readers take."""


def plain(value: Any, depth: int = 0) -> Any:
    """Return a value as JSON has it, None for what is left out."""
    if depth > _DEEPEST:
        raise InvalidValueError(
            f"a fact is nested more than {_DEEPEST} deep, or contains itself: leave it out"
        )
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, dict):
        items = ((str(key), plain(item, depth + 1)) for key, item in value.items())
        return {key: item for key, item in items if item is not None}
    if isinstance(value, list | tuple):
        listed = (plain(item, depth + 1) for item in value)
        return [item for item in listed if item is not None]
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, int):
        return value if abs(value) < _LARGEST else None
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value)


def held(value: Any) -> Any:
    """Return a plain value as Nav2's metadata hold it.

    Lists of lists or objects become JSON in a text, integers of more than 32 bits a text of digits.
    """
    if isinstance(value, dict):
        return {key: held(each) for key, each in value.items()}
    if isinstance(value, list):
        nested = any(isinstance(each, _NESTED) for each in value)
        return json.dumps(value, ensure_ascii=False) if nested else [held(each) for each in value]
    is_long = isinstance(value, int) and not -(2**31) <= value <= MOST_ID
    return str(value) if is_long else value


def held_metadata(facts: Any, *, is_edge: bool) -> Any:
    """Return metadata as Nav2's loader and scorers take them: `class` as a text, and what scorers
    read of edges as floats; what is no number there is left out."""
    known = held(plain(facts))
    if not isinstance(known, dict):
        return known
    if not isinstance(known.get("class", ""), str):
        known["class"] = json.dumps(known["class"], ensure_ascii=False)
    if not is_edge:
        return known
    known |= {key: number_of(known[key]) for key in _FLOATS if key in known}
    if not known.get("speed_limit", 1) > 0:  # DistanceScorer divides by it
        del known["speed_limit"]
    return {key: each for key, each in known.items() if each == each}  # noqa: PLR0124 - NaN


def held_properties(facts: dict[str, Any], *, is_edge: bool) -> dict[str, Any]:
    """Return the properties of a feature of Nav2 as it takes them; the rest is left out."""
    operations = facts.get("operations")
    known = plain(
        {key: each for key, each in facts.items() if key not in {"metadata", "operations"}}
    )
    if not isinstance(known.get("frame", ""), str):
        del known["frame"]
    if facts.get("metadata") is not None:
        known["metadata"] = held_metadata(facts["metadata"], is_edge=is_edge)
    if isinstance(operations, dict):
        kept = {key: _operation(each) for key, each in operations.items() if is_operation(each)}
        known["operations"] = kept
    elif isinstance(operations, list):
        known["operations"] = [_operation(each) for each in operations if is_operation(each)]
    if is_edge and not isinstance(known.get("overridable", True), bool):
        del known["overridable"]
    return known


def _operation(given: dict[str, Any]) -> dict[str, Any]:
    """Return an operation as Nav2 takes it; an unknown trigger is what it becomes there."""
    known = plain(given)
    if known.get("trigger") not in _TRIGGERS:
        known["trigger"] = _TRIGGERS[0]
    if "metadata" in known:
        known["metadata"] = metadata = held(known["metadata"])
        if isinstance(metadata, dict) and not isinstance(metadata.get("service_name", ""), str):
            del metadata["service_name"]
    return known
