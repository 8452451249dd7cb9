"""The bound is a theorem: lower bound <= optimum <= cost for every preset, on every map."""

from __future__ import annotations

import itertools
import math
import os
import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.grid.worlds import figure1_world, office_world
from hybridnav.harness.pairs import sample_pairs
from hybridnav.planner.cell_plans import OverPortals
from hybridnav.route import portal_search
from hybridnav.search.grid_search import GridSearch
from tests.oracle.grid import assert_legal, components, distances, move_graph, recounted
from tests.strategies import Scene, drawn, scenes

if TYPE_CHECKING:
    from collections.abc import Iterator

Cell = tuple[int, int]

CHOICES = [
    ("paper", ()),
    ("grid-astar", ()),
    ("fast", ()),
    ("balanced", ()),
    ("certified", ()),
    ("certified", ("planner.epsilon=0.1",)),
    ("certified", ("planner.epsilon=0",)),
]
"""Presets and settings: every point of the trade-off, from no proof to the exact optimum."""

UNEXPLORED_TOO = "planner.allow_unexplored=true"
PLAIN = settings(max_examples=100, deadline=None, derandomize=True)
DIRECTIONS = tuple(move for move in itertools.product((-1, 0, 1), repeat=2) if move != (0, 0))

SOME_MAPS = {
    "aws_small_warehouse/005/map.yaml",
    "giraff_homes/UMA_236_237.yaml",
    "nav2/maps/depot.yaml",
    "radish_grids/freiburg-079.yaml",
    "movingai/cities/Berlin_0_256.map",
    "movingai/da2/ht_chantry.map",
    "movingai/dao/lak303d.map",
    "movingai/mapf/warehouse-10-20-10-2-1.map",
}
"""Maps of the reference data that are always tested; the other ones with `full` only."""


def planners_of(topology: hn.TopologicalMap, *overrides: str) -> list[hn.HybridPlanner]:
    """A planner for each of the choices.

    Where corners may be cut, paths go where the places have no arcs (`OccupancyGrid` says so): what
    the paper's rule cannot reach there is left out, and tested by itself.
    """
    choices = CHOICES[1:] if topology.grid.corner_cutting else CHOICES
    presets = [hn.load_preset(name, overrides=[*own, *overrides]) for name, own in choices]
    return [hn.HybridPlanner(topology, preset=preset) for preset in presets]


def search_of(planner: hn.HybridPlanner) -> portal_search.PortalSearch:
    """The search behind a preset that routes over portals."""
    assert isinstance(planner._cells, OverPortals)
    return planner._cells.search


def planned(planner: hn.HybridPlanner, start: Any, goal: Any) -> hn.PlanResult:
    """The plan between the centres of two cells."""
    return planner.plan(*planner.topology.grid.frame.points_of([start, goal]))


def assert_proved(result: hn.PlanResult, optimum: float, epsilon: float | None) -> None:
    """A result against the length of a shortest path in metres, infinite where there is none."""
    assert result.metric == "octile"
    if math.isinf(optimum):
        assert result.status is hn.PlanStatus.NO_PATH
        assert result.cost == result.lower_bound == math.inf
        assert math.isnan(result.gap)
        return
    assert result.status is hn.PlanStatus.SOLVED
    assert 0 <= result.lower_bound <= result.cost
    assert result.lower_bound <= optimum * (1 + 1e-9)
    assert optimum <= result.cost * (1 + 1e-9)
    if optimum == 0:
        assert result.cost == result.lower_bound == result.gap == 0
        return
    # Distinct cells are a cell apart at least, and so much every preset knows.
    assert result.lower_bound > 0
    assert result.gap == pytest.approx(result.cost / result.lower_bound - 1, abs=1e-12)
    if epsilon is not None:
        assert result.gap <= epsilon + 1e-9
    if epsilon == 0:
        assert result.gap == 0
        assert result.cost == pytest.approx(optimum, rel=1e-9)


def check_plan(planner: hn.HybridPlanner, start: Any, goal: Any, optimum: float) -> hn.PlanResult:
    """Plan, and hold the answer against the optimum, the legal moves and the preset's promise."""
    grid, setting = planner.topology.grid, planner.preset.planner
    result = planned(planner, start, goal)
    assert_proved(result, optimum, setting.epsilon)
    if result.path is not None:
        enterable = grid.enterable(allow_unexplored=setting.allow_unexplored)
        cells = result.path.cells
        assert cells[[0, -1]].tolist() == [list(start), list(goal)]
        if not grid.corner_cutting:
            assert_legal(cells, enterable)
        assert enterable[cells[:, 0], cells[:, 1]].all()
        assert result.cost == pytest.approx(recounted(cells) * grid.resolution_m, rel=1e-12)
    if setting.coarse == "none" and result.path is not None:
        assert result.gap == 0
    return result


