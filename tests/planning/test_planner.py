"""The planner as its user meets it: statuses, frames, bounds, presets, routes, records."""

import dataclasses
import itertools
import json
import math
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.maps import CellClass
from tests.oracle.corridors import corridor_of
from tests.oracle.grid import assert_legal, centre, components, distances, move_graph, recounted
from tests.strategies import drawn, occupancy_grid, scenes, seeds, tried

MAPS = Path(__file__).parents[2] / "maps"
OPEN = drawn(*["." * 9] * 6)
SEALED = drawn(".........", "..####...", "..#..#...", "..####...", ".........")
MIXED = drawn("..??..", "..??#.", "..??..")
# Two rooms that nothing can merge, one free and one unexplored, with a door near either end.
TWO_DOORS = drawn(
    "....#????", "....?????", "....#????", "....#????", "....#????", "....#????", ".....????"
)
WITH_UNEXPLORED = hn.load_preset("paper", overrides=["planner.allow_unexplored=true"])


def map_of(grid: hn.OccupancyGrid | Any, **build: Any) -> hn.TopologicalMap:
    if not isinstance(grid, hn.OccupancyGrid):
        grid = occupancy_grid(grid)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, **build))


def without_seconds(result: hn.PlanResult) -> dict[str, Any]:
    return {key: value for key, value in result.to_dict().items() if key != "seconds"}


presets = pytest.mark.parametrize("preset", ["paper", "grid-astar"])


@presets
@pytest.mark.parametrize(
    ("start", "goal", "status"),
    [
        ((-0.01, 1.0), (1.0, 1.0), "start outside the map"),
        ((9.0, 1.0), (1.0, 1.0), "start outside the map"),
        ((1.0, 5.0), (1.0, 1.0), "start outside the map"),
        ((1.0, 1.0), (1.0, -1e9), "goal outside the map"),
        ((1.0, 1.0), (-1e300, 1e300), "goal outside the map"),
        ((2.5, 1.5), (1.0, 1.0), "start occupied"),
        ((1.0, 1.0), (5.5, 3.5), "goal occupied"),
        ((0.5, 0.5), (3.5, 2.5), "no path"),
        ((4.5, 2.5), (0.5, 0.5), "no path"),
        ((3.5, 2.5), (4.5, 2.5), "solved"),
        ((0.0, 0.0), (8.999, 4.999), "solved"),
    ],
)
def test_an_end_that_cannot_be_planned_from_is_named(preset, start, goal, status):
    result = hn.HybridPlanner(map_of(SEALED, merge_distance_m=3.0), preset=preset).plan(start, goal)
    assert result.status == hn.PlanStatus(status)
    if status == "solved":
        assert result.raise_for_status() is result
        return
    assert not result.solved
    assert result.path is None
    assert result.route is None
    assert result.cost == result.lower_bound == math.inf
    assert math.isnan(result.gap)
    with pytest.raises(hn.errors.PlanError, match=status):
        result.raise_for_status()


@presets
def test_an_end_that_only_the_robots_radius_blocks_is_occupied(preset: str) -> None:
    probability = np.zeros((5, 9), dtype=np.float32)
    probability[2, 4] = 1.0
    for radius_m, status in ((0.9, "solved"), (1.0, "goal occupied")):
        grid = hn.OccupancyGrid(probability, robot_radius_m=radius_m)
        planner = hn.HybridPlanner(map_of(grid), preset=preset)
        assert planner.plan((0.5, 0.5), (4.5, 3.5)).status == hn.PlanStatus(status)


@presets
def test_unexplored_cells_are_refused_as_ends_and_not_passed(preset: str) -> None:
    planner = hn.HybridPlanner(map_of(MIXED), preset=preset)
    free, beyond, unexplored = (0.5, 0.5), (5.5, 0.5), (2.5, 0.5)
    assert planner.plan(unexplored, free).status is hn.PlanStatus.START_UNEXPLORED
    assert planner.plan(free, unexplored).status is hn.PlanStatus.GOAL_UNEXPLORED
    assert planner.plan(free, beyond).status is hn.PlanStatus.NO_PATH


