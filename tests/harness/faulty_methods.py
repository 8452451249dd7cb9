"""Methods with planted faults, for the harness to catch; workers import them by name."""

import math
import os
import signal
import sys
import time
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hybridnav.harness.adapters import HybridMethod
from hybridnav.harness.baselines import AnyAngleResult, MethodResult
from hybridnav.harness.baselines.grid import GridAstar
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.planning import Preset
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.refine.grid import LineOfSight
from hybridnav.search.grid_search import GridSearch
from hybridnav.topology import TopologicalMap

Cell = tuple[int, int]

FATAL_PAIR = "HYBRIDNAV_TEST_FATAL_PAIR"
"""Environment variable: the `Pair.key` at which `Dies` and `Hangs` do so, without its kind."""

MERGE_DISTANCE_M = 4.0
WARM_UP_SHAPE = (30, 40)
"""Shape of the map on which every process warms up."""


class Sound(GridAstar):
    """A method without a fault, for the others to derive from: A* on the grid."""

    def __init__(self, grid: OccupancyGrid) -> None:
        super().__init__(grid)
        self.name = type(self).__name__
        self.grid = grid
        self.free = grid.classes == CellClass.FREE


class SoundPlaces(HybridMethod):
    """A method without a fault, for the others to derive from: the pyramid's places."""

    ask = None  # type: ignore[assignment]  # `solve` of the others is asked

    def __init__(self, grid: OccupancyGrid) -> None:
        pyramid = DualGraphPyramid.build(grid, merge_distance_m=MERGE_DISTANCE_M)
        super().__init__(TopologicalMap(pyramid), Preset())
        self.name = type(self).__name__


# --- wrong paths --------------------------------------------------------------------------------


class ThroughWall(Sound):
    """One cell of the path lies inside an obstacle, between two neighbours of that cell."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer = super().solve(start, goal)
        if answer.cells is None:
            return answer
        rows, cols = self.free.shape
        for at, (row, col) in enumerate(answer.cells[:-1].tolist()):
            for side in np.ndindex(3, 3):
                cell = (row + side[0] - 1, col + side[1] - 1)
                if not (0 <= cell[0] < rows and 0 <= cell[1] < cols) or self.free[cell]:
                    continue
                if np.abs(answer.cells[at + 1] - cell).max() == 1:
                    cells = np.insert(answer.cells, at + 1, cell, axis=0)
                    return replace(answer, cells=cells, bound=math.inf)
        return answer


class CutsCorners(Sound):
    """Diagonals pass obstacles at their corners."""

    def __init__(self, grid: OccupancyGrid) -> None:
        super().__init__(grid)
        self._search = GridSearch(self.free, corner_cutting=True)

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        return replace(super().solve(start, goal), bound=math.inf)


class _Longer(Sound):
    """A legal path that is 5 % too long: it goes to and fro at its start."""

    claim: float

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer = super().solve(start, goal)
        cells = answer.cells
        if cells is None or len(cells) < 2:
            return answer
        turns = math.ceil(0.05 * len(cells) / 2)
        cells = np.concatenate([np.repeat(cells[None, :2], turns, axis=0).reshape(-1, 2), cells])
        return replace(answer, cells=cells, bound=self.claim)


class TooLong(_Longer):
    """A path 5 % too long that claims to be optimal."""

    claim = 1.0


class HonestlyLong(_Longer):
    """A path 5 % too long or more that claims no less: no fault."""

    claim = 3.0


class Jumps(Sound):
    """One step from start to goal: shorter than the optimum wherever a path must bend."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer = super().solve(start, goal)
        return answer if answer.cells is None else replace(answer, cells=np.array([start, goal]))


class StopsShort(Sound):
    """The path ends a cell before the goal."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer = super().solve(start, goal)
        return answer if answer.cells is None else replace(answer, cells=answer.cells[:-1])


class LeavesTheMap(Sound):
    """The path goes to the far end of the world and back."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        far = (-(2**40), 2**40)
        return MethodResult(np.array([start, far, goal]))


class WalksThroughAll(Sound):
    """A path for every pair, across obstacles where need be."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        search = GridSearch(np.ones_like(self.free))
        return MethodResult(search.search(start, goal).cells)


class NoCells(Sound):
    """An answer that is no path at all."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:  # noqa: ARG002
        return MethodResult(np.array([[0.5, math.nan]]))


# --- wrong plans and regions --------------------------------------------------------------------


class MissingDoor(SoundPlaces):
    """Two places beside each other are not known to be: no path from one to the other."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        if self.region_of[start] == self.region_of[goal]:
            return super().solve(start, goal)
        return MethodResult(None)


class SkipsRegions(SoundPlaces):
    """The plan names its first and last region only, the path is right."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer = super().solve(start, goal)
        if answer.nodes is None or len(answer.nodes) < 3:
            return answer
        return replace(answer, nodes=(answer.nodes[0], answer.nodes[-1]), arcs=None)


