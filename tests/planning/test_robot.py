"""The preset `robot`: arcs that a differential robot can follow, inside free space, hardly dearer
than the line that they round, with a bound on all paths."""

import csv
import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import segment_faults
from hybridnav.maps.costs import cost_along
from tests._base.test_poses import path_of
from tests.layers import grid_of, layer_of
from tests.planning.test_costs import optimum_m, scene, topology_of
from tests.strategies import class_grids, occupancy_grid, seeds, tried

OFFICE = Path(__file__).parents[2] / "maps" / "office" / "office.yaml"


def arc_steps(path: hn.Path) -> Any:
    assert path.headings_rad is not None
    turned = np.abs(np.angle(np.exp(1j * np.diff(path.headings_rad)))) > 1e-6
    still = (np.diff(path.points, axis=0) == 0).all(axis=1)
    return turned & ~still, turned & still


def near_costs(grid: hn.OccupancyGrid, layer: Any, line: Any, radius_m: float) -> Any:
    """Bounds on the cost of a line whose arcs are priced along chords of a quarter of a cell.

    Each point of a chord lies within the rise of the arc above it, c^2 / 8 r, of a point of the
    arc, and the chord is at most so much shorter: by a tenth where it is as long as the radius.
    """
    chord_m = 0.25 * grid.resolution_m
    rise_m = min(chord_m**2 / (8 * radius_m), chord_m / 2) + 1e-3 * grid.resolution_m
    lengths_m = np.hypot(*np.diff(line, axis=0).T)
    middles = (line[1:] + line[:-1]) / 2
    last = np.array(grid.shape) - 1
    near = []
    for offset in itertools.product((-1, 0, 1), repeat=2):
        cells = grid.frame.cells_of(middles + rise_m * np.array(offset)).clip(0, last)
        near.append(layer.factors[tuple(cells.T)])
    turned = min(chord_m / radius_m, np.pi)
    shorter = np.sin(turned / 2) / (turned / 2)
    return lengths_m @ np.min(near, axis=0) * shorter, lengths_m @ np.max(near, axis=0)


def check(grid: hn.OccupancyGrid, is_open: Any, path: hn.Path, radius_m: float) -> None:
    """The path stays in free space, its arcs are wide enough, its headings are those of travel."""
    arcs, spots = arc_steps(path)
    assert path.headings_rad is not None
    assert path.max_curvature_per_m <= (1 + 1e-5) / radius_m
    np.testing.assert_array_equal(path.spot_turns, np.flatnonzero(spots))
    steps = np.diff(path.points, axis=0)
    straight = ~arcs & (np.hypot(*steps.T) > 1e-3)
    along = np.arctan2(steps[straight, 1], steps[straight, 0])
    off = np.angle(np.exp(1j * (along - path.headings_rad[:-1][straight])))
    assert np.abs(off).max(initial=0) < 1e-3
    shut = occupancy_grid(
        np.where(is_open, hn.CellClass.FREE, hn.CellClass.OCCUPIED).astype(np.uint8),
        resolution_m=grid.resolution_m,
    )
    for i in np.flatnonzero(~arcs & ~spots):
        assert segment_faults(shut, path.points[i : i + 2]) == ()
    for i in np.flatnonzero(arcs):
        piece = path_of(path.points[i : i + 2], path.headings_rad[i : i + 2], is_curved=True)
        cells = grid.frame.cells_of(piece.poses(grid.resolution_m / 100)[:, :2])
        assert is_open[tuple(cells.T)].all()


