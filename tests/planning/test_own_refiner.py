"""Refiners of the user's own: what a preset may name, and what becomes of their answers."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.refine import GridRefiner
from hybridnav.topology import TopologicalMap
from tests.strategies import drawn, occupancy_grid

Write = Callable[[str, str], None]

START, GOAL = (0.5, 0.5), (6.5, 2.5)
FAULTS = """
import numpy as np

class Faulty:
    def __init__(self, grid, *, allow_unexplored):
        pass
    def refine(self, start, goal, corridor):
        return {answer}
"""


class Spy(GridRefiner):
    """The package's refiner, which counts its calls."""

    calls = 0

    def refine(self, start: Any, goal: Any, corridor: Any) -> Any:
        """Count, and find the shortest path."""
        Spy.calls += 1
        return super().refine(start, goal, corridor)


class Resigned:
    """Finds nothing."""

    def __init__(self, grid: hn.OccupancyGrid, *, allow_unexplored: bool) -> None:
        pass

    def refine(self, *_: Any) -> Any:
        return None, 7


class Astray(Resigned):
    """Goes the long way round, whatever the corridor."""

    def refine(self, *_: Any) -> Any:
        """Return a path along three walls."""
        row = [(0, col) for col in range(7)]
        return [*row, (1, 6), *((2, cell[1]) for cell in row[::-1])], 1


