"""Exploration: what the robot knows at the end, where it drove, and that it ends."""

import itertools
import math
from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from scipy import ndimage

import hybridnav as hn
from benchmarks.subjects.explore import missed_cells, narrow_world, widest_point
from hybridnav.ext.live.explore import By, Exploration, Goals, Step, explore, laser_all_round
from hybridnav.ext.live.explore.goals import doubtful_spots, narrow_spots
from hybridnav.ext.live.explore.robot import Robot
from hybridnav.ext.live.mapping import SimulatedLaser
from tests.strategies import seeds, tried

START = (1.0, 1.0)


def flat(*, yaw_rad: float = 0.0, radius_m: float = 0.2) -> hn.OccupancyGrid:
    """Four rooms along a corridor, a cupboard, a room without a door, and unknown ground."""
    cells = np.zeros((66, 100), dtype=np.float32)
    cells[[0, 1, -2, -1]] = cells[:, [0, 1, -2, -1]] = 1.0
    cells[24:26, 2:80] = cells[40:42, 2:80] = 1.0
    cells[42:64, 40:42] = cells[2:24, 30:32] = 1.0
    cells[24:26, [*range(10, 20), *range(60, 70)]] = 0.0
    cells[40:42, [*range(20, 30), *range(50, 60)]] = 0.0
    cells[10:12, 50:60] = cells[50:64, 80:82] = cells[50:52, 80:98] = 1.0
    cells[52:64, 82:98] = np.nan
    return hn.OccupancyGrid(
        cells, hn.Frame(0.1, (-1.0, 0.0), yaw_rad), robot_radius_m=radius_m, name="flat"
    )


@pytest.fixture(scope="module")
def explored() -> Exploration:
    """What a robot made of the flat."""
    return explore(flat(), START)


def test_everything_that_the_robot_can_reach_is_known(explored: Exploration) -> None:
    assert explored.is_complete
    assert (explored.share_known, explored.n_given_up) == (1.0, 0)
    world, made = flat(), explored.grid
    cells = np.argwhere(np.isfinite(world.probability))
    at = made.frame.cells_of(world.frame.points_of(cells))
    inside = ((at >= 0) & (at < made.shape)).all(axis=1)
    there = made.measured[tuple(at[inside].T)]
    truth = world.measured[tuple(cells[inside].T)]
    walls = world.measured != hn.CellClass.FREE
    beside = ndimage.binary_dilation(walls, np.ones((3, 3), np.bool_))[tuple(cells[inside].T)]
    known = there != hn.CellClass.UNEXPLORED
    assert (there == truth)[known & ~beside].all()
    assert beside[known & (there != truth)].all()  # readings end on either side of a surface
    assert known[~beside].mean() > 0.8  # the room without a door is not


def test_the_robot_keeps_off_the_walls_and_drives_no_farther_than_it_says(explored):
    plan = flat(radius_m=0.1)  # half the robot's radius: it knows walls to a cell or so
    assert (plan.classes[tuple(plan.frame.cells_of(explored.points).T)] == hn.CellClass.FREE).all()
    steps = np.hypot(*np.diff(explored.points, axis=0).T)
    assert steps.sum() <= explored.driven_m + 1e-6
    assert steps.max() <= 0.5 + 1e-6
    assert explored.points[0].tolist() == list(START)


def test_equal_explorations_make_equal_maps(explored: Exploration) -> None:
    again, other = explore(flat(), START), explore(flat(), START, seed=1)
    assert np.array_equal(explored.grid.probability, again.grid.probability, equal_nan=True)
    assert (again.driven_m, again.n_goals) == (explored.driven_m, explored.n_goals)
    assert not np.array_equal(again.grid.probability, other.grid.probability, equal_nan=True)
    assert other.share_known == 1.0


def test_a_plan_may_be_turned() -> None:
    turned = flat(yaw_rad=0.3)
    x, y = turned.frame.points_of(np.array([10, 20])).tolist()
    done = explore(turned, (x, y))
    assert done.is_complete
    assert done.share_known > 0.99


def test_thresholds_of_the_plan_are_none_of_the_robots_map() -> None:
    # One scan makes no cell as certain as these ask for, and no number of scans a wall.
    plan = replace(flat(), free_threshold=0.01, occupied_threshold=0.99)
    done = explore(plan, START, most_goals=4)
    assert done.share_known > 0.2
    assert (done.grid.measured == hn.CellClass.OCCUPIED).any()


def test_what_no_scan_shows_is_given_up_and_exploration_ends() -> None:
    # Few beams ahead show little of what lies beside the robot.
    blinkered = SimulatedLaser(n_beams=20, start_rad=-0.3, step_rad=0.03, max_range_m=3.0)
    world = np.zeros((24, 30), dtype=np.float32)
    world[[0, -1]] = world[:, [0, -1]] = 1.0
    done = explore(hn.OccupancyGrid(world, hn.Frame(0.2), robot_radius_m=0.2), sensor=blinkered)
    assert done.is_complete
    assert done.n_goals > 0


