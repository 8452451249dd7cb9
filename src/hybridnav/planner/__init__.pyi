from .alternatives import (
    Alternative as Alternative,
    Alternatives as Alternatives,
    plan_alternatives as plan_alternatives,
)
from .blocked import Blocked as Blocked
from .closures_file import load_blocked as load_blocked
from .export import (
    export_path as export_path,
    export_places as export_places,
    export_rooms as export_rooms,
)
from .path import Path as Path
from .planner import HybridPlanner as HybridPlanner
from .preset import (
    ClearanceSettings as ClearanceSettings,
    CostSettings as CostSettings,
    PlannerSettings as PlannerSettings,
    Preset as Preset,
    PyramidSettings as PyramidSettings,
    load_preset as load_preset,
    preset_names as preset_names,
)
from .result import (
    COST_METRICS as COST_METRICS,
    Metric as Metric,
    PlanBatch as PlanBatch,
    PlanResult as PlanResult,
    PlanStats as PlanStats,
    PlanStatus as PlanStatus,
    Refinement as Refinement,
)
from .tour import Tour as Tour, plan_tour as plan_tour

__all__: list[str]
