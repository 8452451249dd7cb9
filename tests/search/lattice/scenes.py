"""Random maps with factors, for the tests of the lattice and of the lines that settle on it."""

from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import segment_faults
from hybridnav.maps.costs import cost_along
from hybridnav.refine import CostLine
from tests.layers import grid_of, layer_of
from tests.strategies import class_grids, seeds

GRAIN = 2.0**-24


def factors_of(shape: tuple[int, int], rng: np.random.Generator) -> Any:
    """Factors in [1, 20]: all 1, noise, jumps, or large blocks that jump."""
    kind = rng.integers(4)
    if kind == 0:
        return np.ones(shape, np.float32)
    if kind == 1:
        return rng.uniform(1, 20, shape).astype(np.float32)
    if kind == 2:
        return rng.choice([1.0, 4.0, 20.0], shape).astype(np.float32)
    blocks = np.kron(rng.choice([1.0, 1.5, 20.0], shape), np.ones((3, 3)))
    return blocks[: shape[0], : shape[1]].astype(np.float32)


class Field(NamedTuple):
    """Free cells with factors."""

    free: Any
    factors: Any

    def positions(self, rng: np.random.Generator, count: int, *, inside: bool = False) -> Any:
        """Positions in free cells on the grain: at centres, anywhere, on sides, at corners; and the
        cells that they are drawn from."""
        cells = np.argwhere(self.free)
        cells = cells[rng.integers(len(cells), size=count if len(cells) else 0)]
        kind = rng.integers(0, 2 if inside else 4, (len(cells), 1))
        anywhere = np.rint(rng.uniform(0.01, 0.99, (len(cells), 2)) / GRAIN) * GRAIN
        corner = rng.integers(0, 2, (len(cells), 2)).astype(float)
        side = np.where(rng.random((len(cells), 2)) < 0.5, corner, 0.5)
        return cells, cells + np.select(
            [kind == 0, kind == 1, kind == 2], [0.5, anywhere, side], corner
        )

    def is_split(self, position: Any) -> bool:
        """Whether two free cells meet at a position alone, in a corner: it is in both."""
        if (position != np.floor(position)).any():
            return False
        row, col = (int(at) for at in position)
        near = np.pad(self.free, 1)[row : row + 2, col : col + 2]
        return bool(near.sum() == 2 and near[0, 0] == near[1, 1])

    @property
    def grid(self) -> hn.OccupancyGrid:
        """The map in cells of 1 m."""
        return grid_of(1.0 - self.free, robot_radius_m=0)

    def faults(self, line: Any) -> tuple[str, ...]:
        """Faults of positions, exactly."""
        return segment_faults(self.grid, np.ascontiguousarray(line[:, ::-1]))

    def cost(self, line: Any) -> float:
        """Cost of positions, in cells."""
        return cost_along(self.grid, layer_of(self.factors), line[:, ::-1])


def settled(field: Field, line: Any) -> Any:
    """A line, moved to where it costs least."""
    return CostLine(field.grid, layer_of(field.factors)).settle(line)


@st.composite
def fields(draw: st.DrawFn, max_side: int = 24) -> Field:
    """Draw maps of one row and of all classes, and factors."""
    free = draw(class_grids(max_side)) == hn.CellClass.FREE
    return Field(free, factors_of(free.shape, np.random.default_rng(draw(seeds))))
