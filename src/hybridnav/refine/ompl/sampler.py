"""States drawn from the cells of a corridor, for the planners that take a valid-state sampler."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ompl import base, util

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.refine.motions import MotionCheck
    from hybridnav.refine.ompl.corridor import Corridor
    from hybridnav.refine.ompl.spaces import StateSpace


class _CellSampler(base.ValidStateSampler):  # type: ignore[misc]  # the bindings have no types
    """Points in cells, each cell as likely as any other, with any heading."""

    def __init__(
        self, information: Any, corridor: Corridor, cells: LongArray, *, flat: bool
    ) -> None:
        super().__init__(information)
        frame = corridor.grid.frame
        self._cells = cells
        self._check: MotionCheck = corridor.check
        self._frame = frame
        self._random = util.RNG()
        self._flat = flat

    def sample(self, state: Any) -> bool:
        """Fill a state; whether it is valid."""
        uniform = self._random.uniformReal
        row, col = self._cells[self._random.uniformInt(0, len(self._cells) - 1)].tolist()
        x, y = self._frame.points_of_grid((row + uniform(0, 1), col + uniform(0, 1))).tolist()
        if self._flat:
            state[0], state[1] = x, y
            return self._check.state_valid(x, y)
        yaw = uniform(-math.pi, math.pi)
        state.setX(x)
        state.setY(y)
        state.setYaw(yaw)
        return self._check.state_valid(x, y, yaw)

    def sampleNear(self, state: Any, near: Any, distance: float) -> bool:  # noqa: N802, ARG002
        """Fill a state anywhere: only PRM's expansion asks for near ones, and it is not used."""
        return self.sample(state)


def draw_from(corridor: Corridor, space: StateSpace) -> None:
    """Make a space draw its valid states from the cells of a corridor."""
    cells = corridor.cells
    flat = space.dimension == 2  # noqa: PLR2004

    def allocate(information: Any) -> _CellSampler:
        sampler = _CellSampler(information, corridor, cells, flat=flat)
        space.keep(sampler)
        return sampler

    space.information.setValidStateSamplerAllocator(allocate)
    space.information.setup()
