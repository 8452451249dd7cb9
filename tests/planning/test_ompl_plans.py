"""OMPL refinement: drivable paths inside the corridor, in time, reported honestly."""

import itertools
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

import hybridnav as hn
from benchmarks.worlds import office_world
from hybridnav.harness.judges import VisibilityGraph, segment_faults
from hybridnav.planning import load_preset
from hybridnav.search.found import Query
from tests.oracle.long_robot import CORNERS, Walls
from tests.oracle.long_robot import rooms as rooms_with_doors
from tests.strategies import drawn, full_but, occupancy_grid

pytest.importorskip("ompl")

PLANNERS = ["RRTConnect", "RRTstar", "InformedRRTstar", "BITstar", "PRMstar"]
CONFINED = [("RRTConnect", "chain"), ("BITstar", "chain"), ("BITstar", "mask"), ("PRMstar", "mask")]
SPACES = [
    *(("se2", planner) for planner in PLANNERS),
    *(("dubins", planner) for planner in ("RRTConnect", "BITstar")),
    *(("reeds-shepp", planner) for planner in PLANNERS if planner != "InformedRRTstar"),
]
SOME_SPACES = [
    *(("se2", planner) for planner in ("RRTConnect", "PRMstar")),
    ("dubins", "BITstar"),
    ("reeds-shepp", "RRTConnect"),
]
ENDS = (1.0, 13.2), (40.6, 19.4)
ROBOT = str([list(corner) for corner in CORNERS])


@pytest.fixture(scope="module")
def office() -> hn.TopologicalMap:
    return hn.TopologicalMap(hn.DualGraphPyramid.build(office_world().grid(robot_radius_m=0.25)))


@pytest.fixture(scope="module")
def rooms() -> hn.TopologicalMap:
    """Rooms with doors of 0.9 m, for a robot of 0.6 x 1.8 m."""
    return hn.TopologicalMap(hn.DualGraphPyramid.build(rooms_with_doors()))


@pytest.fixture(scope="module")
def planner_of(office: hn.TopologicalMap) -> Iterator[Any]:
    made: dict[Any, hn.HybridPlanner] = {}

    def make(name: str, *settings: str, topology: Any = None) -> hn.HybridPlanner:
        key = (name, settings, id(topology))
        if key not in made:
            preset = load_preset(name, overrides=[f"planner.ompl.{text}" for text in settings])
            made[key] = hn.HybridPlanner(topology or office, preset=preset)
        return made[key]

    yield make
    made.clear()


@pytest.mark.parametrize("name", PLANNERS)
def test_every_planner_solves_the_office_near_the_optimum(planner_of: Any, name: str) -> None:
    planner = planner_of("ompl", f"planner={name}")
    result = planner.plan(*ENDS)
    grid = planner.grid
    start, goal = (grid.frame.cell_of(*end) for end in ENDS)
    centres = grid.frame.points_of(np.array([start, goal]))
    exact = VisibilityGraph(grid).shortest(start, goal).length_m
    slack = np.hypot(*(np.array(ENDS) - centres).T).sum()
    assert result.status is hn.PlanStatus.SOLVED
    assert not result.refinement.by_grid
    assert result.metric == "any-angle"
    assert segment_faults(grid, result.path.points) == ()
    np.testing.assert_allclose(result.path.points[[0, -1]], ENDS, atol=1e-9)
    steps = np.diff(result.path.points, axis=0)
    assert result.cost == pytest.approx(np.hypot(*steps.T).sum(), rel=1e-9)
    assert exact - slack <= result.cost <= 1.02 * exact + slack
    # Between the points themselves nothing is shorter than the shortest path of a disc.
    shortest = hn.HybridPlanner(planner.topology).plan(*ENDS)
    assert result.lower_bound == pytest.approx(shortest.cost, rel=1e-9)
    assert result.route is not None


