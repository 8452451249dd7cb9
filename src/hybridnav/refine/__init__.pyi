from .cost_line import CostLine as CostLine
from .grid import GridRefiner as GridRefiner, Refiner as Refiner
from .line_of_sight import LineOfSight as LineOfSight
from .motions import MotionCheck as MotionCheck
from .sight import Sight as Sight

__all__: list[str]
