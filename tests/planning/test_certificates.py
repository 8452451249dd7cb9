"""The bound is a theorem: lower bound <= optimum <= cost for every preset, on little maps."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from tests.certificates import (
    DIRECTIONS,
    Cell,
    built,
    check_pairs,
    check_plan,
    planned,
    planners_of,
    random_pairs,
)
from tests.strategies import Scene, drawn, examples, scenes

PLAIN = settings(max_examples=examples(30), deadline=None, derandomize=True)


# --- random maps --------------------------------------------------------------------------------


@given(scene=scenes(max_side=24), allow=st.booleans())
@PLAIN
def test_bounds_hold_on_any_map(scene: Scene, allow: bool) -> None:
    topology = built(scene)
    planners = planners_of(topology, f"planner.allow_unexplored={allow}".lower())
    enterable = topology.grid.enterable(allow_unexplored=allow)
    pairs = random_pairs(enterable, np.random.default_rng(scene.seed), 6)
    check_pairs(planners, pairs, by_scipy=True)


@given(scene=scenes(max_side=24), allow=st.booleans())
@PLAIN
def test_bounds_hold_where_corners_may_be_cut(scene: Scene, allow: bool) -> None:
    topology = built(scene, corner_cutting=True)
    planners = planners_of(topology, f"planner.allow_unexplored={allow}".lower())
    enterable = topology.grid.enterable(allow_unexplored=allow)
    pairs = random_pairs(enterable, np.random.default_rng(scene.seed), 6)
    check_pairs(planners, pairs, by_scipy=False)
    paper, grid_astar = hn.HybridPlanner(topology, preset="paper"), planners[0]
    for pair in pairs if not allow else ():
        if planned(paper, *pair).solved:
            check_plan(paper, *pair, planned(grid_astar, *pair).cost)


@pytest.mark.parametrize("occupied", [0.1, 0.25, 0.35, 0.45])
def test_bounds_hold_in_noise(occupied: float) -> None:
    rng = np.random.default_rng(int(100 * occupied))
    for side, distance_m in ((9, 2.0), (14, 3.0), (30, 6.0), (60, 9.0)):
        topology = built(Scene((rng.random((side, side)) >= occupied) * 1, 1.0, distance_m, 0))
        pairs = random_pairs(topology.grid.enterable(), rng, 40)
        check_pairs(planners_of(topology), pairs, by_scipy=False)


# --- small maps, all pairs ----------------------------------------------------------------------

DRAWINGS = {
    "one-cell doors": drawn(
        "....#....#...",
        ".........#...",
        "....#........",
        "####.####.###",
        "....#....#...",
        "....#........",
        ".........#...",
    ),
    "rooms that meet at points": drawn(
        "...##...", "...##...", "##...###", "##...###", "...##...", "...##..."
    ),
    "fields that meet at points": drawn(*["." * 8] * 8),
    "a sealed room": drawn(".........", "..#####..", "..#...#..", "..#####..", "........."),
    "one row": drawn("......#......?...."),
    "one column": drawn(*"........"),
    "a spiral": drawn(
        ".........",
        "########.",
        ".......#.",
        ".#####.#.",
        ".#...#.#.",
        ".#.###.#.",
        ".#.....#.",
        ".#######.",
        ".........",
    ),
}


@pytest.mark.parametrize("name", DRAWINGS)
@pytest.mark.parametrize("corner_cutting", [False, True])
def test_bounds_hold_for_all_pairs(name: str, corner_cutting: bool) -> None:
    for distance_m in (1.5, 4.0):
        scene = Scene(DRAWINGS[name], 1.0, distance_m, 0)
        topology = built(scene, corner_cutting=corner_cutting)
        planners = planners_of(topology)
        cells = [tuple(cell) for cell in np.argwhere(topology.grid.enterable()).tolist()]
        # A step that no row of pairs is a multiple of: each cell comes up as a start and a goal.
        pairs = list(itertools.product(cells, cells))[:: max(1, len(cells) ** 2 // 150) | 1]
        pairs += zip(cells[::5], cells[::5], strict=True)
        check_pairs(planners, pairs, by_scipy=not corner_cutting)


def test_bounds_hold_inside_fields_across_borders_and_where_fields_only_touch() -> None:
    topology = built(Scene(np.ones((24, 24), dtype=np.uint8), 1.0, 1.5, 1))
    planners = planners_of(topology)
    field_of = topology.level.field_of
    borders = {
        frozenset(pair)
        for first, second in ((field_of[1:], field_of[:-1]), (field_of[:, 1:], field_of[:, :-1]))
        for pair in zip(first.ravel().tolist(), second.ravel().tolist(), strict=True)
    }
    cells = set(itertools.product(range(24), range(24)))
    kinds: dict[str, list[tuple[Cell, Cell]]] = {"inside": [], "across": [], "touching": []}
    for cell, step in itertools.product(sorted(cells), DIRECTIONS):
        beside = (cell[0] + step[0], cell[1] + step[1])
        if beside in cells:
            fields = frozenset((int(field_of[cell]), int(field_of[beside])))
            kind = "inside" if len(fields) == 1 else "across" if fields in borders else "touching"
            kinds[kind].append((cell, beside))
    touching = {frozenset((int(field_of[a]), int(field_of[b]))) for a, b in kinds["touching"]}
    assert touching
    for one, other in map(sorted, touching):
        endpoints = (np.argwhere(field_of == field).tolist() for field in (one, other))
        kinds["touching"] += [((a, b), (c, d)) for (a, b), (c, d) in itertools.product(*endpoints)]
    for pairs in kinds.values():
        check_pairs(planners, pairs[:: max(1, len(pairs) // 100)], by_scipy=True)


@pytest.mark.parametrize("classes", [drawn("#"), drawn("?#", "#?"), drawn("."), drawn(".#", "#.")])
def test_maps_with_hardly_a_cell_can_be_planned_on(classes: Any) -> None:
    topology = built(Scene(classes, 1.0, 4.0, 0))
    planners = planners_of(topology)
    check_pairs(planners, random_pairs(classes == 1, np.random.default_rng(0), 9), by_scipy=True)
    if classes[0, 0] == 0:
        for planner in planners:
            assert planned(planner, (0, 0), (0, 0)).status is hn.PlanStatus.START_OCCUPIED
