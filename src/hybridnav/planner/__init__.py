"""The planner that the presets configure, and what may be closed for one of its queries."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hybridnav.planner.planner import HybridPlanner
from hybridnav.planner.tour import Tour, plan_tour

if TYPE_CHECKING:
    from hybridnav.planner.blocked import Blocked

__all__ = ["Blocked", "HybridPlanner", "Tour", "plan_tour"]


def __getattr__(name: str) -> Any:
    if name != "Blocked":
        raise AttributeError(f"module 'hybridnav.planner' has no attribute {name!r}")
    from hybridnav.planner.blocked import Blocked  # noqa: PLC0415 - loads shapely

    return Blocked
