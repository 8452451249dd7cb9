from .path import Path as Path
from .plan import (
    COST_METRICS as COST_METRICS,
    Metric as Metric,
    PlanBatch as PlanBatch,
    PlanResult as PlanResult,
    PlanStats as PlanStats,
    PlanStatus as PlanStatus,
    Refinement as Refinement,
    Route as Route,
)

__all__: list[str]