@pytest.mark.parametrize(("planner", "confine"), full_but(CONFINED[:3], CONFINED))
def test_states_and_paths_stay_in_the_corridor(planner: str, confine: str) -> None:
    grid = field_of_pillars()
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    settings = f"{{planner: {planner}, confine: {confine}, simplify: false}}"
    preset = load_preset("ompl", overrides=[f"planner.ompl={settings}"])
    made = hn.HybridPlanner(topology, preset=preset)
    inner: Any = made._now.ompl
    endpoints = grid.frame.points_of(np.array([(3, 3), (56, 76)]))
    coarse = made.method.find(Query(((3, 3), (56, 76)), (endpoints[0], endpoints[1])))
    poses = tuple(np.append(end, 0.0) for end in endpoints)
    found = inner.plan(coarse.cells, (poses[0], poses[1]), None, tells_search=True)
    assert found.refinement.steps[-1].startswith("corridor: solved")
    field_of = topology.level.field_of
    fields = np.unique(field_of[coarse.cells[:, 0], coarse.cells[:, 1]])
    assert len(fields) < len(np.unique(field_of[field_of >= 0]))
    legs = itertools.pairwise(found.path.points)
    dense = np.concatenate([np.linspace(first, second, 50) for first, second in legs])
    sampled = np.array(found.search.states)
    # This holds for all valid states of the search, not only for the path's.
    assert len(sampled) > 5
    for points in (sampled, dense):
        # A point on a side belongs to both its cells.
        around = [
            grid.frame.cells_of(points + shift)
            for shift in 1e-7 * np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
        ]
        inside = np.any([np.isin(field_of[c[:, 0], c[:, 1]], fields) for c in around], axis=0)
        assert inside.all()


def field_of_pillars() -> hn.OccupancyGrid:
    """Pillars that leave no long line of sight, so that every leg must be searched."""
    occupied = np.zeros((60, 80), dtype=np.float32)
    occupied[2::6, 3::6] = occupied[5::6, ::6] = 1
    occupied[3::6, 3::6] = occupied[2::6, 4::6] = 1
    occupied[3, 3] = occupied[56, 76] = 0
    return hn.OccupancyGrid(occupied, hn.Frame(0.25), robot_radius_m=0)


def zigzag() -> hn.OccupancyGrid:
    """Forty aisles with gaps at alternate ends: too many for a sampler in 10 ms."""
    occupied = np.zeros((161, 120), dtype=np.float32)
    occupied[4::8, :118] = occupied[8:-1:8, 2:] = 1
    return hn.OccupancyGrid(occupied, hn.Frame(0.25), robot_radius_m=0)


def test_where_time_is_short_the_grid_path_takes_over_and_says_so(planner_of: Any) -> None:
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(zigzag()))
    settings = ("planner=RRTstar", "budget_s=0.01", "confine=mask")
    made = planner_of("ompl", *settings, topology=topology)
    frame = made.topology.grid.frame
    result = made.plan(*frame.points_of(np.array([[0, 60], [160, 60]])))
    assert result.status is hn.PlanStatus.SOLVED
    assert result.refinement.by_grid
    assert result.refinement.steps[-1] == "grid path by line of sight: solved"
    assert segment_faults(made.topology.grid, result.path.points) == ()
    assert "steps" in result.to_dict()


def test_equal_seeds_give_equal_paths_when_iterations_are_counted(planner_of: Any) -> None:
    for planner in ("RRTConnect", "BITstar"):
        settings = (f"planner={planner}", "iterations=2000", "budget_s=60")
        made = planner_of("ompl", *settings)
        first, second = (made.plan(*ENDS).path.points for _ in range(2))
        other = planner_of("ompl", *settings, "seed=7").plan(*ENDS).path.points
        np.testing.assert_array_equal(first, second)
        assert first.shape != other.shape or not np.array_equal(first, other)


def test_the_whole_map_and_the_places_are_corridors_too(office):
    for coarse in ("grid-astar", "paper"):
        preset = load_preset("ompl", overrides=[f"planner.along={coarse}"])
        result = hn.HybridPlanner(office, preset=preset).plan(*ENDS)
        assert result.solved
        assert segment_faults(office.grid, result.path.points) == ()
        assert result.route is not None


def test_near_and_equal_ends(planner_of: Any) -> None:
    made = planner_of("ompl")
    same = made.plan(ENDS[0], ENDS[0])
    assert (same.status, same.cost, same.gap) == (hn.PlanStatus.SOLVED, 0.0, 0.0)
    near = made.plan(ENDS[0], (1.01, 13.21))
    assert near.cost == pytest.approx(math.dist(ENDS[0], (1.01, 13.21)))


