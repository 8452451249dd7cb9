"""Planners of others as methods: their paths are legal, their lengths what they can be."""

import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.rivals import NanoAstar, Networkx, Pyastar2d, RoutingKit, ScikitImage, Scipy, Tcod
from benchmarks.rivals_any_angle import ExtremityPathfinder, OmplWhole
from benchmarks.subjects._study_run import RIVALS
from hybridnav.errors import InvalidValueError, OmplError, UnsuitableMapError
from hybridnav.harness.judges import (
    CheapestCost,
    ScipyOptimum,
    VisibilityGraph,
    judge_line,
    judge_path,
)
from hybridnav.harness.methods import baseline_spec, named_spec, prepare
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.costs import CostLayer


@dataclass(frozen=True)
class Case:
    """A rival, and by how much its paths may be longer than the optimum in its metric."""

    package: str
    made_of: Any
    slack: float
    any_angle: bool = False


CASES = {
    "networkx": Case("networkx", Networkx, 1e-9),
    "nano-astar": Case("nano_astar", NanoAstar, 1e-9),
    "pyroutingkit": Case("pyroutingkit", RoutingKit, 1e-4),
    # 99 / 70 is 0.006 % above the square root of 2, and a path of pyastar2d may be twice as long.
    "tcod": Case("tcod", Tcod, 0.003),
    "pyastar2d": Case("pyastar2d", Pyastar2d, 1.0),
    "scikit-image": Case("skimage", ScikitImage, 1.0),
    "scipy": Case("scipy", Scipy, 1e-9),
    "extremitypathfinder": Case("extremitypathfinder", ExtremityPathfinder, 1e-9, any_angle=True),
    "ompl-whole": Case("ompl", OmplWhole, 5.0, any_angle=True),
}
QUICK = [name for name in CASES if name not in {"ompl-whole", "extremitypathfinder"}]


def made(name, grid, **options):
    """Return a rival for a map; skip the test if its package is not installed."""
    pytest.importorskip(CASES[name].package, reason=f"{CASES[name].package} is not installed")
    if name == "ompl-whole":
        options = {"budget_s": 0.2} | options
    return CASES[name].made_of(grid, **options)


def grid_of(lines, **options):
    blocked = np.array([[cell == "#" for cell in line] for line in lines], dtype=np.float32)
    return OccupancyGrid(blocked, robot_radius_m=0, **options)


def random_grid(seed, share, shape=(9, 12)):
    rng = np.random.default_rng(seed)
    return OccupancyGrid((rng.random(shape) < share).astype(np.float32), robot_radius_m=0)


def check(name, grid, method, start, goal):
    """Judge one answer by code that shares nothing with the rival."""
    if CASES[name].any_angle:
        best = VisibilityGraph(grid).shortest(start, goal).length_m
    else:
        best = float(ScipyOptimum(grid).lengths_from(start)[goal])
    answer = method.solve(start, goal)
    if answer.gave_up:
        assert name in {"pyastar2d", "scikit-image", "ompl-whole"}
        return
    assert answer.is_path == np.isfinite(best)
    if answer.cells is not None:
        verdict = judge_path(grid, answer.cells, start=start, goal=goal)
    elif answer.any_angle is not None:
        points = answer.any_angle.points
        verdict = judge_line(grid, points, start=start, goal=goal)
        assert answer.any_angle.length_m == pytest.approx(verdict.length_m, rel=1e-9)
    else:
        return
    assert verdict.ok, verdict.faults
    assert best * (1 - 1e-6) <= verdict.length_m <= best * (1 + CASES[name].slack)
    assert best == 0 or verdict.length_m <= best * answer.bound * (1 + 1e-9)


