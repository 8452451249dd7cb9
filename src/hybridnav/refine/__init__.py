"""From corridors to paths: grid search inside them, and the any-angle finish.

Names load on first use: few plans are shortened, and fewer have motions to check.
"""

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use

if TYPE_CHECKING:
    from hybridnav.refine.grid import GridRefiner, Refiner
    from hybridnav.refine.line_of_sight import LineOfSight
    from hybridnav.refine.motions import MotionCheck

__all__ = ["GridRefiner", "LineOfSight", "MotionCheck", "Refiner"]

__getattr__ = on_first_use(
    __name__,
    {
        "GridRefiner": "grid",
        "LineOfSight": "line_of_sight",
        "MotionCheck": "motions",
        "Refiner": "grid",
    },
)