def test_closed_cells_are_gone_round(planner_of: Any) -> None:
    made = planner_of("ompl")
    free = made.plan(*ENDS)
    x, y = free.path.points[len(free.path.points) // 2]
    block = shapely.Point(x, y).buffer(0.3)
    result = made.plan(*ENDS, blocked=block)
    assert result.solved
    assert not shapely.LineString(result.path.points).intersects(block.buffer(-0.1))


@pytest.mark.parametrize(("space", "planner"), full_but(SOME_SPACES, SPACES))
def test_a_long_robot_goes_through_doors_without_touching(rooms, space, planner):
    made = long_robot(rooms, space, f"planner: {planner}, budget_s: 4")
    start, goal = (2.0, 3.0, 0.5), (17.0, 9.0, 1.0)
    result = made.plan(start, goal)
    assert result.status is hn.PlanStatus.SOLVED
    assert not result.refinement.by_grid
    path: Any = result.path
    assert result.metric == ("any-angle" if space == "se2" else space)
    poses = np.column_stack([path.points, path.headings_rad])
    np.testing.assert_allclose(poses[0], start, atol=1e-6)
    np.testing.assert_allclose(poses[-1][:2], goal[:2], atol=1e-6)
    assert math.remainder(poses[-1][2] - goal[2], math.tau) == pytest.approx(0, abs=1e-6)
    assert Walls(rooms.grid).touched(poses, curved=space != "se2") == 0
    assert math.dist(start[:2], goal[:2]) - 1e-12 <= result.lower_bound <= result.cost


def long_robot(rooms: hn.TopologicalMap, space: str, settings: str) -> hn.HybridPlanner:
    radius = "" if space == "se2" else ", turning_radius_m: 0.8"
    section = f"{{space: {space}, footprint: '{ROBOT}', {settings}{radius}}}"
    preset = load_preset("ompl", overrides=[f"planner.ompl={section}"])
    return hn.HybridPlanner(rooms, preset=preset)


def test_poses_are_refused_where_the_robot_does_not_fit(rooms: hn.TopologicalMap) -> None:
    made = long_robot(rooms, "se2", "budget_s: 1")
    goal = (17.0, 9.0, 1.0)
    assert made.plan((0.5, 3.0, 0.0), goal).status is hn.PlanStatus.START_OCCUPIED
    refused = made.plan(goal, (0.5, 3.0, 0.0))
    assert refused.status is hn.PlanStatus.GOAL_OCCUPIED
    assert refused.reason.startswith("The goal leaves no room for the footprint with this heading.")
    shut = made.plan(goal, (2.0, 3.0, 0.0), blocked=shapely.box(1.2, 2.9, 1.3, 3.1))
    assert (shut.status.value, shut.reason[:25]) == ("goal blocked", "The goal leaves no room f")
    with pytest.raises(hn.errors.InvalidValueError, match="start must be three finite numbers"):
        made.plan((2.0, 3.0), goal)
    with pytest.raises(hn.errors.InvalidValueError, match=r"goals .* poses .* shape \(n, 3\)"):
        made.plan_many([goal], [(2.0, 3.0)])
    starts = [(2.0, 3.0, 0.5), (0.5, 3.0, 0.0), (2.0, 3.0, 0.5)]
    batch = made.plan_many(starts, [goal, goal, (3.0, 3.0, 0.0)])
    assert batch.status.tolist() == ["solved", "start occupied", "solved"]
    assert batch.headings_rad is not None
    assert len(batch.headings_rad) == len(batch.points) == batch.path_start[-1]
    np.testing.assert_allclose(batch.headings_rad[[0, -1]], (0.5, 0.0), atol=1e-6)


def test_a_map_inflated_by_more_than_the_robot_is_refused() -> None:
    grid = hn.OccupancyGrid(np.zeros((40, 40), np.float32), hn.Frame(0.1), robot_radius_m=0.4)
    with pytest.raises(
        hn.errors.OmplError, match=r"by 0.4 m, .* of 0.3 m: .* \(--robot-radius 0.3\)"
    ):
        long_robot(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), "se2", "budget_s: 1")