@presets
def test_unexplored_cells_are_entered_when_the_preset_says_so(preset: str) -> None:
    allowing = hn.load_preset(preset, overrides=["planner.allow_unexplored=true"])
    planner = hn.HybridPlanner(map_of(MIXED), preset=allowing)
    result = planner.plan((0.5, 0.5), (5.5, 2.5)).raise_for_status()
    assert_legal(result.path.cells, MIXED != CellClass.OCCUPIED)
    assert result.cost == pytest.approx(3 + 2 * math.sqrt(2), abs=1e-12)
    assert planner.plan((2.5, 0.5), (3.5, 1.5)).solved
    assert planner.plan((4.5, 1.5), (3.5, 1.5)).status is hn.PlanStatus.START_OCCUPIED


@presets
@pytest.mark.parametrize("drawing", ["#", "?", "."])
def test_maps_of_one_class_and_one_cell_have_answers(preset: str, drawing: str) -> None:
    planner = hn.HybridPlanner(map_of(drawn(drawing)), preset=preset)
    expected = {"#": "start occupied", "?": "start unexplored", ".": "solved"}[drawing]
    assert planner.plan((0.1, 0.1), (0.9, 0.9)).status == hn.PlanStatus(expected)


@pytest.mark.parametrize(
    "point",
    [
        (math.nan, 0.0),
        (0.0, math.inf),
        (1.0,),
        (1.0, 2.0, math.nan),
        (1.0, 2.0, 3.0, 4.0),
        [[1.0, 2.0]],
        3.0,
        None,
        (10**400, 0),
    ],
)
def test_what_is_no_point_is_an_error_of_one_line(point: Any) -> None:
    planner = hn.HybridPlanner(map_of(OPEN))
    plans: list[tuple[str, Callable[[], object]]] = [
        ("start", lambda: planner.plan(point, (1.0, 1.0))),
        ("goal", lambda: planner.plan((1.0, 1.0), point)),
    ]
    for name, plan in plans:
        with pytest.raises(
            hn.errors.InvalidValueError, match=f"^{name} must be two finite"
        ) as raised:
            plan()
        assert "\n" not in str(raised.value)


@pytest.mark.parametrize("far", [(1e308, 1e308), (1.7e308, -1.7e308), (-1e308, 0.0)])
def test_a_point_at_the_end_of_the_number_range_is_just_outside(far: tuple[float, float]) -> None:
    frame = hn.Frame(resolution_m=0.05, origin_m=(3.0, 4.0), yaw_rad=0.7)
    grid = hn.OccupancyGrid(np.zeros((4, 4), dtype=np.float32), frame=frame, robot_radius_m=0)
    result = hn.HybridPlanner(map_of(grid)).plan(far, centre(grid, (0, 0)))
    assert result.status is hn.PlanStatus.START_OUTSIDE


@presets
@pytest.mark.parametrize("yaw_rad", [0.0, 0.6, math.pi / 2, -3.0])
def test_a_turned_and_shifted_frame_changes_the_points_alone(preset: str, yaw_rad: float) -> None:
    frame = hn.Frame(resolution_m=0.1, origin_m=(-7.0, 3.0), yaw_rad=yaw_rad)
    grid = hn.OccupancyGrid(
        np.where(SEALED == CellClass.OCCUPIED, 1.0, 0.0).astype(np.float32),
        frame=frame,
        robot_radius_m=0,
    )
    planner = hn.HybridPlanner(map_of(grid, merge_distance_m=0.3), preset=preset)
    start, goal = centre(grid, (0, 1)), centre(grid, (4, 7))
    path = planner.plan(start, goal).raise_for_status().path
    assert path.cells[[0, -1]].tolist() == [[0, 1], [4, 7]]
    assert path.points == pytest.approx(
        np.array([centre(grid, (row, col)) for row, col in path.cells.tolist()]), abs=1e-12
    )
    assert path.length_m == pytest.approx(0.1 * recounted(path.cells), rel=1e-12)
    if yaw_rad == math.pi / 2:
        # A quarter turn: along a row is along y, and rows go to the left.
        assert path.points[0] == pytest.approx([-7.05, 3.15])