@tried(100, class_grids(max_side=24), seeds, st.booleans(), st.sampled_from([0.1, 0.5, 2.0]))
def test_arcs_stay_in_free_space_and_near_the_cost_of_the_line(classes, seed, off_centre, radius_m):
    grid, layer, is_open, start, goal, rng = scene(classes, seed)
    preset = hn.load_preset("grid-astar", overrides=[f"planner.turning_radius_m={radius_m}"])
    planner = hn.HybridPlanner(topology_of(grid), preset=preset, costs=layer)
    ends = grid.frame.points_of([start, goal])
    if off_centre:
        ends = ends + rng.uniform(-0.24, 0.24, (2, 2))
    cells = planner.plan(*ends, smooth="none")
    line = planner.plan(*ends, smooth="line-of-sight")
    result = planner.plan(*ends, smooth="arcs")
    assert result.status == cells.status
    if result.path is None or cells.path is None:
        return
    assert result.metric == "any-angle-weighted"
    assert (result.path.points[[0, -1]] == ends[[0, -1]]).all() or start == goal
    over_cells = np.concatenate([ends[:1], cells.path.points[1:-1], ends[1:]])
    assert line.cost <= cost_along(grid, layer, over_cells) + 1e-6
    assert result.cost <= line.cost * 1.005 + 1e-6
    assert result.cost >= result.path.length_m * (1 - 1e-9)
    poses = result.path.poses(grid.resolution_m / 200)[:, :2]
    low, high = near_costs(grid, layer, poses, radius_m)
    assert low * (1 - 1e-4) - 1e-6 <= result.cost <= high * (1 + 1e-4) + 1e-6
    least = optimum_m(grid, layer, is_open, start)[goal]
    assert result.grid_bound == line.grid_bound == pytest.approx(least, rel=1e-9, abs=1e-9)
    if not off_centre:
        assert line.grid_gap <= 1e-9
    assert result.lower_bound <= line.cost * (1 + 1e-9)
    if len(result.path.points) > 1:
        check(grid, is_open, result.path, radius_m)


def test_bends_in_the_open_are_arcs() -> None:
    probability = np.zeros((100, 100))
    probability[:60, 50] = 1.0  # a wall, round the end of which the path leads
    grid = grid_of(probability, hn.Frame(0.05), robot_radius_m=0.25)
    planner = hn.HybridPlanner(topology_of(grid), preset="robot")
    result = planner.plan((1.0, 1.0), (4.0, 1.0))
    assert len(result.path.spot_turns) == 0
    poses = result.path.poses()
    assert np.hypot(*np.diff(poses[:, :2], axis=0).T).max() <= 0.05 + 1e-9
    turns = np.abs(np.angle(np.exp(1j * np.diff(poses[:, 2]))))
    assert turns.max() <= 0.05 / 0.3 + 1e-6
    assert turns.sum() == pytest.approx(np.pi, abs=0.8)


def test_where_no_arc_fits_the_robot_turns_on_the_spot() -> None:
    probability = np.ones((12, 12))
    probability[1, 1:11] = probability[1:11, 10] = 0.0  # a corridor one cell wide
    grid = grid_of(probability, hn.Frame(1.0), robot_radius_m=0)
    preset = hn.load_preset("robot", overrides=["planner.turning_radius_m=2"])
    planner = hn.HybridPlanner(topology_of(grid), preset=preset)
    result = planner.plan((1.5, 1.5), (10.5, 10.5))
    spots = result.path.spot_turns
    assert len(spots) == 1
    assert result.path.max_curvature_per_m == 0
    turn = result.path.points[spots[0] : spots[0] + 2]
    assert turn[0].tolist() == turn[1].tolist()
    assert grid.frame.cell_of(*turn[0].tolist()) in {(1, 10), (2, 10), (1, 9)}
    poses = result.path.poses()
    assert (np.diff(poses[:, :2], axis=0) == 0).all(axis=1).sum() == 1  # two headings at one point
    assert len(np.unique(poses[:, 2].round(6))) == 2


def test_robot_is_no_dearer_than_the_cheapest_path_of_cells_on_the_office() -> None:
    grid = hn.load_map(OFFICE, robot_radius_m=0.25)
    topology = topology_of(grid)
    robot = hn.HybridPlanner(topology, preset="robot")
    exact = hn.HybridPlanner(topology, preset="grid-astar", costs=hn.CostLayer.clearance(grid))
    rng = np.random.default_rng(3)
    free = np.argwhere(grid.enterable())
    spots = bends = 0
    for pair in free[rng.integers(len(free), size=(40, 2))]:
        ends = grid.frame.points_of(pair)
        result, least = robot.plan(*ends), exact.plan(*ends)
        assert result.solved == least.solved
        if result.path is None:
            continue
        assert result.lower_bound <= least.cost * (1 + 1e-9)
        assert result.cost <= least.cost
        assert result.gap <= 0.2
        assert result.path.max_curvature_per_m <= 1 / 0.3 + 1e-4
        spots += len(result.path.spot_turns)
        bends += int(arc_steps(result.path)[0].sum())
    assert spots < 0.02 * bends