def test_parameters_that_ompl_does_not_take_are_refused(office: hn.TopologicalMap) -> None:
    for planner, parameters, words in (
        ("RRTstar", "informed_sampling: true, focus_search: false", "not take informed_sampling"),
        ("BITstar", "use_strict_queue_ordering: false", "not take use_strict_queue_ordering"),
    ):
        settings = f"{{planner: {planner}, parameters: {{{parameters}}}}}"
        preset = load_preset("ompl", overrides=[f"planner.ompl={settings}"])
        with pytest.raises(hn.errors.OmplError, match=words):
            hn.HybridPlanner(office, preset=preset)


def test_an_approximate_path_is_never_reported_as_solved(rooms: hn.TopologicalMap) -> None:
    """A robot 1 m wide fits into the rooms and through no door; a disc inside it does."""
    wide = "[[0.5, 0.3], [-0.5, 0.3], [-0.5, -0.7], [0.5, -0.7]]"
    preset = load_preset(
        "ompl", overrides=[f"planner.ompl={{space: se2, footprint: '{wide}', budget_s: 0.4}}"]
    )
    result = hn.HybridPlanner(rooms, preset=preset).plan((3.0, 3.0, 0.0), (17.0, 9.0, 0.0))
    assert result.status in {hn.PlanStatus.APPROXIMATE, hn.PlanStatus.TIMEOUT}
    assert not result.solved
    assert (result.cost, math.isnan(result.gap)) == (math.inf, True)
    assert [step.partition(":")[0] for step in result.refinement.steps] == [
        "circumscribed disc",
        "corridor",
        "widened corridor",
        "grid path by line of sight",
    ]
    with pytest.raises(hn.errors.HybridNavError, match="no path was planned"):
        result.raise_for_status()


def test_on_small_random_maps_paths_are_legal_and_not_below_the_optimum() -> None:
    rng = np.random.default_rng(3)
    preset = load_preset("ompl", overrides=["planner.ompl.budget_s=2"])
    for yaw_rad in (0.0, 0.7):
        occupied = (rng.random((24, 30)) < 0.25).astype(np.float32)
        frame = hn.Frame(0.1, (3.0, -2.0), yaw_rad)
        grid = hn.OccupancyGrid(occupied, frame, robot_radius_m=0)
        made = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), preset=preset)
        exact = VisibilityGraph(grid)
        free = np.argwhere(grid.classes == hn.CellClass.FREE)
        for start, goal in rng.choice(free, (12, 2)).tolist():
            endpoints = grid.frame.points_of(np.array([start, goal]))
            result = made.plan(*endpoints)
            optimum = exact.shortest(tuple(start), tuple(goal)).length_m
            assert result.solved == math.isfinite(optimum)
            if result.path is not None:
                assert segment_faults(grid, result.path.points) == ()
                assert result.lower_bound * (1 - 1e-9) <= optimum <= result.cost * (1 + 1e-9)