@presets
def test_within_one_cell_there_is_nothing_to_go_and_nothing_to_prove(preset: str) -> None:
    result = hn.HybridPlanner(map_of(OPEN), preset=preset).plan((3.1, 2.2), (3.9, 2.8))
    assert result.solved
    assert result.path.points.tolist() == [[3.5, 2.5]]
    assert result.path.length_m == result.cost == result.lower_bound == result.gap == 0
    assert len(result.route.places) == 1
    assert result.route.arcs == ()


def test_gap_of_a_corridor_is_that_to_the_best_path_of_the_whole_map() -> None:
    topology = map_of(SEALED, merge_distance_m=2.0)
    by_places = hn.load_preset("paper", overrides=["planner.levels=places"])
    hybrid = hn.HybridPlanner(topology, preset=by_places).plan((0.5, 2.5), (8.5, 2.5))
    whole = hn.HybridPlanner(topology, preset="grid-astar").plan((0.5, 2.5), (8.5, 2.5))
    assert hybrid.metric == whole.metric == "octile"
    # Round the box: on its near side no diagonal may cut its corner.
    assert whole.cost == pytest.approx(6 + 3 * math.sqrt(2), abs=1e-12)
    assert whole.lower_bound == whole.cost
    assert whole.gap == 0
    assert hybrid.lower_bound == pytest.approx(whole.cost, rel=1e-9)
    assert hybrid.gap == pytest.approx(hybrid.cost / whole.cost - 1, abs=1e-12)


@tried(50, scenes(max_side=16), seeds, st.sampled_from(["true", "false"]))
def test_routes_paths_and_bounds_are_right_on_random_maps(scene, seed, allow_unexplored):
    grid = scene.grid
    enterable = grid.classes == CellClass.FREE
    if allow_unexplored == "true":
        enterable = grid.classes != CellClass.OCCUPIED
    assume(enterable.any())
    topology = map_of(grid, merge_distance_m=scene.merge_distance_m, seed=scene.seed)
    override = ["planner.levels=places", f"planner.allow_unexplored={allow_unexplored}"]
    kinds = ("route", "joined", "neighbours")
    planner, joined, wider = (
        hn.HybridPlanner(
            topology, preset=hn.load_preset("paper", overrides=[*override, f"planner.corridor={k}"])
        )
        for k in kinds
    )
    component, graph = components(enterable), move_graph(enterable)
    rng = np.random.default_rng(seed)
    for _ in range(4):
        start, goal = map(tuple, rng.choice(np.argwhere(enterable), size=2).tolist())
        endpoints = centre(grid, start), centre(grid, goal)
        result = planner.plan(*endpoints)
        assert result.solved is bool(component[start] == component[goal])
        if not result.solved:
            assert result.status is hn.PlanStatus.NO_PATH
            assert not wider.plan(*endpoints).solved
            continue
        optimum = distances(graph, grid.shape, start)[goal] * grid.resolution_m
        middle, wide = joined.plan(*endpoints), wider.plan(*endpoints)
        assert result.path is not None
        assert middle.path is not None
        assert wide.path is not None
        assert result.route is not None
        assert result.route == middle.route == wide.route
        check_route(result.route, topology, enterable)
        on_route = np.isin(np.arange(topology.n_places), result.route.places)
        nearby = on_route.copy()
        nearby[topology.arcs[on_route[topology.arcs].any(axis=1)]] = True
        fields = topology.level.field_of
        inside = corridor_of(
            topology, list(result.route.places), allow_unexplored=allow_unexplored == "true"
        )
        twice = np.isin(np.arange(topology.n_places), inside)
        check_path(result.path, grid, enterable, on_route[fields] & (fields >= 0))
        check_path(middle.path, grid, enterable, twice[fields] & (fields >= 0))
        check_path(wide.path, grid, enterable, nearby[fields] & (fields >= 0))
        assert result.stats.corridor_cells == (on_route[fields] & (fields >= 0)).sum()
        assert result.lower_bound - 1e-9 <= optimum <= wide.cost + 1e-9
        assert wide.cost <= middle.cost + 1e-9
        assert middle.cost <= result.cost + 1e-9