def check_pairs(planners: list[hn.HybridPlanner], pairs: Any, *, by_scipy: bool) -> None:
    """Hold every planner's answers against optima that none of them computed."""
    grid = planners[0].topology.grid
    enterable = grid.enterable(allow_unexplored=planners[0].preset.planner.allow_unexplored)
    graph = move_graph(enterable) if by_scipy else None
    search = GridSearch(enterable, corner_cutting=grid.corner_cutting)
    for start, goal in pairs:
        if graph is not None:
            optimum = float(distances(graph, grid.shape, start)[goal])
        else:
            found = search.search(start, goal).cells
            optimum = math.inf if found is None else recounted(found)
        for planner in planners:
            check_plan(planner, start, goal, optimum * grid.resolution_m)


def random_pairs(enterable: Any, rng: np.random.Generator, count: int) -> list[tuple[Cell, Cell]]:
    """Pairs of cells: anywhere, and as many from the two sides of a step."""
    cells = np.argwhere(enterable)
    if not len(cells):
        return []
    far = rng.choice(cells, (count, 2)).reshape(-1, 4)
    near = rng.choice(cells, count)
    beside = near + rng.choice(DIRECTIONS, count)
    inside = ((beside >= 0) & (beside < enterable.shape)).all(axis=1)
    near, beside = near[inside], beside[inside]
    free = enterable[beside[:, 0], beside[:, 1]]
    both = np.concatenate([far, np.concatenate([near[free], beside[free]], axis=1)])
    return [((a, b), (c, d)) for a, b, c, d in both.tolist()]


def built(scene: Scene, *, corner_cutting: bool = False) -> hn.TopologicalMap:
    """The topological map of a scene."""
    plain = scene.grid
    grid = hn.OccupancyGrid(plain.probability, plain.frame, corner_cutting=corner_cutting)
    pyramid = hn.DualGraphPyramid.build(
        grid, merge_distance_m=scene.merge_distance_m, seed=scene.seed
    )
    return hn.TopologicalMap(pyramid)


@contextmanager
def portals_every(spacing_cells: int | None) -> Iterator[None]:
    """Portals as sparse as an open floor gets them, on a map of any size; None for all of them."""
    with pytest.MonkeyPatch.context() as patch:
        if spacing_cells is not None:
            patch.setattr(portal_search, "MAX_BYTES_PER_CELL", -1)
            patch.setattr(portal_search, "LEAST_BYTES", -1)
            patch.setattr(portal_search, "MAX_SPARSE_BYTES_PER_CELL", 1 << 40)
            patch.setattr(portal_search, "SPARSE_SPACINGS", (spacing_cells,))
        yield


# --- random maps --------------------------------------------------------------------------------


@given(scene=scenes(max_side=24), allow=st.booleans())
@PLAIN
def test_bounds_hold_on_any_map(scene: Scene, allow: bool) -> None:  # noqa: FBT001
    topology = built(scene)
    planners = planners_of(topology, f"planner.allow_unexplored={allow}".lower())
    enterable = topology.grid.enterable(allow_unexplored=allow)
    pairs = random_pairs(enterable, np.random.default_rng(scene.seed), 6)
    check_pairs(planners, pairs, by_scipy=True)


@given(scene=scenes(max_side=24), allow=st.booleans())
@PLAIN
def test_bounds_hold_where_corners_may_be_cut(scene: Scene, allow: bool) -> None:  # noqa: FBT001
    topology = built(scene, corner_cutting=True)
    planners = planners_of(topology, f"planner.allow_unexplored={allow}".lower())
    enterable = topology.grid.enterable(allow_unexplored=allow)
    pairs = random_pairs(enterable, np.random.default_rng(scene.seed), 6)
    check_pairs(planners, pairs, by_scipy=False)
    paper, grid_astar = hn.HybridPlanner(topology, preset="paper"), planners[0]
    for pair in pairs if not allow else ():
        if planned(paper, *pair).solved:
            check_plan(paper, *pair, planned(grid_astar, *pair).cost)


