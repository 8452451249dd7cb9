"""Grid A* against the optima that the MovingAI scenario files state."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav._base.moves import path_length_in_cells
from hybridnav.maps import CellClass
from hybridnav.maps.files.movingai import read_scenarios
from hybridnav.search.grid_search import GridSearch
from tests.oracle.grid import assert_legal, moves, recounted

if TYPE_CHECKING:
    from hybridnav.maps.files.movingai import Scenario

PROBLEMS = 24
LONGEST = 6
HYBRID_PROBLEMS = 8


def scenario_files() -> list[str]:
    """Every scenario file below the reference data; one that cannot be there without it."""
    folder = Path(os.environ.get("HYBRIDNAV_DATA", "")) / "movingai"
    found = sorted(file.relative_to(folder).as_posix() for file in folder.glob("**/*.scen"))
    return found or ["none"]


@dataclass(frozen=True)
class Problem:
    """A problem and the stated optimum's own arithmetic."""

    scenario: Scenario
    half_unit: float
    """Half a unit of the last digit that the file gives."""
    root: float
    """What the makers of the file took for the square root of 2."""

    def states(self, cells: Any) -> bool:
        """Whether the path's moves add up to the stated optimum, to the digits given."""
        straight, diagonal = moves(cells)
        error = straight + diagonal * self.root - self.scenario.optimum_cells
        return abs(error) <= self.half_unit + 1e-9

    @property
    def slack(self) -> float:
        """By how much the stated optimum may differ from the true one."""
        relative = abs(self.root / math.sqrt(2) - 1)
        return self.half_unit + self.scenario.optimum_cells * relative + 1e-9


@lru_cache(maxsize=1)
def problem_set(file: Path) -> tuple[hn.OccupancyGrid, list[Problem]]:
    """The map of a scenario file and a sample of its problems, the longest ones last."""
    grid = hn.load_map(file.with_suffix(""), robot_radius_m=0.0)
    lines = [line.split() for line in file.read_text().splitlines()[1:]]
    digits = digits_of([line[-1] for line in lines if line])
    problems = [
        Problem(scenario, *digit)
        for scenario, digit in zip(read_scenarios(file), digits, strict=True)
    ]
    order = np.argsort([problem.scenario.optimum_cells for problem in problems], kind="stable")
    others = np.random.default_rng(0).choice(order[:-LONGEST], PROBLEMS - LONGEST, replace=False)
    return grid, [problems[i] for i in (*others.tolist(), *order[-LONGEST:].tolist())]


def digits_of(optima: list[str]) -> list[tuple[float, float]]:
    """Half a unit of the last digit of each optimum, and the root of 2 that it was made with.

    There are two kinds of files. One gives a fixed number of decimals, two or eight; those with
    eight took 1.414213562 for the root, as 200 problems of each such file show to the last digit.
    The other gives six significant digits, trailing zeros dropped, of lengths in float32.
    """
    single = float(np.float32(math.sqrt(2)))
    decimals = {len(optimum.partition(".")[2]) for optimum in optima}
    if len(decimals) == 1:
        (places,) = decimals
        return [(0.5 * 10.0**-places, 1.414213562 if places == 8 else single)] * len(optima)
    return [(0.5 * 10.0 ** (len(optimum.partition(".")[0]) - 6), single) for optimum in optima]


@pytest.mark.parametrize("name", scenario_files())
def test_grid_astar_equals_the_stated_optimum_to_the_digits_given(data: Path, name: str) -> None:
    grid, problems = problem_set(data / "movingai" / name)
    enterable = grid.classes == CellClass.FREE
    search = GridSearch(enterable)
    for problem in problems:
        scenario = problem.scenario
        assert (scenario.rows, scenario.cols) == grid.shape
        found = search.search(scenario.start, scenario.goal)
        assert found.cells is not None, scenario
        assert_legal(found.cells, enterable)
        assert tuple(found.cells[0]) == scenario.start
        assert tuple(found.cells[-1]) == scenario.goal
        assert path_length_in_cells(found.cells) == recounted(found.cells)
        assert problem.states(found.cells), (scenario, recounted(found.cells))


@pytest.mark.parametrize("name", scenario_files())
def test_the_hybrid_planner_solves_them_too_and_its_bounds_hold(data: Path, name: str) -> None:
    grid, problems = problem_set(data / "movingai" / name)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=40.0))
    planner = hn.HybridPlanner(topology, preset="paper")
    for problem in problems[-HYBRID_PROBLEMS:]:
        scenario = problem.scenario
        start, goal = grid.frame.points_of([scenario.start, scenario.goal])
        result = planner.plan(start, goal).raise_for_status()
        assert result.path is not None
        assert_legal(result.path.cells, grid.classes == CellClass.FREE)
        assert result.cost == pytest.approx(recounted(result.path.cells), rel=1e-12)
        assert result.cost >= scenario.optimum_cells - problem.slack
        assert result.lower_bound <= scenario.optimum_cells + problem.slack
