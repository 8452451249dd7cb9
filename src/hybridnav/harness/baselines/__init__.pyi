from .regions import (
    AnyAngleResult as AnyAngleResult,
    CostClaim as CostClaim,
    Solver as Solver,
    MethodResult as MethodResult,
)

__all__: list[str]
