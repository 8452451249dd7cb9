"""The planner that the presets configure, and the closures for single queries.

Names load on first use: alternatives and what is closed load shapely.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use

if TYPE_CHECKING:
    from hybridnav.planner.alternatives import Alternative, Alternatives, plan_alternatives
    from hybridnav.planner.blocked import Blocked
    from hybridnav.planner.planner import HybridPlanner
    from hybridnav.planner.tour import Tour, plan_tour

__all__ = [
    "Alternative",
    "Alternatives",
    "Blocked",
    "HybridPlanner",
    "Tour",
    "plan_alternatives",
    "plan_tour",
]

__getattr__ = on_first_use(
    __name__,
    {
        "Alternative": "alternatives",
        "Alternatives": "alternatives",
        "Blocked": "blocked",
        "HybridPlanner": "planner",
        "Tour": "tour",
        "plan_alternatives": "alternatives",
        "plan_tour": "tour",
    },
)