class Backwards(SoundPlaces):
    """The plan runs from the goal to the start."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer = super().solve(start, goal)
        return replace(answer, nodes=answer.nodes and answer.nodes[::-1], arcs=None)


class UnknownRegions(SoundPlaces):
    """The plan names regions that there are not."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer = super().solve(start, goal)
        if answer.nodes is None:
            return answer
        return replace(answer, nodes=(answer.nodes[0], 10**6, answer.nodes[-1]), arcs=None)


class PlansAlone(SoundPlaces):
    """Regions are the whole answer, and nothing is said of a search for them: no fault."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        nodes = self.route(super().solve(start, goal).nodes)
        return MethodResult(None, nodes=nodes)

    def route(self, nodes: tuple[int, ...] | None) -> tuple[int, ...] | None:
        return nodes


class PlansAcrossWalls(PlansAlone):
    """Regions alone, of which each third is left out: those beside it do not touch."""

    def route(self, nodes: tuple[int, ...] | None) -> tuple[int, ...] | None:
        return nodes and tuple(node for at, node in enumerate(nodes) if at % 3 != 1)


class PlansForAll(PlansAlone):
    """Regions of start and goal for each pair, joined or not."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        ends = int(self.region_of[start]), int(self.region_of[goal])
        return MethodResult(None, nodes=tuple(dict.fromkeys(ends)))


class PlansOfNothing(Sound):
    """Regions of a method that has none."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:  # noqa: ARG002
        return MethodResult(None, nodes=(0, 1))


class Liar(SoundPlaces):
    """A method that tells the truth or one of ten lies, at random; `Liar0` and others derive."""

    seed: int

    def __init__(self, grid: OccupancyGrid) -> None:
        super().__init__(grid)
        self._rng = np.random.default_rng(self.seed)
        if self.seed % 2:
            self.region_of = None  # type: ignore[assignment]
        kinds = (Sound, ThroughWall, CutsCorners, TooLong, Jumps, StopsShort, WalksThroughAll)
        self._others = [kind(grid) for kind in kinds]

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        truth, lie = super().solve(start, goal), int(self._rng.integers(12))
        if lie < len(self._others):
            return self._others[lie].solve(start, goal)
        nodes = truth.nodes and (truth.nodes[0], truth.nodes[-1])
        return [
            truth,
            MethodResult(None),
            replace(self._others[0].solve(start, goal), bound=math.nan, nodes=nodes),
            replace(truth, nodes=nodes and nodes[::-1], arcs=None),
            replace(truth, any_angle=None, nodes=nodes, arcs=None),
        ][lie - len(self._others)]


class TornRegion(Sound):
    """The map's first and last free column of cells are one region, all between another."""

    def __init__(self, grid: OccupancyGrid) -> None:
        super().__init__(grid)
        cols = np.flatnonzero(self.free.any(axis=0))
        region_of = np.where(self.free, 1, -1).astype(np.int32)
        for col in (cols[0], cols[-1]):
            region_of[self.free[:, col], col] = 0
        self.region_of = region_of


class HomelessCells(Sound):
    """Some free cells are in no region."""

    def __init__(self, grid: OccupancyGrid) -> None:
        super().__init__(grid)
        region_of = np.where(self.free, 0, -1).astype(np.int32)
        region_of[tuple(np.argwhere(self.free)[0])] = -1
        self.region_of = region_of


# --- any-angle paths ----------------------------------------------------------------------------


class SoundLine(Sound):
    """A method without a fault, for the others to derive from: A* on the grid, pulled taut."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer = super().solve(start, goal)
        if answer.cells is None:
            return answer
        endpoints = self.grid.frame.points_of([start, goal])
        points = LineOfSight(self.grid).shorten(answer.cells, endpoints[0], endpoints[1])
        return MethodResult(None, any_angle=self.line(points))

    def line(self, points: NDArray[np.float64]) -> AnyAngleResult:
        return AnyAngleResult(points, length_of(points), lower_bound_m=length_of(points[[0, -1]]))


class LineThroughWall(SoundLine):
    """Straight from start to goal, whatever lies between."""

    def line(self, points: NDArray[np.float64]) -> AnyAngleResult:
        return super().line(points[[0, -1]])


class LineSaidShort(SoundLine):
    """A right path that claims to be 1 % shorter than it is."""

    def line(self, points: NDArray[np.float64]) -> AnyAngleResult:
        return replace(super().line(points), length_m=0.99 * length_of(points))


class LineBelowItsBound(SoundLine):
    """A right path, and the claim that none is as short."""

    def line(self, points: NDArray[np.float64]) -> AnyAngleResult:
        return replace(super().line(points), lower_bound_m=1.01 * length_of(points))


class LineBesideTheGoal(SoundLine):
    """The path ends a tenth of a cell beside the goal."""

    def line(self, points: NDArray[np.float64]) -> AnyAngleResult:
        off = points.copy()
        off[-1] += 0.1 * self.grid.resolution_m
        return super().line(off)


class LineFromElsewhere(SoundLine):
    """The path starts a tenth of a cell beside the start."""

    def line(self, points: NDArray[np.float64]) -> AnyAngleResult:
        off = points.copy()
        off[0] += 0.1 * self.grid.resolution_m
        return super().line(off)


class LineSaidOptimal(SoundLine):
    """Along the centres of the cells of the grid's path, and the claim that none is shorter."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        cells = Sound.solve(self, start, goal).cells
        if cells is None:
            return MethodResult(None)
        line = self.line(self.grid.frame.points_of(cells))
        return MethodResult(None, any_angle=replace(line, lower_bound_m=line.length_m))