def test_each_choice_can_be_watched_and_their_number_limited() -> None:
    steps: list[Step] = []
    known: list[int] = []
    done = explore(
        flat(),
        START,
        most_goals=3,
        watch=steps.append,
        progress=lambda share, _: known.append(share),
    )
    assert (done.n_goals, done.is_complete, len(steps)) == (3, False, 3)
    assert known == sorted(known)
    for step in steps:
        beyond = step.goals.beyond[step.chosen]
        assert step.topology.grid.classes[tuple(beyond)] == hn.CellClass.UNEXPLORED
        assert step.goals.costs_m[step.chosen] == step.goals.costs_m.min()
        assert step.topology.classes[step.goals.places[step.chosen]] == hn.CellClass.UNEXPLORED


@pytest.mark.parametrize(
    ("start", "said"),
    [
        ((-0.95, 0.05), "is not in a free cell of the plan"),
        ((99.0, 1.0), "is not in a free cell of the plan"),
        ((math.nan, 1.0), "must be two finite metres"),
        ((8.0, 6.0), "is not in a free cell of the plan"),
    ],
)
def test_a_start_that_is_none_is_refused(start: tuple[float, float], said: str) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match=said):
        explore(flat(), start)


def test_wrong_settings_are_refused() -> None:
    for wrong in (0, 10_001, 1.5, "1"):
        with pytest.raises(
            hn.errors.InvalidValueError, match="most_goals must be a whole number from 1"
        ):
            explore(flat(), START, most_goals=wrong)  # type: ignore[arg-type]
    for wrong in (-1, 0.5, "a"):
        with pytest.raises(hn.errors.InvalidValueError, match="seed must be a whole number from 0"):
            explore(flat(), START, seed=wrong)  # type: ignore[arg-type]
    with pytest.raises(hn.errors.InvalidValueError, match="the start must be two finite metres"):
        explore(flat(), "door")  # type: ignore[arg-type]
    full = hn.OccupancyGrid(np.ones((4, 4), np.float32), robot_radius_m=0)
    with pytest.raises(hn.errors.InvalidValueError, match="is not in a free cell"):
        explore(full)


@tried(60, seeds)
def test_goals_are_the_unexplored_places_beside_cells_in_reach(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = rng.choice([0.0, 0.5, 1.0], p=[0.6, 0.2, 0.2], size=(9, 9)).astype(np.float32)
    cells[4, 4] = 0.0
    grid = hn.OccupancyGrid(cells, hn.Frame(0.5), robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.5))
    goals = Goals.of(topology, (4, 4), np.zeros(grid.shape, dtype=np.bool_))
    graph: nx.Graph[tuple[int, int]] = nx.Graph()
    free = {(r, c) for r, c in np.argwhere(cells == 0).tolist()}
    graph.add_nodes_from(free)
    for r, c in free:
        for dr, dc in ((0, 1), (1, 0), (1, 1), (1, -1)):
            if {(r + dr, c + dc), (r + dr, c), (r, c + dc)} <= free:
                graph.add_edge((r, c), (r + dr, c + dc), weight=0.5 * math.hypot(dr, dc))
    lengths = nx.single_source_dijkstra_path_length(graph, (4, 4))
    expected: dict[int, float] = {}
    sizes: dict[int, int] = {}
    for r, c in np.argwhere(cells == 0.5).tolist():
        place = topology.place_at((r, c))
        for beside in ((r + 1, c), (r - 1, c), (r, c + 1), (r, c - 1)):
            if beside in lengths:
                expected[place] = min(expected.get(place, math.inf), lengths[beside])
                sizes[place] = sizes.get(place, 0) + 1
    assert goals.places.tolist() == sorted(expected)
    assert goals.costs_m == pytest.approx([expected[place] for place in sorted(expected)])
    assert goals.sizes.tolist() == [sizes[place] for place in sorted(expected)]
    assert (np.abs(goals.cells - goals.beyond).sum(axis=1) == 1).all()


def test_doubtful_cells_that_close_a_door_are_a_reason_to_look_again() -> None:
    # A known room, a wall whose door in row 3 a wrong echo closes, and unexplored ground.
    cells = np.zeros((7, 9), dtype=np.float32)
    cells[:, 4], cells[:, 6:] = 1.0, np.nan
    cells[3, 4] = 0.8
    grid = hn.OccupancyGrid(cells, hn.Frame(0.5), robot_radius_m=0)
    assert doubtful_spots(grid, (0, 0)).tolist() == [[3, 3]]
    cells[3, 4] = 0.95
    sure = hn.OccupancyGrid(cells, hn.Frame(0.5), robot_radius_m=0)
    assert doubtful_spots(sure, (0, 0)).tolist() == []
    cells[3, 4], cells[:, 6:] = 0.8, 1.0
    nothing_beyond = hn.OccupancyGrid(cells, hn.Frame(0.5), robot_radius_m=0)
    assert doubtful_spots(nothing_beyond, (0, 0)).tolist() == []