@given(
    scene=scenes(max_side=24),
    corner_cutting=st.booleans(),
    spacing=st.sampled_from([1, 2, 8, 16, 256]),
)
@PLAIN
def test_bounds_hold_with_sparse_portals(
    scene: Scene,
    corner_cutting: bool,  # noqa: FBT001
    spacing: int,
) -> None:
    topology = built(scene, corner_cutting=corner_cutting)
    with portals_every(spacing):
        planners = planners_of(topology)
    searches = [search_of(p) for p in planners if p.preset.planner.coarse == "portals"]
    assert len(searches) == 5
    assert not any(search.is_exact for search in searches)
    pairs = random_pairs(topology.grid.enterable(), np.random.default_rng(scene.seed), 6)
    check_pairs(planners, pairs, by_scipy=False)


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
        "...##...",
        "...##...",
        "##...###",
        "##...###",
        "...##...",
        "...##...",
    ),
    "fields that meet at points": drawn(*["." * 8] * 8),
    "a sealed room": drawn(
        ".........",
        "..#####..",
        "..#...#..",
        "..#####..",
        ".........",
    ),
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
@pytest.mark.parametrize("spacing", [None, 3])
def test_bounds_hold_for_all_pairs(name: str, corner_cutting: bool, spacing: int | None) -> None:  # noqa: FBT001
    for distance_m in (1.5, 4.0):
        scene = Scene(DRAWINGS[name], 1.0, distance_m, 0)
        topology = built(scene, corner_cutting=corner_cutting)
        with portals_every(spacing):
            planners = planners_of(topology)[-5:]
        cells = [tuple(cell) for cell in np.argwhere(topology.grid.enterable()).tolist()]
        # A step that no row of pairs is a multiple of: each cell comes up as a start and a goal.
        pairs = list(itertools.product(cells, cells))[:: max(1, len(cells) ** 2 // 150) | 1]
        check_pairs(planners, pairs, by_scipy=not corner_cutting)


def test_bounds_hold_inside_fields_across_borders_and_where_fields_only_touch() -> None:
    topology = built(Scene(np.ones((24, 24), dtype=np.uint8), 1.0, 1.5, 1))
    planners = planners_of(topology)
    field_of = search_of(planners[-1])._field_of
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
    assert len(touching) == 6
    for one, other in map(sorted, touching):
        ends = (np.argwhere(field_of == field).tolist() for field in (one, other))
        kinds["touching"] += [((a, b), (c, d)) for (a, b), (c, d) in itertools.product(*ends)]
    for pairs in kinds.values():
        check_pairs(planners, pairs[:: max(1, len(pairs) // 100)], by_scipy=True)


@pytest.mark.parametrize("spacing", [None, 16])
def test_a_cell_and_itself_have_no_gap(spacing: int | None) -> None:
    for classes in DRAWINGS.values():
        topology = built(Scene(classes, 0.05, 0.15, 0))
        with portals_every(spacing):
            planners = planners_of(topology)
        for planner in planners:
            for cell in np.argwhere(topology.grid.enterable()).tolist()[::5]:
                result = check_plan(planner, cell, cell, 0.0)
                assert result.path is not None
                assert result.path.cells.tolist() == [cell]


@pytest.mark.parametrize("classes", [drawn("#"), drawn("?#", "#?"), drawn("."), drawn(".#", "#.")])
def test_maps_with_hardly_a_cell_can_be_planned_on(classes: Any) -> None:
    topology = built(Scene(classes, 1.0, 4.0, 0))
    planners = planners_of(topology)
    check_pairs(planners, random_pairs(classes == 1, np.random.default_rng(0), 9), by_scipy=True)
    if classes[0, 0] == 0:
        for planner in planners:
            assert planned(planner, (0, 0), (0, 0)).status is hn.PlanStatus.START_OCCUPIED


# --- floors, worlds, and a frame that is turned -------------------------------------------------


@pytest.mark.parametrize("spacing", [None, 16, 64])
def test_bounds_hold_on_an_open_floor(spacing: int | None) -> None:
    classes = np.ones((260, 300), dtype=np.uint8)
    classes[60:64, 40:260] = classes[130:200, 150:152] = 0
    topology = built(Scene(classes, 0.05, 2.0, 0))
    with portals_every(spacing):
        planners = planners_of(topology)
    pairs = random_pairs(topology.grid.enterable(), np.random.default_rng(1), 40)
    check_pairs(planners, pairs, by_scipy=False)


@pytest.fixture(scope="module")
def office() -> list[hn.HybridPlanner]:
    """A planner for each of the choices, on the office."""
    grid = office_world().grid(robot_radius_m=0.25)
    return planners_of(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))


def pairs_of(grid: hn.OccupancyGrid, count: int, seed: int) -> list[tuple[Cell, Cell]]:
    """Pairs of all distances, some across components, and some of neighbours."""
    near = random_pairs(grid.enterable(), np.random.default_rng(seed), count // 4)
    sampled = sample_pairs(grid, count // 2, seed=seed, least_distance_m=grid.resolution_m)
    return near + [(pair.start, pair.goal) for pair in sampled]


def test_bounds_hold_in_the_office(office: list[hn.HybridPlanner]) -> None:
    check_pairs(office, pairs_of(office[0].topology.grid, 400, 5), by_scipy=False)


def test_bounds_hold_in_the_office_with_sparse_portals(office: list[hn.HybridPlanner]) -> None:
    topology = office[0].topology
    with portals_every(32):
        planners = planners_of(topology)
    check_pairs(planners, pairs_of(topology.grid, 120, 6), by_scipy=False)


@pytest.mark.parametrize("overrides", [(), (UNEXPLORED_TOO,)])
def test_bounds_hold_in_figure_1(overrides: tuple[str, ...]) -> None:
    grid = figure1_world().grid(robot_radius_m=0.0)
    enterable = grid.enterable(allow_unexplored=bool(overrides))
    for distance_m in (0.3, 1.0, 10.0):
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=distance_m))
        pairs = random_pairs(enterable, np.random.default_rng(2), 50)
        check_pairs(planners_of(topology, *overrides), pairs, by_scipy=True)


def test_bounds_are_lengths_in_metres_whatever_the_frame() -> None:
    probability = office_world().grid(robot_radius_m=0.25).classes != hn.CellClass.FREE
    frame = hn.Frame(0.1, origin_m=(431_207.3, -12.5), yaw_rad=2.3)
    grid = hn.OccupancyGrid(probability[:120, :160].astype(np.float32), frame)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=3.0))
    check_pairs(planners_of(topology), pairs_of(grid, 60, 7), by_scipy=False)


# --- what the presets owe each other ------------------------------------------------------------


def test_a_smaller_epsilon_proves_more(office: list[hn.HybridPlanner]) -> None:
    by_epsilon = {p.preset.planner.epsilon: p for p in office if p.preset.name == "certified"}
    steps = [0.1, 0.01, 0.0]
    gaps = []
    for pair in pairs_of(office[0].topology.grid, 200, 8):
        results = [planned(by_epsilon[step], *pair) for step in steps]
        if results[0].solved:
            gaps.append([result.gap for result in results])
    assert (np.max(gaps, axis=0) <= np.array(steps) + 1e-9).all()
    means = np.mean(gaps, axis=0)
    assert means[0] > means[1] > means[2] == 0


def test_the_bound_is_worth_having(office: list[hn.HybridPlanner]) -> None:
    planner = next(p for p in office if p.preset.name == "balanced")
    gaps = [planned(planner, *pair).gap for pair in pairs_of(planner.topology.grid, 300, 9)]
    assert np.nanpercentile(gaps, 95) < 0.05


# --- the reference data -------------------------------------------------------------------------


def reference_maps() -> list[Any]:
    """Every map of the reference data; one that cannot be there without it."""
    folder = Path(os.environ.get("HYBRIDNAV_DATA", ""))
    table = folder / "maps.tsv"
    if not table.is_file():
        return ["none"]
    rows = [line.split("\t") for line in table.read_text().splitlines()[1:]]
    names = [name for name, kind in rows if kind == "map"]
    games = (folder / "movingai").glob("**/*.map")
    names += sorted(file.relative_to(folder).as_posix() for file in games)
    return [
        pytest.param(name, marks=() if name in SOME_MAPS else pytest.mark.full) for name in names
    ]


@pytest.mark.parametrize("name", reference_maps())
def test_bounds_hold_on_real_maps(data: Path, name: str) -> None:
    game = name.endswith(".map")
    with warnings.catch_warnings():
        # Some maps call grey free; they are planned on all the same.
        warnings.simplefilter("ignore", hn.MapWarning)
        grid = hn.load_map(data / name, robot_radius_m=0.0 if game else 0.25)
    distance_m = 40.0 if game else 4.0
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=distance_m))
    planners = planners_of(topology)
    check_pairs(planners, pairs_of(grid, 100, 3), by_scipy=False)
    one = components(grid.enterable())
    labels = np.unique(one[one > 0])
    if len(labels) > 1:
        ends = [tuple(np.argwhere(one == label)[0].tolist()) for label in labels[:2]]
        for planner in planners:
            check_plan(planner, ends[0], ends[1], math.inf)