@pytest.fixture
def topology() -> TopologicalMap:
    grid = occupancy_grid(drawn(".......", ".##.##.", "......."))
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Write a module that can be imported."""

    def write(name: str, code: str) -> None:
        (tmp_path / f"{name}.py").write_text(code)
        monkeypatch.syspath_prepend(tmp_path)
        monkeypatch.delitem(sys.modules, name, raising=False)

    return write


def planner_of(topology: TopologicalMap, refine: str, coarse: str = "paper") -> hn.HybridPlanner:
    preset = hn.load_preset(coarse, overrides=[f"planner.refine={refine}"])
    return hn.HybridPlanner(topology, preset=preset)


@pytest.mark.parametrize("coarse", ["paper", "grid-astar"])
def test_a_preset_plans_with_the_class_that_it_names(topology: TopologicalMap, coarse: str) -> None:
    Spy.calls = 0
    own = planner_of(topology, f"{__name__}:Spy", coarse)
    result, known = (
        own.plan(START, GOAL),
        hn.HybridPlanner(topology, preset=coarse).plan(START, GOAL),
    )
    assert Spy.calls == 1
    np.testing.assert_array_equal(result.path.cells, known.path.cells)
    assert result.route == known.route
    assert result.settings["planner"]["refine"] == f"{__name__}:Spy"
    # Of a foreign search nothing is known: no more than the octile distance is proved. `paper` has
    # the shortest path of cells found when somebody asks.
    proved = known.cost if coarse == "paper" else 4 + 2 * np.sqrt(2)
    assert result.lower_bound == pytest.approx(proved)
    batch = own.plan_many([START, START], [GOAL, START])
    assert batch.cost.tolist() == [result.cost, 0.0]


def test_a_path_of_the_class_goes_round_what_is_closed(topology: TopologicalMap) -> None:
    planner = planner_of(topology, f"{__name__}:Spy", "grid-astar")
    path = planner.plan(START, GOAL).raise_for_status().path
    shut = path.cells[len(path.cells) // 2]
    detour = planner.plan(START, GOAL, blocked={"cells": [shut]})
    assert shut.tolist() not in detour.path.cells.tolist()


@pytest.mark.parametrize("coarse", ["paper", "grid-astar"])
def test_a_class_that_finds_nothing_proves_nothing(topology: TopologicalMap, coarse: str) -> None:
    result = planner_of(topology, f"{__name__}:Resigned", coarse).plan(START, GOAL)
    assert result.status is hn.PlanStatus.NO_PATH
    assert result.lower_bound == pytest.approx(4 + 2 * np.sqrt(2))
    assert result.stats.expanded == 7


@pytest.mark.parametrize(
    ("code", "name", "words"),
    [
        ("", "no_such_module_here:C", "cannot be imported, ModuleNotFoundError: No module named"),
        ("1 / 0", "mine:C", "module mine cannot be imported, ZeroDivisionError: division by zero"),
        ("def", "mine:C", "module mine cannot be imported, SyntaxError: "),
        ("raise SystemExit(3)", "mine:C", "module mine cannot be imported, SystemExit: 3"),
        ("raise ValueError('a\\n' * 999)", "mine:C", "cannot be imported, ValueError: a a a"),
        ("", "mine:C", "module mine has nothing of that name, expected a class C"),
        ("C = 3", "mine:C", "module mine has a int, expected a class C"),
        ("class C: pass", "mine:C", "C(grid, allow_unexplored=False) fails, TypeError: "),
        ("class C:\n def __init__(self, *_, **__): 1 / 0", "mine:C", "fails, ZeroDivisionError: "),
        ("class C:\n def __init__(self, *_, **__): pass", "mine:C", "it is no refiner, Attribut"),
        (
            "class C:\n def __init__(self, *_, **__): pass\n def refine(self): pass",
            "mine:C",
            "too many positional arguments: expected a method refine(start, goal, corridor)",
        ),
    ],
)
def test_a_class_that_cannot_be_used_is_refused_in_one_line(topology, write, code, name, words):
    write("mine", code)
    with pytest.raises(hn.errors.PresetError) as caught:
        planner_of(topology, name)
    text = str(caught.value)
    assert text.startswith(f"planner.refine: {name}: ")
    assert words in text
    assert text.isprintable()
    assert len(text) < 300


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("None", "something else than (cells, expanded)"),
        ("([start, goal], 'many')", "something else than (cells, expanded)"),
        ("([[1, 2], [3]], 1)", "something else than (cells, expanded)"),
        ("([0, 1, 2], 1)", "cells of shape (3,) and type int64"),
        ("(np.zeros((2, 2)), 1)", "cells of shape (2, 2) and type float64"),
        ("([[0, 1], [0, 2]], 1)", "a path that does not lead from (0, 0) to (2, 6)"),
        ("(np.empty((0, 2), int), 1)", "a path that does not lead from (0, 0) to (2, 6)"),
        ("([start, goal], 1)", "a path with a move that is not legal on the grid"),
        ("([start, (1, 1), (2, 2), goal], 1)", "a path with a move that is not legal"),
        ("([start, (-1, 0), start, goal], 1)", "a path with a move that is not legal"),
    ],
)
def test_an_answer_that_is_no_path_is_refused_in_one_line(topology, write, answer, words):
    write("faulty", FAULTS.format(answer=answer))
    planner = planner_of(topology, "faulty:Faulty")
    with pytest.raises(hn.errors.PresetError) as caught:
        planner.plan(START, GOAL)
    assert str(caught.value).startswith(f"planner.refine: faulty:Faulty: refine returned {words}")
    assert str(caught.value).isprintable()


def test_a_path_outside_the_corridor_is_refused(topology: TopologicalMap) -> None:
    overrides = ["planner.levels=places", f"planner.refine={__name__}:Astray"]
    planner = hn.HybridPlanner(topology, preset=hn.load_preset("paper", overrides=overrides))
    with pytest.raises(hn.errors.PresetError, match="a path that leaves its corridor"):
        planner.plan(START, (0.5, 2.5))


@pytest.mark.parametrize("name", ["mine", "mine:", ":C", "my file:C", "a..b:C", "a:C:D", "../a:C"])
def test_only_names_of_classes_are_settings(name: str) -> None:
    with pytest.raises(
        hn.errors.PresetError, match="'grid-astar' or a class of your own, module:Class"
    ):
        hn.load_preset("paper", overrides=[f"planner.refine='{name}'"])


def test_a_method_that_has_no_corridor_takes_no_class() -> None:
    with pytest.raises(
        hn.errors.PresetError, match=r"planner\.refine: no key of method shortest, but of"
    ):
        hn.load_preset("shortest", overrides=["planner.refine=mine:C"])


def test_reading_a_preset_imports_nothing(write: Write) -> None:
    write("unread", "raise SystemExit('imported')")
    preset = hn.load_preset("paper", overrides=["planner.refine=unread:C"])
    assert preset.planner.refine == "unread:C"
    assert "unread" not in sys.modules
