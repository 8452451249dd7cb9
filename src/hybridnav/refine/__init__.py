"""From corridors to paths: grid search inside them, and the any-angle finish."""

from hybridnav.refine.grid import GridRefiner, Refiner
from hybridnav.refine.line_of_sight import LineOfSight
from hybridnav.refine.motions import MotionCheck

__all__ = ["GridRefiner", "LineOfSight", "MotionCheck", "Refiner"]
