"""The table of methods: what each is, its version and settings, and where it was not asked."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from hybridnav.config import Preset

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav.harness.analysis import Study
    from hybridnav.harness.outcome import Outcome
    from hybridnav.harness.records import Record
    from hybridnav.harness.tables import Row

METHOD_COLUMNS = ("kind", "version", "settings", "not asked")
"""Columns of the table of methods."""


def rows_of_methods(study: Study) -> list[Row]:
    """Return one row for each method of a study."""
    rows: list[Row] = []
    for label in study.labels:
        outcomes = study.of_method(label)
        # A method that could not be made on a map has no version there.
        best = max((o.preparation for o in outcomes), key=len)
        rows.append(
            {
                "method": label,
                "kind": _kind(best),
                "version": _version(best),
                "settings": _settings(best),
                "not asked": _not_asked(outcomes, len(study.maps)),
            }
        )
    return rows


def _kind(record: Record) -> str:
    made_by = str(record.get("made_by", record["method"]))
    if "graph" in record:
        return f"graph, {record['graph']['format']}"
    kind = "class"
    if record.get("preset") is not None:
        kind, made_by = "preset", str(record["preset"].get("name", made_by))
    elif ":" not in made_by:
        # Earlier versions had names for planners of others, and noted the versions of these.
        kind = "planner of others" if "version" in record else "baseline"
    # A class is shown by the name that it gives itself.
    is_named = made_by != record["method"] or kind == "class"
    return f"{kind} {made_by}" if is_named else kind


def _version(record: Record) -> str:
    if record.get("version"):
        return str(record["version"])
    if "source" in record:
        return f"file {record['source']}"
    own = record.get("environment", {}).get("hybridnav", "")
    return f"hybridnav {own}" if own and "graph" not in record else ""


def _settings(record: Record) -> str:
    given = record.get("settings") or {}
    if record.get("preset") is not None:
        given = _unlike(record["preset"].get("planner", {}), _DEFAULTS["planner"])
    words = record.get("settings_text") or _words(given)
    grid = record.get("grid") or {}
    return words + (f"{'; ' if words else ''}on a grid with {_words(grid)}" if grid else "")


_DEFAULTS = Preset().model_dump()


def _words(settings: dict[str, Any]) -> str:
    texts = {
        key: value if isinstance(value, str) else json.dumps(value)
        for key, value in settings.items()
    }
    return ", ".join(f"{key} {text}" for key, text in texts.items())


def _unlike(own: dict[str, Any], usual: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the settings that differ from the usual ones, by dotted key."""
    found: dict[str, Any] = {}
    for key, value in own.items():
        other = usual.get(key)
        if isinstance(value, dict):
            inner = other if isinstance(other, dict) else _of_section(key)
            found |= _unlike(value, inner, f"{prefix}{key}.")
        elif value != other and value is not None:
            found[f"{prefix}{key}"] = value
    return found


def _of_section(key: str) -> dict[str, Any]:
    from hybridnav.config import OmplSettings  # noqa: PLC0415 - rarely needed

    return OmplSettings().model_dump() | {"planner": None} if key == "ompl" else {}


def _not_asked(outcomes: Sequence[Outcome], n_maps: int) -> str:
    """Return the maps on which a method was not asked, and the reason on the first."""
    without = [outcome for outcome in outcomes if not outcome.is_asked]
    if not without:
        return ""
    reason = str(without[0].preparation.get("error", ""))
    where = "" if n_maps == 1 else f"on {len(without)} of {n_maps} maps: "
    return where + reason