def check_route(route: hn.Route, topology: hn.TopologicalMap, enterable: Any) -> None:
    """The route is the cheapest one, and of parallel arcs it takes the nearest.

    Place and arc ids of a new map are its dense indices.
    """
    level, places = topology.level, route.places
    arcs, through_m = topology.arcs.tolist(), level.through_m.tolist()
    graph: nx.MultiGraph[int] = nx.MultiGraph()
    graph.add_nodes_from(range(topology.n_places))
    for arc, (u, v) in enumerate(arcs):
        if enterable[tuple(level.cells[u])] and enterable[tuple(level.cells[v])]:
            graph.add_edge(u, v, key=arc, weight=float(level.max_distance_m[arc]))
    cheapest = nx.dijkstra_path_length(graph, places[0], places[-1])
    cost = sum(float(level.max_distance_m[arc]) for arc in route.arcs)
    assert cost == pytest.approx(cheapest, rel=1e-12)
    for arc, pair in zip(route.arcs, itertools.pairwise(places), strict=True):
        assert sorted(arcs[arc]) == sorted(pair)
        assert through_m[arc] == min(through_m[other] for other in graph[pair[0]][pair[1]])


def check_path(path: hn.Path, grid: hn.OccupancyGrid, enterable: Any, corridor: Any) -> None:
    assert_legal(path.cells, enterable, corridor)
    start, goal = map(tuple, path.cells[[0, -1]].tolist())
    best = distances(move_graph(enterable, corridor), enterable.shape, start)[goal]
    assert recounted(path.cells) == pytest.approx(best, rel=0, abs=1e-9)
    assert path.length_m == pytest.approx(best * grid.resolution_m, rel=1e-12)


def test_of_two_doors_between_two_rooms_the_nearer_one_is_taken() -> None:
    taken = set()
    for flip, seed in itertools.product((1, -1), range(12)):
        classes = np.ascontiguousarray(TWO_DOORS[::flip])
        topology = map_of(classes, merge_distance_m=math.inf, seed=seed)
        level = topology.level
        assert topology.n_places == 2
        assert topology.n_arcs == 2
        assert level.max_distance_m[0] == level.max_distance_m[1]
        grid = topology.grid
        planner = hn.HybridPlanner(topology, preset=WITH_UNEXPLORED)
        endpoints = centre(grid, (3, 0)), centre(grid, (3, 8))
        for start, goal in (endpoints, endpoints[::-1]):
            route = planner.plan(start, goal).raise_for_status().route
            assert level.through_m[route.arcs[0]] == level.through_m.min()
            if level.through_m[0] != level.through_m[1]:
                taken.add(route.arcs)
    # Either arc was the nearer one at least once.
    assert taken == {(0,), (1,)}


def test_the_two_regions_of_figure_1_meet_along_two_arcs() -> None:
    topology = map_of(
        hn.load_map(MAPS / "figure1" / "figure1.yaml", robot_radius_m=0), merge_distance_m=math.inf
    )
    planner = hn.HybridPlanner(topology, preset=WITH_UNEXPLORED)
    result = planner.plan((0.15, 1.5), (3.85, 1.5)).raise_for_status()
    (arc,) = result.route.arcs
    parallel = (np.sort(topology.arcs) == np.sort(topology.arcs[arc])).all(axis=1)
    assert parallel.sum() == 2
    assert topology.level.through_m[arc] == topology.level.through_m[parallel].min()