def test_a_gap_that_only_a_thinner_robot_could_pass_is_a_reason_to_look_again() -> None:
    # Two known rooms; the robot's radius, 1.5 cells, closes the door of two cells between them.
    cells = np.zeros((12, 20), dtype=np.float32)
    cells[:, 9], cells[5:7, 9] = 1.0, 0.0
    cells[:, 17:] = np.nan
    grid = hn.OccupancyGrid(cells, hn.Frame(0.5), robot_radius_m=0.75)
    (spot,) = narrow_spots(grid, (5, 2)).tolist()
    assert spot in ([5, 7], [6, 7])
    for radius_m in (1.3, 0.4):  # no gap, even if it were a cell thinner; and it passes
        assert narrow_spots(replace(grid, robot_radius_m=radius_m), (5, 2)).tolist() == []
    cells[:, 17:] = 1.0
    nothing_beyond = hn.OccupancyGrid(cells, hn.Frame(0.5), robot_radius_m=0.75)
    assert narrow_spots(nothing_beyond, (5, 2)).tolist() == []


def test_unexplored_ground_a_cell_out_of_reach_is_a_reason_to_look_again() -> None:
    # A door of seven cells, and a wrong one beside it: the robot stays a cell off what lies beyond.
    cells = np.zeros((24, 24), dtype=np.float32)
    cells[:, 10], cells[:, :10] = 1.0, np.nan
    cells[9:15, 10], cells[15, 11] = np.nan, 1.0
    grid = hn.OccupancyGrid(cells, hn.Frame(0.5), robot_radius_m=1.6285)
    assert narrow_spots(grid, (12, 20)).tolist() == [[11, 12]]
    cells[:, :7] = 1.0  # now there is less beyond than the robot covers
    assert narrow_spots(replace(grid, probability=cells), (12, 20)).tolist() == []


def test_each_gap_is_a_reason_to_look_again_although_others_lead_to_the_same_room() -> None:
    # Two known rooms, and two doors that the robot's radius closes: see above.
    cells = np.zeros((30, 20), dtype=np.float32)
    cells[:, 9], cells[[5, 6, 22, 23], 9] = 1.0, 0.0
    cells[:, 17:] = np.nan
    grid = hn.OccupancyGrid(cells, hn.Frame(0.5), robot_radius_m=0.75)
    first, second = narrow_spots(grid, (5, 2)).tolist()
    assert first in ([5, 7], [6, 7])
    assert second in ([22, 7], [23, 7])


@pytest.mark.parametrize("seed", range(6))
def test_a_robot_with_a_noisy_laser_knows_all_in_the_end(seed: int) -> None:
    noisy = laser_all_round(noise_m=0.05)
    done = explore(flat(radius_m=0.35), START, sensor=noisy, seed=seed)
    assert done.is_complete
    assert done.share_known == 1.0


def test_a_robot_that_its_map_has_shut_in_drives_back_the_way_it_came() -> None:
    cells = np.ones((30, 80), dtype=np.float32)
    cells[2:-2, 2:38] = cells[2:-2, 42:-2] = cells[10:20, 38:42] = 0.0
    plan = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0.2)
    robot = Robot(plan, (1.0, 1.5), laser_all_round(max_range_m=3.0), seed=0)
    assert not robot.go_back()  # it has driven nowhere
    while robot.pose[0] < 5.0:
        goals = robot.look()
        robot.visit(goals, int(goals.costs_m.argmin()), arrives=True)
    driven_m = robot.driven_m
    robot.look()
    known = robot.topology.grid
    x_m, y_m = known.frame.points_of(np.argwhere(np.ones(known.shape, np.bool_))).T
    shut = known.probability.copy()
    shut[((x_m > 3.8) & (x_m < 4.2)).reshape(shut.shape)] = 1.0
    left = (x_m < 3.8).reshape(shut.shape)
    assert not robot.go_back()  # all goals are in its part of the map
    shut[left & (y_m > 2.4).reshape(shut.shape)] = np.nan
    shut[~left & (known.classes == hn.CellClass.UNEXPLORED)] = 1.0
    closed = replace(known, probability=shut)
    robot.topology = hn.TopologicalMap(hn.DualGraphPyramid.build(closed))
    assert robot.go_back()
    assert robot.pose[0] < 3.8
    assert robot.driven_m > driven_m + 1.0


