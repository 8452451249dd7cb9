from .path import Path as Path
from .plan import (
    COST_METRICS as COST_METRICS,
    InstructionSource as InstructionSource,
    Metric as Metric,
    PlanBatch as PlanBatch,
    PlanResult as PlanResult,
    PlanStats as PlanStats,
    PlanStatus as PlanStatus,
    Refinement as Refinement,
    Route as Route,
    RouteSource as RouteSource,
)

__all__: list[str]