@pytest.fixture(scope="module")
def office() -> hn.TopologicalMap:
    return map_of(hn.load_map(MAPS / "office" / "office.yaml", robot_radius_m=0.25))


def test_in_the_office_a_wider_corridor_is_never_longer_and_the_grid_is_shortest(office):
    grid = office.grid
    near = hn.load_preset("paper", overrides=["planner.corridor=neighbours"])
    planners = [hn.HybridPlanner(office, preset=preset) for preset in ("grid-astar", near, "paper")]
    enterable = grid.classes == CellClass.FREE
    component = components(enterable)
    rng = np.random.default_rng(3)
    solved = 0
    for pair in rng.choice(np.argwhere(enterable), size=(40, 2)):
        results = [planner.plan(*grid.frame.points_of(pair)) for planner in planners]
        connected = component[tuple(pair[0])] == component[tuple(pair[1])]
        assert {result.solved for result in results} == {bool(connected)}
        if connected:
            solved += 1
            costs = [result.cost for result in results]
            assert costs[0] - 1e-9 <= costs[1] <= costs[2] + 1e-9
            assert all(result.lower_bound <= costs[0] + 1e-9 for result in results)
    assert solved > 20


def test_in_the_office_the_sealed_archive_is_not_reached(office: hn.TopologicalMap) -> None:
    planner = hn.HybridPlanner(office)
    assert planner.plan((1.0, 13.2), (15.8, 14.5)).status is hn.PlanStatus.NO_PATH
    assert planner.plan((1.0, 13.2), (40.6, 19.4)).solved


def test_a_preset_is_a_name_a_file_or_an_object(tmp_path: Path) -> None:
    topology, endpoints = map_of(SEALED, merge_distance_m=2.0), ((0.5, 2.5), (8.5, 2.5))
    file = tmp_path / "mine.yaml"
    file.write_text("planner: {method: grid-astar}\n")
    whole = hn.HybridPlanner(topology, preset="grid-astar").plan(*endpoints)
    for preset in (file, str(file), hn.load_preset(file)):
        result = hn.HybridPlanner(topology, preset=preset).plan(*endpoints)
        assert result.settings["preset"] == "mine"
        assert result.cost == whole.cost
    assert hn.HybridPlanner(topology).preset.name == "shortest"
    with pytest.raises(hn.errors.PresetNotFoundError, match="no preset is called 'papers'"):
        hn.HybridPlanner(topology, preset="papers")


def test_a_result_records_how_the_pyramid_was_built_and_not_what_the_preset_says() -> None:
    grid = hn.OccupancyGrid(np.zeros((5, 9), dtype=np.float32), robot_radius_m=0.5)
    planner = hn.HybridPlanner(map_of(grid, merge_distance_m=3.0, seed=7), preset="paper")
    assert planner.preset.pyramid.merge_distance_m == 4.0
    for goal in ((8.5, 0.5), (-1.0, 0.0)):
        settings = planner.plan((0.5, 0.5), goal).settings
        assert settings["preset"] == "paper"
        assert settings["planner"] == planner.preset.planner.model_dump()
        assert settings["pyramid"] == {
            "merge_distance_m": 3.0,
            "linkage": "throats",
            "seed": 7,
            "robot_radius_m": 0.5,
        }


