"""Random maps with directed lines, and presets attacked with them.

`python -m tests.one_way --maps 20000 --presets shortest octile` plans on so many maps, each with
one to six lines, and holds every answer against `tests.oracle.one_way`: its cost to 1e-9, its bound
at most its cost, no wrong side on its path. It exits with 1 if anything is wrong.
"""

import argparse
import itertools
import math
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hybridnav as hn
from tests.oracle.one_way import Exact, OneWayPlane
from tests.strategies import occupancy_grid

PRESETS = ("shortest", "octile", "grid-astar", "paper", "robot")
CELLS = ("octile", "grid-astar", "paper")
"""Presets whose paths go from cell to cell."""
_PARTS = 8
"""Parts of a cell to whose multiples ends are placed."""
End = tuple[tuple[int, int], Exact]


@dataclass(frozen=True)
class Scene:
    """A map with directed sides, and ends in its free cells."""

    free: NDArray[np.bool_]
    sides: NDArray[np.int32]
    """int (n, 4), from where to where each may be crossed."""
    ends: list[End]

    @cached_property
    def plane(self) -> OneWayPlane:
        """The map as the oracle takes it."""
        return OneWayPlane(self.free, self.sides)

    @cached_property
    def topology(self) -> hn.TopologicalMap:
        """The map as planners take it; a cell measures a metre."""
        grid = occupancy_grid(self.free.astype(np.uint8))
        return hn.TopologicalMap(hn.DualGraphPyramid.build(grid))

    @cached_property
    def placed(self) -> list[End]:
        """The ends by the cells that planners look for, above an end on a side; free ones."""
        found = [((int(point[0]), int(point[1])), point) for _, point in self.ends]
        rows, cols = self.free.shape
        return [(at, p) for at, p in found if at[0] < rows and at[1] < cols and self.free[at]]

    @cached_property
    def lengths(self) -> NDArray[np.float64]:
        """Lengths of shortest any-angle paths between all placed ends."""
        return self.plane.lengths(self.placed, self.placed) if self.placed else np.empty((0, 0))


def random_scene(seed: int, *, side: int = 7, n_ends: int = 3) -> Scene | None:
    """A map of at most `side` x `side` cells with one to six lines: straight, bent, collinear with
    others, touching corners; or None if no cell is free."""
    rng = np.random.default_rng(seed)
    rows, cols = rng.integers(1, side + 1, 2).tolist()
    free = rng.random((rows, cols)) > rng.choice([0, 0.05, 0.15, 0.3])
    if not free.any():
        return None
    sides = random_sides(rng, rows, cols)
    cells = np.argwhere(free)
    ends = []
    for row, col in cells[rng.integers(len(cells), size=n_ends)].tolist():
        up, across = rng.choice([0, 4, 4, 8, int(rng.integers(0, _PARTS + 1))], 2).tolist()
        point = Fraction(row * _PARTS + up, _PARTS), Fraction(col * _PARTS + across, _PARTS)
        ends.append(((row, col), point))
    return Scene(free, sides, ends)


def random_sides(rng: np.random.Generator, rows: int, cols: int) -> NDArray[np.int32]:
    """Directed sides of one to six lines, int32 (n, 4)."""
    sides: list[tuple[int, ...]] = []
    for _ in range(rng.integers(1, 7)):
        sides += _line(rng, rows, cols)
    return np.array(sides, np.int32).reshape(-1, 4)


def _line(rng: np.random.Generator, rows: int, cols: int) -> list[tuple[int, ...]]:
    """Sides along a chain of corners of cells, crossed from its left to its right."""
    row, col = int(rng.integers(rows + 1)), int(rng.integers(cols + 1))
    corners = [(row, col)]
    for _ in range(rng.integers(1, 4)):
        up, right = [(0, 1), (1, 0), (0, -1), (-1, 0)][rng.integers(4)]
        for _ in range(rng.integers(1, 5)):
            row, col = row + up, col + right
            corners.append((row, col))
            if not (0 <= row <= rows and 0 <= col <= cols):
                return sides_beside(corners, rows, cols)
    return sides_beside(corners, rows, cols)


def sides_beside(corners: list[tuple[int, int]], rows: int, cols: int) -> list[tuple[int, ...]]:
    """Sides of cells of a map along a chain of corners, from its left to its right."""
    sides: list[tuple[int, ...]] = []
    for (row, col), (to_row, to_col) in itertools.pairwise(corners):
        up, right = to_row - row, to_col - col
        low, across = min(row, to_row), min(col, to_col)
        left = low - (right < 0), across - (up > 0)
        other = low - (right > 0), across - (up < 0)
        if all(0 <= r < rows and 0 <= c < cols for r, c in (left, other)):
            sides.append((*left, *other))
    return sides