def test_a_robot_that_finishes_rooms_stays_while_goals_are_left() -> None:
    steps: list[Step] = []
    done = explore(flat(), START, by="room", watch=steps.append)
    assert done.is_complete
    assert done.share_known == 1.0
    farther = [
        step for step in steps if step.chosen >= 0 and step.goals.costs_m.argmin() != step.chosen
    ]
    assert farther
    one_of = "by must be one of path, frontier, room, got 'luck'"
    with pytest.raises(hn.errors.InvalidValueError, match=one_of):
        explore(flat(), START, by="luck")  # type: ignore[arg-type]


def test_a_robot_that_drives_to_each_frontier_drives_farther() -> None:
    driven_m: dict[By, float] = defaultdict(float)
    for seed in range(4):
        steps: list[Step] = []
        rankings: tuple[By, ...] = ("path", "frontier")
        for by in rankings:
            steps.clear()
            done = explore(flat(), START, by=by, seed=seed, watch=steps.append)
            assert (done.is_complete, done.share_known) == (True, 1.0)
            driven_m[by] += done.driven_m
        for before, after in itertools.pairwise(steps[:-1]):
            if before.chosen >= 0:
                goal = before.topology.grid.frame.points_of(before.goals.cells[before.chosen])
                assert after.pose[:2] == pytest.approx(tuple(goal), abs=1e-6)
    assert driven_m["frontier"] > driven_m["path"]


def test_a_door_at_the_side_of_the_map_is_a_frontier() -> None:
    """No scan meets a cell beyond the door, so it lies in the first column of the map."""
    cells = np.ones((24, 60), dtype=np.float32)
    cells[2:-2, 2:28] = cells[2:-2, 32:-2] = cells[10:16, 28:32] = 0.0
    plan = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0.2)
    short = laser_all_round(max_range_m=0.6, noise_m=0.0)
    done = explore(plan, (4.5, 1.25), sensor=short)
    assert done.share_known == 1.0


@pytest.mark.parametrize("seed", range(6))
def test_a_robot_comes_through_doors_that_are_hardly_wider(seed: int) -> None:
    world = narrow_world(seed, resolution_m=0.05)
    start = widest_point(world)
    done = explore(world, start, seed=seed)
    assert done.is_complete
    assert missed_cells(world, done.grid, start) == 0


@pytest.mark.parametrize("seed", range(3))
def test_a_robot_looks_again_at_doors_that_its_map_has_closed(seed: int) -> None:
    world = narrow_world(2, resolution_m=0.05)
    assert explore(world, widest_point(world), seed=seed).n_looks_again > 0


@pytest.mark.full
@pytest.mark.parametrize("resolution_m", [0.1, 0.05])
def test_no_world_of_many_keeps_a_cell_unknown(resolution_m: float) -> None:
    for seed in range(100):
        world = narrow_world(seed, resolution_m=resolution_m)
        start = widest_point(world)
        done = explore(world, start, seed=seed)
        assert missed_cells(world, done.grid, start) == 0, seed


MAPS = Path(__file__).parents[4] / "maps"
MADE = MAPS / "office-explored" / "office-explored.yaml"
RADIUS_M = 0.25


@pytest.mark.full
def test_the_committed_map_is_what_the_robot_makes(cli: Any, tmp_path: Path) -> None:
    office, again = MAPS / "office" / "office.yaml", tmp_path / "office-explored.yaml"
    options = ("--robot-radius", RADIUS_M, "--start", "6,17.2", "-o", again)
    assert cli("explore", office, *options).code == 0
    made, committed = (hn.load_map(file, robot_radius_m=RADIUS_M) for file in (again, MADE))
    assert made.frame == committed.frame
    assert np.array_equal(made.probability, committed.probability, equal_nan=True)


@pytest.mark.full
def test_noise_that_closes_a_gap_behind_the_robot_does_not_end_it() -> None:
    office = hn.example_map("office", robot_radius_m=RADIUS_M)
    done = explore(office, (6.0, 17.2), by="frontier")  # it drives in between two shelves
    assert done.share_known == 1.0


def test_the_explored_office_agrees_with_the_office_off_its_walls() -> None:
    made = hn.load_map(MADE, robot_radius_m=0)
    office = hn.example_map("office", robot_radius_m=RADIUS_M)
    walls = np.where(office.measured == hn.CellClass.FREE, np.float32(0.0), np.float32(1.0))
    plan = replace(office, probability=walls)  # to the robot, what is not free is a wall
    free = np.argwhere(plan.classes == hn.CellClass.FREE)  # no wall within the radius
    rows, cols = made.frame.cells_of(office.frame.points_of(free)).T
    inside = (rows >= 0) & (cols >= 0) & (rows < made.shape[0]) & (cols < made.shape[1])
    found = made.measured[rows[inside], cols[inside]]
    assert (found == hn.CellClass.OCCUPIED).sum() == 0
    assert (found == hn.CellClass.FREE).sum() > 0.98 * len(free)
