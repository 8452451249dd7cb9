from .alternatives import (
    Alternative as Alternative,
    Alternatives as Alternatives,
    plan_alternatives as plan_alternatives,
)
from .tour import Tour as Tour, plan_tour as plan_tour

__all__: list[str]
