"""The planner that the presets configure."""

from hybridnav.planner.planner import HybridPlanner

__all__ = ["HybridPlanner"]
