"""Sources of layers of costs: the origin of the factors, plain values for JSON."""

from __future__ import annotations

from typing import Any

_MOST_SOURCES = 8
"""Sources that a layer names after changes."""


def joined_source(first: dict[str, Any], second: dict[str, Any], how: str) -> dict[str, Any]:
    """Return the source of two layers joined in one way; what was joined so before is one list."""
    parts = [
        part for each in (first, second) for part in (each["of"] if each["kind"] == how else [each])
    ]
    return {"kind": how, "of": parts}


def changed_source(before: dict[str, Any], part: dict[str, Any]) -> dict[str, Any]:
    """Return the source of a layer with a changed part; it does not grow with every change."""
    is_changed = before["kind"] == "changed"
    sources = before["of"] if is_changed else [before]
    left_out = before.get("left_out", 0) if is_changed else 0
    if part not in sources:
        sources = [*sources, part]
    if len(sources) > _MOST_SOURCES:
        sources, left_out = [sources[0], *sources[2:]], left_out + 1
    source = {"kind": "changed", "of": sources}
    return source | {"left_out": left_out} if left_out else source