@pytest.mark.parametrize(
    "build",
    [
        {"merge_distance_m": 3.0},
        {"merge_distance_m": math.inf},
        {"merge_distance_m": np.float32(3.0), "seed": np.int64(5)},
    ],
)
@pytest.mark.parametrize("goal", [(8.5, 0.5), (3.5, 2.5), (99.0, 0.0)])
@pytest.mark.parametrize(
    ("preset", "seconds"), [("paper", {"descent"}), ("grid-astar", {"refine"})]
)
def test_a_result_is_json(build, goal, preset, seconds):
    result = hn.HybridPlanner(map_of(SEALED, **build), preset=preset).plan((0.5, 0.5), goal)
    # Neither NaN nor Infinity: they are no JSON, and strict readers refuse them.
    read = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    keys = {"status", "metric", "length_m", "places", "arcs", "points", "expanded", "seconds"}
    assert keys <= set(read)
    assert read["status"] == str(result.status)
    assert read["metric"] == "octile"
    assert (read["start"], read["goal"]) == ([0.5, 0.5], list(goal))
    assert (
        read["settings"]["pyramid"]["robot_radius_m"]
        == result.settings["pyramid"]["robot_radius_m"]
    )
    if result.path is None:
        assert read["headings_rad"] is None
        assert read["length_m"] is read["places"] is read["arcs"] is read["points"] is None
        return
    assert read["length_m"] == result.path.length_m
    assert read["points"] == pytest.approx(result.path.points, abs=1e-6)
    assert read["places"] == list(result.route.places)
    assert read["arcs"] == list(result.route.arcs)
    assert read["headings_rad"] == pytest.approx(result.path.headings_at_points, abs=1e-6)
    assert (read["cost"], read["lower_bound"]) == (result.cost, result.lower_bound)
    assert read["expanded"] == result.stats.expanded > 0
    assert set(read["seconds"]) == seconds


def test_numbers_of_numpy_give_the_answers_of_plain_ones() -> None:
    answers = []
    kinds: tuple[Any, ...] = (float, np.float32)
    for number in kinds:
        frame = hn.Frame(resolution_m=number(0.0625), origin_m=(number(0.5), number(0.0)))
        grid = hn.OccupancyGrid(
            np.zeros((5, 9), dtype=np.float32), frame=frame, robot_radius_m=number(0.25)
        )
        result = hn.HybridPlanner(map_of(grid)).plan((0.51, 0.01), (1.0, 0.2))
        answers.append(without_seconds(result))
        json.dumps(result.to_dict(), allow_nan=False)
    assert answers[0] == answers[1]


def test_results_are_values_that_nobody_can_change() -> None:
    planner = hn.HybridPlanner(map_of(SEALED))
    result = planner.plan((0.5, 0.5), (8.5, 0.5))
    assert result.route is not None
    for value, name in ((result, "status"), (result.path, "length_m"), (result.route, "arcs")):
        with pytest.raises(dataclasses.FrozenInstanceError):
            setattr(value, name, None)
    for array in (result.path.cells, result.path.points):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    result.settings["pyramid"]["seed"] = 99
    assert planner.plan((0.5, 0.5), (8.5, 0.5)).settings["pyramid"]["seed"] == 0


def test_importing_the_package_loads_neither_numba_nor_matplotlib() -> None:
    program = (
        "import sys, hybridnav, hybridnav.maps.files, hybridnav.planning, hybridnav.maps\n"
        "hybridnav.load_preset('paper'), hybridnav.OccupancyGrid, hybridnav.PlanStatus\n"
        "print(sorted({'numba', 'matplotlib', 'networkx'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_every_public_name_loads_and_others_are_refused() -> None:
    assert set(hn.__all__) <= set(dir(hn))
    for name in hn.__all__:
        thing = getattr(hn, name)
        assert thing.__name__ == (
            f"hybridnav.{name}" if name in {"errors", "ext", "graphs", "harness", "viz"} else name
        )
    with pytest.warns(
        FutureWarning, match=r"^hybridnav\.MapError is now hybridnav\.errors\.MapErr"
    ):
        assert hn.MapError is hn.errors.MapError  # type: ignore[attr-defined]
    with pytest.warns(
        FutureWarning, match=r"^hybridnav\.load_graph is now hybridnav\.ext\.fleet\."
    ):
        assert hn.load_graph is hn.ext.fleet.load_graph  # type: ignore[attr-defined]
    with pytest.raises(AttributeError, match="module hybridnav has no attribute Planner"):
        hn.Planner  # type: ignore[attr-defined]  # noqa: B018