def test_no_share_of_the_path_of_cells_bounds_paths_between_posts() -> None:
    """A straight line between posts in two rows: paths over corners of cells bound it."""
    probability = np.zeros((2, 42))
    probability[1, 2::4] = probability[0, 4::4] = 1.0
    grid = grid_of(probability, hn.Frame(1.0), robot_radius_m=0)
    costs = layer_of(np.ones(grid.shape))
    topology, ends = topology_of(grid), ((0.5, 0.5), (41.5, 0.5))
    line = hn.HybridPlanner(topology, preset="shortest").plan(*ends)
    planner = hn.HybridPlanner(topology, preset="grid-astar", costs=costs)
    cells = planner.plan(*ends, smooth="none")
    assert (round(line.cost, 1), cells.cost, cells.lower_bound) == (41.2, 61.0, 61.0)
    smooth = planner.plan(*ends, smooth="line-of-sight")
    assert smooth.lower_bound <= line.cost <= smooth.cost < cells.cost
    assert smooth.gap < 0.1


def test_lengths_know_no_arcs() -> None:
    planner = hn.HybridPlanner(topology_of(hn.example_map("figure1")), preset="octile")
    with pytest.raises(hn.errors.InvalidValueError, match="rounds bends of paths by costs"):
        planner.plan((0.5, 0.5), (2.0, 2.5), smooth="arcs")
    with pytest.raises(hn.errors.PresetError, match=r"planner\.smooth: should be 'none' or"):
        hn.load_preset("octile", overrides=["planner.smooth=arcs"])
    with pytest.raises(hn.errors.PresetError, match="turning_radius_m"):
        hn.load_preset("robot", overrides=["planner.turning_radius_m=0"])


def written(cli: Any, file: Path, *query: str) -> str:
    assert cli(*query, "--poses", str(file)).code == 0
    return file.read_text(encoding="utf-8")


@pytest.mark.parametrize("ending", ["csv", "json"])
def test_the_command_line_writes_poses(cli: Any, tmp_path: Path, ending: str) -> None:
    file = tmp_path / f"poses.{ending}"
    query = ("plan", str(OFFICE), "--preset", "robot", "--start", "1.5,2.0", "--goal", "27.0,14.5")
    done = cli(*query, "--poses", str(file), "--json")
    assert done.code == 0
    figures = json.loads(done.out)
    assert figures["lower_bound"] <= figures["cost"] <= figures["lower_bound"] * 1.2
    if ending == "csv":
        with file.open(encoding="utf-8") as opened:
            names, *rows = list(csv.reader(opened))
    else:
        answer = json.loads(file.read_text(encoding="utf-8"))
        names, rows = answer["names"], answer["poses"]
    assert names == ["x", "y", "yaw", "direction", "speed_m_s", "time_s"]
    poses = np.array(rows, dtype=float)
    speed, time = poses[:, 4], poses[:, 5]
    assert (speed[0], speed[-1], time[0]) == (0, 0, 0)
    assert time[-1] == pytest.approx(figures["duration_s"], abs=1e-3)
    # Between two poses the mean of two speeds of a ramp, and not less, is driven on average.
    driven = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert (driven <= np.maximum(speed[1:], speed[:-1]) * np.diff(time) + 0.01).all()
    assert driven.sum() == pytest.approx(figures["length_m"], rel=0.01)
    assert poses[0, :2].tolist() == [1.5, 2.0]
    assert poses[-1, :2].tolist() == [27.0, 14.5]
    assert np.hypot(*np.diff(poses[:, :2], axis=0).T).max() <= 0.05 + 1e-5
    (line,) = json.loads(written(cli, tmp_path / "line.geojson", *query))["features"]
    assert [len(line["properties"][name]) for name in names[4:]] == [len(rows)] * 2
    tour = json.loads(written(cli, tmp_path / "tour.json", *query, "--via", "27.5,14.5"))["poses"]
    times = [row[5] for row in tour]
    assert times == sorted(times)
    assert times[-1] > time[-1]
    refused = cli(*query, "--poses", str(tmp_path / "poses.txt"))
    assert refused.code == 2
    assert "--poses must end in .csv, .json" in refused.err