@pytest.mark.parametrize("name", QUICK)
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), share=st.sampled_from([0.0, 0.2, 0.35]))
def test_their_paths_are_legal_and_as_long_as_they_say(name, seed, share):
    grid = random_grid(seed, share)
    free = [(row, col) for row, col in np.argwhere(grid.classes == CellClass.FREE).tolist()]
    method = made(name, grid)
    for at in np.random.default_rng(seed).integers(0, len(free), 4).tolist():
        check(name, grid, method, free[0], free[at])


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 10**6), share=st.sampled_from([0.0, 0.2, 0.35]))
def test_polygons_of_the_free_cells_have_the_paths_of_the_cells(seed, share):
    grid = random_grid(seed, share, shape=(7, 9))
    free = [(row, col) for row, col in np.argwhere(grid.classes == CellClass.FREE).tolist()]
    method = made("extremitypathfinder", grid)
    for at in np.random.default_rng(seed).integers(0, len(free), 3).tolist():
        check("extremitypathfinder", grid, method, free[0], free[at])


@pytest.mark.parametrize("seed", range(3))
def test_ompl_on_the_whole_map(seed):
    grid = random_grid(seed, 0.15)
    free = [(row, col) for row, col in np.argwhere(grid.classes == CellClass.FREE).tolist()]
    method = made("ompl-whole", grid)
    for goal in free[:: len(free) // 4]:
        check("ompl-whole", grid, method, free[0], goal)
    method.close()


HOSTILE = {
    "no path": (["..#..", "..#..", "..#.."], (1, 0), (1, 4)),
    "past a corner only": ([".#", "#."], (0, 0), (1, 1)),
    "start is goal": (["...", ".#."], (0, 0), (0, 0)),
    "start blocked": (["#..", "..."], (0, 0), (1, 2)),
    "goal blocked": (["..#", "..."], (0, 0), (0, 2)),
    "one row": (["......"], (0, 0), (0, 5)),
    "one column": ([".", ".", ".", "."], (3, 0), (0, 0)),
    "one row, cut": (["..#..."], (0, 0), (0, 5)),
    "cells alone": (["#.#", "###", "#.#"], (0, 1), (2, 1)),
    "one cell": (["."], (0, 0), (0, 0)),
    "between two corners": (["....", "..#.", ".#..", "...."], (1, 1), (2, 2)),
    "round an island of cells that touch": (
        [".....", ".#...", "..#..", "...#.", "....."],
        (3, 1),
        (1, 3),
    ),
}


@pytest.mark.parametrize("hostile", HOSTILE)
@pytest.mark.parametrize("name", CASES)
def test_hostile_queries(name, hostile):
    lines, start, goal = HOSTILE[hostile]
    grid = grid_of(lines)
    method = made(name, grid)
    free = grid.classes == CellClass.FREE
    if free[start] and free[goal]:
        check(name, grid, method, start, goal)
    else:
        assert not method.solve(start, goal).is_path
    getattr(method, "close", bool)()


@pytest.mark.parametrize("name", CASES)
def test_what_becomes_of_corners_that_may_be_cut(name):
    grid = grid_of([".#", "#."], corner_cutting=True)
    if CASES[name].any_angle:
        with pytest.raises(UnsuitableMapError, match="any-angle paths never pass between"):
            made(name, grid)
        return
    answer = made(name, grid).solve((0, 0), (1, 1))
    # It knows the rule, or it makes no claim.
    assert answer.is_path or answer.gave_up
    assert answer.is_path == (name in {"networkx", "pyroutingkit", "scipy", "tcod"})


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10**6), most=st.sampled_from([1.0, 4.0, 200.0]))
def test_contraction_hierarchies_plan_by_costs(seed, most):
    grid = random_grid(seed, 0.2)
    rng = np.random.default_rng(seed)
    layer = CostLayer(rng.uniform(1, most, grid.shape))
    method, cheapest = made("pyroutingkit", grid, costs=layer), CheapestCost(grid, layer)
    free = [(row, col) for row, col in np.argwhere(grid.classes == CellClass.FREE).tolist()]
    for at in rng.integers(0, len(free), 4).tolist():
        best = cheapest.cost_m(free[0], free[at])
        answer = method.solve(free[0], free[at])
        assert answer.is_path == np.isfinite(best)
        if answer.by_costs is not None:
            assert judge_path(grid, answer.cells, start=free[0], goal=free[at]).ok
            claim = answer.by_costs
            assert best * (1 - 1e-9) <= claim.cost_m <= best * (1 + 1e-4)
            assert claim.lower_bound_m <= best * (1 + 1e-9)
            assert claim.cost_m == pytest.approx(
                layer.cost_of_cells(answer.cells) * grid.resolution_m
            )


