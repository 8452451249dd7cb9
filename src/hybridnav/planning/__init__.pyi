from .finishes import Refinement as Refinement
from .path import Path as Path
from .planner import HybridPlanner as HybridPlanner, under as under
from .preset import (
    Preset as Preset,
    load_preset as load_preset,
    planner_settings as planner_settings,
    preset_names as preset_names,
)
from .profile import PROFILES as PROFILES, Profile as Profile
from .result import (
    COST_METRICS as COST_METRICS,
    Metric as Metric,
    PlanBatch as PlanBatch,
    PlanResult as PlanResult,
    PlanStats as PlanStats,
    PlanStatus as PlanStatus,
)
from .settings import (
    ClearanceSettings as ClearanceSettings,
    CostSettings as CostSettings,
    LimitSettings as LimitSettings,
    PlannerSettings as PlannerSettings,
    PyramidSettings as PyramidSettings,
)
from .speed import MotionLimits as MotionLimits, SpeedMap as SpeedMap, SpeedProfile as SpeedProfile

__all__: list[str]
