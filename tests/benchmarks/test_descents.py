"""`python -m benchmarks descents`: some of its maps, and that it finds planted faults."""

import dataclasses

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.subjects.descents import Case, checked, faults
from hybridnav.search import descent
from tests.strategies import examples


def test_no_answer_down_the_levels_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    for limit in ("MANY_PLACES", "MOST_AT_TOP", "MOST_BLOCKS"):  # the subject sets them
        monkeypatch.setattr(descent, limit, getattr(descent, limit))
    found = [checked(seed) for seed in range(examples(120))]
    assert [fault for _, fault in found if fault] == []
    assert sum(n for n, _ in found) > 5 * len(found)


def test_a_planted_fault_is_found() -> None:
    values = np.zeros((6, 9), dtype=np.float32)
    values[:4, 4] = 1
    grid = hn.OccupancyGrid(values, robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    result = hn.HybridPlanner(topology, preset="paper").plan((0.5, 0.5), (8.5, 0.5))
    case = Case(grid, grid.enterable(), np.ones(grid.shape))
    ends, none = np.array([[0, 0], [0, 8]]), np.zeros(grid.shape, np.bool_)
    assert faults(case, result, none, ends) == ""
    assert result.path is not None
    through = none.copy()
    through[tuple(result.path.cells[3])] = True
    assert "closed cell" in faults(case, result, through, ends)
    assert "elsewhere" in faults(case, result, none, ends[::-1])
    shorter = dataclasses.replace(result, lower_bound_source=result.cost * 0.99)
    assert "bound" in faults(case, shorter, none, ends)
    cutting = Case(grid, case.open, np.full(grid.shape, 2.0))
    assert "states" in faults(cutting, result, none, ends)
    shut = hn.HybridPlanner(topology, preset="paper").plan((0.5, 0.5), (4.5, 0.5))
    assert not shut.solved
    assert "optimum" in faults(case, shut, none, ends)
    straight = dataclasses.replace(result.path, cells_source=np.array([[0, 0], [0, 8]]))
    assert "jumps" in faults(case, dataclasses.replace(result, path=straight), none, ends)