def test_weights_that_would_overflow_are_refused_in_one_line():
    grid = grid_of(["." * 1000] * 200)
    words = (
        r"below 2\^31 along any path, too few for 200,000 free cells with steps of up to 1.41e\+03"
    )
    costs = CostLayer(np.full(grid.shape, 1000.0))
    with pytest.raises(UnsuitableMapError, match=words):
        made("pyroutingkit", grid, costs=costs, most_cells=200_000)


def test_each_rival_has_a_version_and_settings():
    of_study = CASES.keys() - {"scipy", "scikit-image"} | {"ompl-whole-prmstar"}
    assert {rival.name for rival in RIVALS} == of_study
    grid = grid_of(["...", ".#.", "..."])
    for key, case in CASES.items():
        method = made(key, grid)
        name = {"skimage": "scikit-image"}.get(case.package, case.package)
        assert method.version.split()[0].replace("-", "_") == name.replace("-", "_")
        assert method.version.split()[1][0].isdigit()
        assert method.settings
        getattr(method, "close", bool)()
    rival = next(rival for rival in RIVALS if rival.name == "ompl-whole-prmstar")
    spec = named_spec(rival, merge_distance_m=None, by_costs=False, clear_edges_only=False)
    prepared = prepare(spec, grid)
    assert "PRMstar, up to 1 s a query, seed 1" in prepared.method.settings  # type: ignore[attr-defined]
    prepared.close()


@pytest.mark.parametrize("name", [name for name in CASES if name != "scipy"])
def test_a_rival_that_is_not_installed_is_refused_in_one_line(name, monkeypatch):
    monkeypatch.setitem(sys.modules, CASES[name].package, None)
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    with pytest.raises((InvalidValueError, OmplError), match=r"needs .*pip install"):
        CASES[name].made_of(grid_of(["..."]))


@pytest.mark.parametrize("rival", RIVALS, ids=lambda rival: rival.name)
def test_a_name_of_earlier_versions_is_answered_with_what_to_write(rival):
    with pytest.raises(InvalidValueError, match=f"baseline {rival.name} .* write {rival.source}"):
        baseline_spec(rival.name)


def test_networkx_is_not_asked_for_a_graph_that_does_not_fit():
    grid = OccupancyGrid(np.zeros((320, 320), np.float32), robot_radius_m=0)
    with pytest.raises(UnsuitableMapError, match="up to 100,000 free cells, this map has 102,400"):
        Networkx(grid)


def test_pyroutingkit_is_not_asked_to_prepare_too_many_cells_unless_it_is_told():
    pytest.importorskip("pyroutingkit", reason="no wheel for this Python")
    grid = grid_of(["...", ".#.", "..."])
    with pytest.raises(UnsuitableMapError, match="up to 7 free cells, this map has 8"):
        RoutingKit(grid, most_cells=7)
    assert RoutingKit(grid, most_cells=8).between((0, 0), (2, 2)).is_path


def test_extremitypathfinder_is_not_asked_about_too_many_vertices():
    grid = random_grid(1, 0.3, shape=(40, 40))
    with pytest.raises(UnsuitableMapError, match="up to 1,000 vertices of polygons, this map has"):
        made("extremitypathfinder", grid)
    small = made("extremitypathfinder", grid_of(["...", ".#.", "..."]), max_vertices=8)
    assert small.n_nodes == 8
    with pytest.raises(UnsuitableMapError, match="up to 7 vertices of polygons, this map has 8"):
        made("extremitypathfinder", grid_of(["...", ".#.", "..."]), max_vertices=7)
