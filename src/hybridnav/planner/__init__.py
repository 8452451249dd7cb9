"""The planner that the presets configure, and the closures for single queries."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from hybridnav.planner.planner import HybridPlanner
from hybridnav.planner.tour import Tour, plan_tour

if TYPE_CHECKING:
    from hybridnav.planner.alternatives import Alternative, Alternatives, plan_alternatives
    from hybridnav.planner.blocked import Blocked

__all__ = [
    "Alternative",
    "Alternatives",
    "Blocked",
    "HybridPlanner",
    "Tour",
    "plan_alternatives",
    "plan_tour",
]


def __getattr__(name: str) -> Any:
    homes = {
        "Alternative": "alternatives",
        "Alternatives": "alternatives",
        "Blocked": "blocked",
        "plan_alternatives": "alternatives",
    }
    if name not in homes:
        raise AttributeError(f"module 'hybridnav.planner' has no attribute {name!r}")
    # These load shapely.
    return getattr(importlib.import_module(f"hybridnav.planner.{homes[name]}"), name)