def planner_of(scene: Scene, preset: str) -> hn.HybridPlanner:
    return hn.HybridPlanner(scene.topology, preset=_preset(preset))


_preset = lru_cache(hn.load_preset)


def faults(scene: Scene, preset: str, planner: hn.HybridPlanner | None = None) -> Iterator[str]:
    """What is wrong with the plans of a preset between the ends of a scene, in both directions;
    `planner`: on the map of the scene, None for a new one."""
    planner, one_way = planner or planner_of(scene, preset), hn.OneWay(sides=scene.sides)
    for i, start in enumerate(scene.placed):
        for j, goal in enumerate(scene.placed):
            by_cells = preset in CELLS
            best = scene.plane.cells_length(start[0], goal[0]) if by_cells else scene.lengths[i, j]
            given = [tuple(map(float, end[1][::-1])) for end in (start, goal)]
            asked = f"{preset} from {start} to {goal}"
            try:
                result = planner.plan(*given, one_way=one_way)
            except Exception as error:  # noqa: BLE001 - whatever it is, the attack goes on
                yield f"{asked}: {error!r}"
                continue
            for fault in _faults_of(scene.plane, result, (start, goal), (best, preset)):
                yield f"{asked}: {fault}"


def _faults_of(
    plane: OneWayPlane, result: Any, ends: tuple[End, End], known: tuple[float, str]
) -> Iterator[str]:
    best, preset = known
    if result.path is None:
        if best < math.inf:
            yield f"no path, expected {best}"
        return
    if best == math.inf:
        yield f"a path of {result.cost}, expected none"
    elif preset in {"shortest", *CELLS} and abs(result.cost - best) > 1e-9:
        yield f"costs {result.cost}, expected {best}"
    spare = 1e-7 if preset == "robot" else 1e-9  # as plain Python it adds single precision
    if result.cost < best - spare or not result.lower_bound <= result.cost + spare:
        yield f"cost {result.cost} or bound {result.lower_bound}, best {best}"
    cells = [tuple(cell) for cell in result.path.cells.tolist()]
    if not plane.allows_moves(cells, strict=preset in CELLS):
        yield f"cells pass a side the wrong way: {cells}"
    if preset not in CELLS:
        # Bends of `robot` are rounded into arcs; its straight lines are those that are legal.
        line = result.path.points if result.line is None else result.line
        points = [(_exact(y), _exact(x)) for x, y in line[:, :2].tolist()]
        if not plane.allows((ends[0][0], ends[1][0]), points):
            yield f"line passes a side the wrong way: {points}"


def _exact(at: float) -> Fraction:
    """A coordinate, on a line between cells if it is next to one."""
    return Fraction(round(at)) if abs(at - round(at)) < 1e-9 else Fraction(at)


def _all_faults(seed: int, preset: str, given: argparse.Namespace) -> Iterator[str]:
    if given.floors:
        from tests.ext.fleet.directed import floor_faults  # it draws lines as this module does

        return floor_faults(seed, preset)
    scene = random_scene(seed, side=given.side)
    return faults(scene, preset) if scene else iter(())


def main() -> int:
    """Attack presets; return 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--maps", type=int, default=20_000)
    parser.add_argument("--first", type=int, default=0, help="seed of the first map")
    parser.add_argument("--presets", nargs="+", default=PRESETS)
    parser.add_argument("--side", type=int, default=7, help="most cells of a side of a map")
    parser.add_argument("--floors", action="store_true", help="buildings in place of maps")
    given = parser.parse_args()
    found, began = 0, time.process_time()
    for seed in range(given.first, given.first + given.maps):
        for preset in given.presets:
            for fault in _all_faults(seed, preset, given):
                found += 1
                sys.stdout.write(f"map {seed}: {fault}\n")
        if seed % 500 == 499:
            seconds = time.process_time() - began
            sys.stdout.write(f"{seed + 1} maps, {found} wrong, {seconds:.0f} s\n")
            sys.stdout.flush()
    sys.stdout.write(f"{found} wrong of {given.maps} maps\n")
    return int(found > 0)


if __name__ == "__main__":
    sys.exit(main())
