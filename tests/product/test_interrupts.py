"""Interrupts at any moment leave no object half changed: what follows is as if there were none."""

import ast
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.baselines.hpa import HpaStar
from hybridnav.harness.baselines.grid import WeightedAstar
from tests.interrupts import Struck, lines_of, timer
from tests.product.test_threads import OVER_CELLS, grid_with_rooms, told
from tests.strategies import examples, occupancy_grid

GRID = grid_with_rooms(seed=8, side=45)
START, GOAL = GRID.frame.points_of(np.argwhere(GRID.enterable())[[0, -1]])


def struck(call: Callable[[], object], at: int) -> bool:
    """Whether an interrupt before the `at`-th line ended a call."""
    try:
        lines_of(call, strike_at=at)
    except Struck:
        return True
    return False


def spread(n_lines: int, count: int) -> Iterable[int]:
    """Numbers of so many lines, first and last among them; all where there are fewer."""
    return sorted({*np.linspace(1, n_lines, min(count, n_lines)).round().astype(int).tolist()})


def grown() -> hn.TopologicalMap:
    return hn.TopologicalMap(hn.DualGraphPyramid.build(GRID, merge_distance_m=3.0))


def record(topology: hn.TopologicalMap) -> list[Any]:
    """Return all that a pyramid is rebuilt from, and the arrays of its apex."""
    level = topology.level
    arrays = (level.field_of, level.arcs, level.sigma, level.max_distance_m, level.through_m)
    return [array.tolist() for array in arrays] + [level.boundary(0).tolist()]


@pytest.mark.parametrize("preset", OVER_CELLS)
def test_a_query_that_is_interrupted_before_any_line_changes_no_other(preset: str) -> None:
    planner = hn.HybridPlanner(grown(), preset=preset)
    cells = np.argwhere(GRID.enterable())
    around = hn.Blocked(cells=cells[np.abs(cells - 15).max(axis=1) < 5])

    def plain() -> Any:
        return told(planner.plan(START, GOAL))

    def closed() -> Any:
        return told(planner.plan(START, GOAL, blocked=around, smooth="line-of-sight"))

    expected = plain(), closed()
    assert expected[0] != expected[1]
    for call in (plain, closed):
        lines_of(call)  # what is found once
        for at in spread(lines_of(call), examples(60)):
            # After some queries `shortest` stops asking whether a graph of corners would pay.
            assert struck(call, at) or at > lines_of(call)
            assert (plain(), closed()) == expected


@pytest.mark.parametrize("method", [HpaStar, WeightedAstar])
def test_a_baseline_that_is_interrupted_answers_as_before(method: Any) -> None:
    planner = method(GRID)
    endpoints = [tuple(cell) for cell in np.argwhere(GRID.enterable())[[0, -1]].tolist()]
    expected = planner.solve(*endpoints)
    for at in range(1, lines_of(lambda: planner.solve(*endpoints)) + 1):
        assert struck(lambda: planner.solve(*endpoints), at)
        answer = planner.solve(*endpoints)
        assert (answer.cells == expected.cells).all()
        assert (answer.bound, answer.expanded) == (expected.bound, expected.expanded)


def test_a_map_whose_making_is_interrupted_is_made_again_alike() -> None:
    expected = record(grown())
    for at in spread(lines_of(grown), 60):
        assert struck(grown, at)
    assert record(grown()) == expected


def test_what_is_computed_on_demand_is_whole_or_absent() -> None:
    expected = record(grown())
    for at in spread(lines_of(lambda: record(grown())), 60):
        topology = grown()
        with suppress(Struck):
            lines_of(partial(record, topology), strike_at=at)
        assert record(topology) == expected


@pytest.mark.parametrize("preset", ["shortest", "octile", "paper"])
def test_a_planner_whose_making_is_interrupted_leaves_its_map_whole(preset: str) -> None:
    # Its file is read before: one that is left half read stays open for a while.
    topology, loaded = grown(), hn.load_preset(preset)

    def prepare() -> Any:
        return told(hn.HybridPlanner(topology, preset=loaded).plan(START, GOAL, smooth="none"))

    expected = prepare()
    for at in spread(lines_of(prepare), 40):
        assert struck(prepare, at)
    assert prepare() == expected


def test_a_signal_inside_a_query_with_blocked_cells_changes_no_other() -> None:
    side = 300
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(occupancy_grid(np.ones((side, side), np.uint8)))
    )
    planner = hn.HybridPlanner(topology, preset="grid-astar")
    band = np.zeros((side, side), np.bool_)
    band[20:-20] = True
    closed = hn.Blocked(cells=np.argwhere(band))
    across = (10.5, 5.5), (200.5, 295.5)
    expected = told(planner.plan(*across))
    began = time.perf_counter()
    planner.plan(*across, blocked=closed)
    duration_s = time.perf_counter() - began
    n_struck = 0
    for part in np.linspace(0.02, 1.0, 60):
        try:
            with timer(part * duration_s):
                planner.plan(*across, blocked=closed)
        except Struck:
            n_struck += 1
        assert told(planner.plan(*across)) == expected
    assert n_struck > 0


