from .alternatives import (
    Alternative as Alternative,
    Alternatives as Alternatives,
    plan_alternatives as plan_alternatives,
)
from .batch import PlanBatch as PlanBatch
from .export import (
    export_path as export_path,
    export_places as export_places,
    export_rooms as export_rooms,
)
from .path import Path as Path
from .planner import HybridPlanner as HybridPlanner
from .preset import (
    LimitSettings as LimitSettings,
    Preset as Preset,
    load_preset as load_preset,
    planner_settings as planner_settings,
    preset_names as preset_names,
)
from .profile import PROFILES as PROFILES, Profile as Profile
from .result import (
    COST_METRICS as COST_METRICS,
    Metric as Metric,
    PlanResult as PlanResult,
    PlanStats as PlanStats,
    PlanStatus as PlanStatus,
    Refinement as Refinement,
)
from .settings import (
    ClearanceSettings as ClearanceSettings,
    CostSettings as CostSettings,
    PlannerSettings as PlannerSettings,
    PyramidSettings as PyramidSettings,
)
from .speed import MotionLimits as MotionLimits, SpeedMap as SpeedMap, SpeedProfile as SpeedProfile
from .tour import Tour as Tour, plan_tour as plan_tour
from .why import Explanation as Explanation
from .why_words import BlockedEnd as BlockedEnd, Closure as Closure, TightPlace as TightPlace

__all__: list[str]
