"""Options of alternatives of `hybridnav plan`, and their checks."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import typer

from hybridnav.cli.errors import UsageError
from hybridnav.cli.request import Wanted

if TYPE_CHECKING:
    from hybridnav.planner import Preset
    from hybridnav.planner.alternatives import By

AlternativesOption = Annotated[
    int,
    typer.Option(
        "--alternatives",
        metavar="N",
        min=1,
        max=20,
        help="Up to N routes by other doors, the plain plan first.",
    ),
]
ByOption = Annotated[
    str | None,
    typer.Option(
        "--by",
        metavar="WHAT",
        help="What makes alternatives differ: doors, or homotopy (sides of obstacles, exact).",
        show_default="doors",
    ),
]
OverlapOption = Annotated[
    float | None,
    typer.Option(
        "--max-overlap",
        metavar="SHARE",
        min=0,
        max=1,
        help="Share that an alternative by doors may have in common with a shorter one.",
        show_default="0.8",
    ),
]
StretchOption = Annotated[
    float | None,
    typer.Option(
        "--max-stretch",
        metavar="FACTOR",
        min=1,
        help="Length of an alternative by doors over that of the first, at most.",
        show_default="2.0",
    ),
]
InsideOption = Annotated[
    bool,
    typer.Option(
        "--inside-rooms", help="Also alternatives by the same doors, on other sides of obstacles."
    ),
]
LeastHoleOption = Annotated[
    float | None,
    typer.Option(
        "--least-hole",
        metavar="A",
        min=0,
        help="Square metres of an obstacle whose two sides make two routes, by homotopy.",
        show_default="1.0",
    ),
]
_BY_DOORS = {"--max-overlap", "--max-stretch", "--inside-rooms"}
"""Options that change nothing by homotopy."""


def wanted_of(
    count: int,
    by: str | None,
    max_overlap: float | None,
    max_stretch: float | None,
    least_hole_m2: float | None,
    *,
    inside_rooms: bool,
) -> Wanted:
    """Return the alternatives that the options ask for; None stands for one that is not given."""
    hole_m2 = None if least_hole_m2 is None else _checked_least_hole(least_hole_m2)
    given_by = "doors" if by is None else _checked_by(by)
    options = {
        "--by": by,
        "--max-overlap": max_overlap,
        "--max-stretch": max_stretch,
        "--inside-rooms": inside_rooms or None,
        "--least-hole": least_hole_m2,
    }
    used = {name for name, value in options.items() if value is not None}
    _check_used(used, given_by, count)
    return Wanted(count, given_by, max_overlap, max_stretch, inside_rooms, hole_m2)


def check_refiner(wanted: Wanted, settings: Preset) -> None:
    """Refuse alternatives of paths of cells with OMPL."""
    if settings.planner.method == "ompl" and wanted.needs_grid:
        option = "--by homotopy" if wanted.by == "homotopy" else "--inside-rooms"
        raise UsageError(f"{option} needs a preset without OMPL, not {settings.name}")


def _checked_by(by: str) -> By:
    if by == "doors":
        return "doors"
    if by == "homotopy":
        return "homotopy"
    raise UsageError(f"--by must be doors or homotopy, got {by!r:.80}")


def _check_used(used: set[str], by: By, alternatives: int) -> None:
    """Refuse options that change nothing."""
    if used and alternatives == 1:
        raise UsageError(f"{min(used)} is for alternatives: add --alternatives N, or leave it out")
    idle = used & _BY_DOORS if by == "homotopy" else set[str]()
    if by == "doors" and "--inside-rooms" not in used:
        idle = used & {"--least-hole"}
    if idle:
        where = "doors" if by == "homotopy" else "homotopy, or with --inside-rooms"
        raise UsageError(f"{min(idle)} is for alternatives by {where}: leave it out")


def _checked_least_hole(area_m2: float) -> float:
    if not math.isfinite(area_m2):
        raise UsageError(f"--least-hole must be a finite number of m² >= 0, got {area_m2}")
    return area_m2
