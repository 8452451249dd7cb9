"""States drawn from the cells of a corridor, for planners with a valid-state sampler."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ompl import base, util

if TYPE_CHECKING:
    from hybridnav.refine.ompl.search_area import SearchArea
    from hybridnav.refine.ompl.spaces import StateSpace


class _CellSampler(base.ValidStateSampler):  # type: ignore[misc]  # the bindings have no types
    """Points in cells, each cell as likely as any other, with any heading."""

    def __init__(self, information: Any, corridor: SearchArea, space: StateSpace) -> None:
        super().__init__(information)
        self._cells = corridor.cells
        self._frame = corridor.grid.frame
        self._space = space
        self._random = util.RNG()

    def sample(self, state: Any) -> bool:
        """Fill a state and return whether it is valid."""
        uniform = self._random.uniformReal
        row, col = self._cells[self._random.uniformInt(0, len(self._cells) - 1)].tolist()
        x, y = self._frame.points_of_grid((row + uniform(0, 1), col + uniform(0, 1))).tolist()
        self._space.fill(state, (x, y, uniform(-math.pi, math.pi)))
        return bool(self._space.state_valid(state))

    def sampleNear(self, state: Any, near: Any, distance: float) -> bool:  # noqa: N802, ARG002
        """Fill a state anywhere: only PRM's expansion asks for near ones, and it is not used."""
        return self.sample(state)


def draw_from(corridor: SearchArea, space: StateSpace) -> None:
    """Make a space draw its valid states from the cells of a corridor."""

    def allocate(information: Any) -> _CellSampler:
        sampler = _CellSampler(information, corridor, space)
        space.keep(sampler)
        return sampler

    space.information.setValidStateSamplerAllocator(allocate)
    space.information.setup()
