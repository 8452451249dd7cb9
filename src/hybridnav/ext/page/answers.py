"""What the page is told of a plan: its figures, and lines with the places that they are about."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.planner import PlanResult
from hybridnav.planner.guide import sentences

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from hybridnav.ext.fleet import BuildingPlan
    from hybridnav.ext.page.requests import PathQuery
    from hybridnav.maps import OccupancyGrid
    from hybridnav.planner.guide import Instruction

_DECIMALS = 3
_METRE_DECIMALS = 6
"""Decimals of points in metres: the page converts them there and back."""


def in_grid(points_m: ArrayLike, grid: OccupancyGrid) -> list[Any]:
    """Return points `(x, y)` in metres as `[column, row]` in grid units."""
    points = np.asarray(points_m, dtype=np.float64)
    if not points.size:
        return []
    found: list[Any] = np.round(grid.frame.positions_of(points)[..., ::-1], _DECIMALS).tolist()
    return found


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


def facts_of(plan: PlanResult | BuildingPlan, parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of a plan, and its lines floor by floor; None stands for what is not
    finite."""
    why = plan.note if not isinstance(plan, PlanResult) else ""
    if isinstance(plan, PlanResult):
        why = plan.settings.get("profile", {}).get("forbids", "")
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
