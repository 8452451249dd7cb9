from .regions import (
    AnyAngleResult as AnyAngleResult,
    CostClaim as CostClaim,
    Method as Method,
    MethodResult as MethodResult,
)

__all__: list[str]