class LineForAll(SoundLine):
    """Straight from start to goal where there is no path too."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        return MethodResult(None, any_angle=self.line(self.grid.frame.points_of([start, goal])))


class LineOfNothing(SoundLine):
    """Points that are no numbers, and a bound that is none."""

    def line(self, points: NDArray[np.float64]) -> AnyAngleResult:
        return AnyAngleResult(np.full_like(points, math.nan), math.nan, lower_bound_m=math.nan)


class LineUnsaid(SoundLine):
    """A right path; of its length and of a bound nothing that can be checked."""

    def line(self, points: NDArray[np.float64]) -> AnyAngleResult:
        return AnyAngleResult(points, math.nan, lower_bound_m=math.nan)


class LineOverHomelessCells(HomelessCells):
    """Any-angle paths over cells some of which are in no region."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        cells = super().solve(start, goal).cells
        if cells is None:
            return MethodResult(None)
        points = self.grid.frame.points_of(cells)
        return MethodResult(None, any_angle=AnyAngleResult(points, length_of(points)))


class OwnGridOrNothing(SoundLine):
    """A third of the paths are its own, a third the grid's, and for a third it has no time."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer, turn = super().solve(start, goal), (start[0] + goal[0]) % 3
        cells = Sound.solve(self, start, goal).cells
        if answer.any_angle is None or cells is None:
            return answer
        if turn == 0:
            return MethodResult(None, gave_up="timeout")
        line = answer.any_angle if turn == 1 else self.line(self.grid.frame.points_of(cells))
        return MethodResult(None, any_angle=replace(line, by_grid=turn != 1))


def length_of(points: NDArray[np.float64]) -> float:
    steps = np.diff(points, axis=0)
    return math.fsum(np.hypot(steps[:, 0], steps[:, 1]).tolist())


# --- methods that fail --------------------------------------------------------------------------


class Raises(Sound):
    """No answer for some pairs."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        if (start[0] + goal[0]) % 2 and self.free.shape != WARM_UP_SHAPE:
            raise RuntimeError("odd rows\nare beyond me")
        return super().solve(start, goal)


class CannotBeMade(Sound):
    """Its preparation fails."""

    def __init__(self, grid: OccupancyGrid) -> None:
        super().__init__(grid)
        if grid.shape != WARM_UP_SHAPE:
            raise RuntimeError("too small a map")


class FailsAtOnce(Sound):
    """Fails already when it is warmed up."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        raise KeyError((start, goal))


class Dies(Sound):
    """Takes its whole process along at one pair."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        if _is_fatal(start, goal):
            os._exit(3)
        return super().solve(start, goal)


class Ends(Sound):
    """Its process ends at the first query, in one of three ways; not while it warms up."""

    def __init__(self, grid: OccupancyGrid, *, how: str) -> None:
        super().__init__(grid)
        self._how = how

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        if self.free.shape == WARM_UP_SHAPE:
            return super().solve(start, goal)
        if self._how == "exit":
            os._exit(3)
        if self._how == "leave":
            sys.exit(5)
        os.kill(os.getpid(), signal.SIGKILL)
        return MethodResult(None)


class Forks(Sound):
    """Forks at each query, and lets both processes return, or the other one raise."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        if os.fork() == 0 and _is_fatal(start, goal):
            raise KeyError((start, goal))
        return super().solve(start, goal)


class DiesBeforeItsChild(Sound):
    """Takes its whole process along at one pair, but for one that it forked."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        if _is_fatal(start, goal):
            if os.fork() == 0:
                time.sleep(40)
            os._exit(3)
        return super().solve(start, goal)


class RaisesEscapes(Sound):
    """Raises what would clear the terminal and set its title."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        raise RuntimeError(f"\x1b[2J\x1b]0;owned\x07\x9b31m {start} {goal}")


class Hangs(Sound):
    """Never comes back from one pair."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        if _is_fatal(start, goal):
            time.sleep(600)
        return super().solve(start, goal)


class Slow(Sound):
    """Takes ten milliseconds for each pair."""

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        time.sleep(0.01)
        return super().solve(start, goal)


def _is_fatal(start: Cell, goal: Cell) -> bool:
    return os.environ.get(FATAL_PAIR) == f"{start[0]},{start[1]}>{goal[0]},{goal[1]}"


globals().update({f"Liar{seed}": type(f"Liar{seed}", (Liar,), {"seed": seed}) for seed in range(6)})