def test_without_ompl_all_else_works_and_the_preset_says_what_to_install(tmp_path: Path) -> None:
    code = """
import sys, importlib.machinery
class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] == "ompl":
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Missing())
import importlib.util
real = importlib.util.find_spec
importlib.util.find_spec = lambda name, package=None: name != "ompl" and real(name, package) or None
import numpy as np, hybridnav as hn
grid = hn.OccupancyGrid(np.zeros((8, 8)))
topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
assert hn.HybridPlanner(topology).plan((1, 1), (6, 6)).solved
try:
    hn.HybridPlanner(topology, preset="ompl")
except hn.errors.OmplError as error:
    print(error)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert "pip install 'ompl" in done.stdout
    assert done.stdout.count("\n") == 1


@pytest.mark.full
def test_two_thousand_plans_leak_and_hang_nowhere(planner_of, office):
    made = planner_of("ompl", "budget_s=0.25")
    pids = (os.getpid(), made._now.ompl._worker._running.process.pid)
    rng = np.random.default_rng(0)
    free = np.argwhere(office.grid.classes == hn.CellClass.FREE)

    def resident() -> int:
        return sum(int(Path(f"/proc/{pid}/statm").read_text().split()[1]) for pid in pids) * 4096

    for number, (start, goal) in enumerate(rng.choice(free, (2000, 2))):
        made.plan(*office.grid.frame.points_of(np.array([start, goal])))
        if number == 100:
            before = resident()
    assert resident() - before < 50e6


def test_drawn_maps_without_a_way_have_no_path() -> None:
    grid = occupancy_grid(drawn("....#....", "....#....", "....#...."))
    made = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), preset="ompl")
    assert made.plan((0.5, 0.5), (8.5, 0.5)).status is hn.PlanStatus.NO_PATH


def test_words_and_route_are_those_of_the_path_that_ompl_found() -> None:
    """The coarse route takes the narrow door, which the robot cannot turn into."""
    free = np.zeros((60, 122), dtype=np.bool_)
    free[2:58, 50:60] = free[2:58, 62:120] = True
    free[14:20, 60:62] = free[32:56, 60:62] = True
    labels = np.where(np.arange(122) <= 60, 0, 1) * np.ones((60, 1), dtype=np.int32)
    grid = hn.OccupancyGrid((~free).astype(np.float32), hn.Frame(0.1), robot_radius_m=0.25)
    rooms = hn.RoomLabels(("left", "right"), labels.astype(np.int32))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0, rooms=rooms))
    robot = "[[0.6, 0.25], [-0.6, 0.25], [-0.6, -0.25], [0.6, -0.25]]"
    settings = f"{{space: se2, footprint: '{robot}', budget_s: 5}}"
    preset = load_preset("ompl", overrides=[f"planner.ompl={settings}"])
    made = hn.HybridPlanner(topology, preset=preset)
    tour = hn.plan_tour(made, [(5.5, 2.2, 1.57), (7.5, 2.4, 1.57)])
    result = tour.results[0]
    assert result.refinement.steps[-1] == "widened corridor: solved"
    path: Any = result.path
    (side,) = np.flatnonzero(np.diff(np.sign(path.points[:, 0] - 6.1)))
    (x0, y0), (x1, y1) = path.points[side : side + 2]
    at = y0 + (6.1 - x0) / (x1 - x0) * (y1 - y0)
    rows = path.cells[np.isin(path.cells[:, 1], (60, 61)), 0]
    assert np.abs((rows + 0.5) * 0.1 - at).max() < 0.3
    assert (np.abs(np.diff(path.cells, axis=0)).max(axis=1) == 1).all()
    (door,) = [leg.door for leg in tour.legs if leg.door is not None]
    narrow, wide = topology.rooms.doors
    assert (narrow.width_m, wide.width_m) == pytest.approx((0.6, 2.4))
    assert 3.2 < at < 5.6
    assert door == wide


def test_a_heading_of_half_a_turn_is_a_heading_like_others(rooms: hn.TopologicalMap) -> None:
    made = long_robot(rooms, "se2", "planner: RRTConnect, budget_s: 2")
    result = made.plan((3.0, 3.0, math.pi), (17.0, 9.0, -math.pi))
    assert result.solved
    assert not result.refinement.by_grid


@pytest.mark.parametrize(
    ("space", "start", "goal", "length_m"),
    [
        # ompl 2.0.1, ReedsSheppStateSpace(1.0).distance: 0.1198; the drive is straight.
        (
            "reeds-shepp",
            (7.504825444741101, -48.82733977525046, -1.8285586069051707),
            (7.517480921786202, -48.77933451578215, -1.8285586069051707),
            0.0496454029680323,
        ),
        # ompl 2.0.1, DubinsStateSpace(1.0).distance: 0.19796880276413198; own points were 6.48 m.
        (
            "dubins",
            (26.01560671128445, 31.674434869113384, -2.388290507987202),
            (25.885503756946083, 31.525649666643357, -2.190321705223072),
            0.19796880276413,
        ),
    ],
)
def test_cost_and_bound_of_short_curves_are_those_of_their_points(space, start, goal, length_m):
    origin_m = (math.floor(start[0]) - 10, math.floor(start[1]) - 10)
    empty = hn.OccupancyGrid(np.zeros((40, 40), np.float32), hn.Frame(0.5, origin_m=origin_m))
    overrides = [f"planner.ompl.space={space}", "planner.ompl.turning_radius_m=1.0"]
    preset = load_preset("ompl", overrides=overrides)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(empty))
    result = hn.HybridPlanner(topology, preset=preset).plan(start, goal)
    assert result.cost == pytest.approx(length_m, abs=1e-9)
    assert result.cost == pytest.approx(result.path._motion.lengths_m.sum(), abs=1e-9)
    assert math.dist(start[:2], goal[:2]) - 1e-12 <= result.lower_bound <= result.cost
