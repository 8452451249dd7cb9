"""Planners of others as methods: their paths are legal, their lengths what they can be."""

import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.baselines.rivals import Networkx, Pyastar2d, Tcod
from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass, OccupancyGrid
from hybridnav.harness.methods import RIVALS, baseline_spec
from hybridnav.harness.output import write_outputs
from hybridnav.harness.run import RunSettings, evaluate
from hybridnav.metrics import ScipyOptimum, judge_path
from tests.harness.small_runs import ROOMS, run_here, write_map

OF_PACKAGE: dict[str, Any] = {"networkx": Networkx, "pyastar2d": Pyastar2d, "tcod": Tcod}
SLACK = {"networkx": 1e-9, "tcod": 0.003, "pyastar2d": 1.0}
"""99 / 70 is 0.006 % above the square root of 2; a path of pyastar2d may be twice as long."""


@pytest.mark.parametrize("package", OF_PACKAGE)
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), share=st.sampled_from([0.0, 0.2, 0.35]))
def test_their_paths_are_legal_and_as_long_as_they_say(package, seed, share):
    pytest.importorskip(package)
    rng = np.random.default_rng(seed)
    grid = OccupancyGrid((rng.random((9, 12)) < share).astype(np.float32), robot_radius_m=0)
    free = [(row, col) for row, col in np.argwhere(grid.classes == CellClass.FREE).tolist()]
    method, optimum = OF_PACKAGE[package](grid), ScipyOptimum(grid)
    for at in rng.integers(0, len(free), 4).tolist():
        start, goal = free[0], free[at]
        best = float(optimum.lengths_from(start)[goal])
        answer = method.solve(start, goal)
        if answer.gave_up:
            assert package == "pyastar2d"
            continue
        assert answer.is_path == np.isfinite(best)
        if answer.cells is not None:
            verdict = judge_path(grid, answer.cells, start=start, goal=goal)
            assert verdict.ok, verdict.faults
            assert best * (1 - 1e-9) <= verdict.length_m <= best * (1 + SLACK[package])


def test_a_rival_is_in_the_tables_with_its_version(tmp_path, monkeypatch):
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
    rooms = write_map(tmp_path, ROOMS)
    evaluate(
        RunSettings(maps=(str(rooms),), presets=(), baselines=("networkx",), pairs=8),
        tmp_path / "run",
    )
    study = write_outputs(tmp_path / "run")
    assert study.faults == []
    assert study.labels == ["grid-astar", "networkx"]
    assert study.of_method("networkx")[0].losses.max() <= 1e-9
    report = (tmp_path / "run" / "report.html").read_text()
    assert "<dt>planners of others</dt><dd>networkx " in report


def test_a_rival_that_is_not_installed_is_refused_in_one_line(monkeypatch):
    assert RIVALS.keys() == OF_PACKAGE.keys()
    monkeypatch.setitem(sys.modules, "tcod", None)
    with pytest.raises(InvalidValueError, match=r"needs tcod: pip install 'hybridnav\[bench\]'"):
        baseline_spec("tcod")


def test_networkx_is_not_asked_for_a_graph_that_does_not_fit():
    grid = OccupancyGrid(np.zeros((320, 320), np.float32), robot_radius_m=0)
    with pytest.raises(InvalidValueError, match="up to 100,000 free cells, this map has 102,400"):
        Networkx(grid)
