from .cost_line import CostLine as CostLine
from .grid import (
    GridRefiner as GridRefiner,
    LineOfSight as LineOfSight,
    Refiner as Refiner,
    Sight as Sight,
)
from .motions import MotionCheck as MotionCheck

__all__: list[str]