def strike_builds(count: int) -> int:
    """Interrupt builds by timers spread over one; how many were struck."""
    grid = occupancy_grid(np.ones((500, 500), np.uint8))

    def build() -> hn.DualGraphPyramid:
        return hn.DualGraphPyramid.build(grid, merge_distance_m=40.0)

    expected = build()[-1].field_of
    began = time.perf_counter()
    assert (build()[-1].field_of == expected).all()
    duration_s, n_struck = time.perf_counter() - began, 0
    for part in np.linspace(0.0, 1.0, count + 1)[1:]:
        try:
            with timer(part * duration_s):
                build()
        except Struck:
            n_struck += 1
    assert (build()[-1].field_of == expected).all()
    return n_struck


def test_signals_inside_the_kernels_of_a_build_raise_what_their_handler_raises() -> None:
    assert strike_builds(40) > 0


def of_kernels(path: Path) -> bool:
    return "kernels" in {path.stem, path.parent.name}


def is_of_kernels(node: ast.ImportFrom) -> bool:
    return ".kernels" in f"{node.module}.{node.names[0].name}"


def test_kernels_that_return_several_values_to_python_are_guarded() -> None:
    package = Path(hn.__file__).parent
    trees = {path: ast.parse(path.read_text(encoding="utf-8")) for path in package.rglob("*.py")}
    called = set()
    for path, tree in trees.items():
        modules = set()
        for node in ast.walk(tree) if not of_kernels(path) else ():
            if isinstance(node, ast.ImportFrom) and is_of_kernels(node):
                folder = package.parent.joinpath(*str(node.module).split("."))
                names = {alias.name for alias in node.names}
                called |= {name for name in names if not (folder / f"{name}.py").exists()}
                modules |= {alias.asname or alias.name for alias in node.names}
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) in modules:
                called.add(node.attr)
    found = {}
    for path, tree in trees.items():
        for node in tree.body if of_kernels(path) else ():
            if not isinstance(node, ast.FunctionDef) or node.name not in called:
                continue
            returns = [part for part in ast.walk(node) if isinstance(part, ast.Return)]
            if any(isinstance(part.value, ast.Tuple) for part in returns):
                found[path.stem, node.name] = [ast.unparse(one) for one in node.decorator_list]
    assert len(found) > 20
    assert [name for name, decorators in found.items() if decorators[0] != "guarded"] == []


def test_an_interrupt_inside_numpy_stays_one() -> None:
    """numpy turns what is raised while it compares records into a TypeError of its own."""
    other, numpy = grid_with_rooms(seed=9, side=45), str(Path(np.__file__).parent)
    planner = hn.HybridPlanner(grown(), preset="shortest")

    def answer() -> Any:
        result = planner.plan(START, GOAL)
        return result.status, result.cost

    def follow(at: int = 0) -> int:
        """Open and close many cells; strike before a line of numpy."""
        planner.update(grid=GRID)
        return lines_of(partial(planner.update, grid=other), strike_at=at, within=numpy)

    before, n_lines = answer(), [follow() for _ in range(2)][1]
    expected = {before, answer()}
    for at in range(1, n_lines + 1):
        with pytest.raises(Struck):
            follow(at)
        assert answer() in expected


def test_rows_are_compared_without_records() -> None:
    """`numpy.unique` with an axis makes records of them; see `unique_rows`."""
    package = Path(hn.__file__).parent
    found = [
        f"{path.name}:{node.lineno}"
        for path in package.rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "np.unique"
        if "axis" in {keyword.arg for keyword in node.keywords}
    ]
    assert found == []


@pytest.mark.full
def test_hundreds_of_signals_inside_the_kernels_of_a_build() -> None:
    assert strike_builds(400) > 0


@pytest.mark.parametrize("preset", ["robot", "grid-astar"])
def test_an_interrupted_update_leaves_the_costs_before_or_the_new_ones(preset: str) -> None:
    topology = grown()
    factors = np.random.default_rng(1).uniform(1, 5, GRID.shape).astype(np.float32)
    before, after = hn.CostLayer(np.ones(GRID.shape, np.float32)), hn.CostLayer(factors)

    def planner_by(layer: hn.CostLayer) -> hn.HybridPlanner:
        planner = hn.HybridPlanner(topology, preset=preset, costs=layer)
        planner.prepare()
        return planner

    def answer(planner: hn.HybridPlanner) -> float:
        result = planner.plan(START, GOAL)
        assert result.lower_bound <= result.cost * (1 + 1e-9)
        return round(result.cost, 6)

    expected = [answer(planner_by(layer)) for layer in (before, after)]
    assert expected[0] < expected[1]
    fresh = planner_by(before)
    n_lines = lines_of(lambda: fresh.update(costs=after))
    seen, n_struck = set(), 0
    for at in spread(n_lines, 40):
        planner = planner_by(before)
        n_struck += struck(partial(planner.update, costs=after), at)
        seen.add(answer(planner))
        planner.update(costs=before)
        assert answer(planner) == expected[0]
    assert seen == set(expected)
    assert n_struck > 10  # a later update has fewer lines than the first one
