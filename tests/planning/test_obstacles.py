"""Closures are obstacles, off which the robot keeps its radius, unless they are `keepout`."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import hybridnav as hn
from tests.plans import map_of
from tests.strategies import examples

RADIUS_M, CELL_M = 0.3, 0.1
PALLET = (2.0, 0.9, 3.0, 2.1)
"""x_min, y_min, x_max, y_max, along the sides of cells."""
START, GOAL = (0.55, 1.55), (4.55, 1.55)
BY_COSTS = ("grid-astar", "robot", "paper")


@pytest.fixture(scope="module")
def hall() -> hn.TopologicalMap:
    grid = hn.OccupancyGrid(
        np.zeros((30, 50), np.float32), hn.Frame(CELL_M), robot_radius_m=RADIUS_M
    )
    return map_of(grid)


def pallet_cells(grid: hn.OccupancyGrid) -> Any:
    cells = np.zeros(grid.shape, np.bool_)
    cells[9:21, 20:30] = True
    return cells


def distance_m(result: hn.PlanResult) -> float:
    """How far from the pallet the robot's centre passes it."""
    line = shapely.LineString(result.path.poses(0.02)[:, :2])
    return float(shapely.distance(line, shapely.box(*PALLET)))


def by_file(kind: str, folder: Path, grid: hn.OccupancyGrid) -> Path:
    """The pallet as GeoJSON, as an image, or as a mask of map_server."""
    image = np.where(pallet_cells(grid)[::-1], 0, 254).astype(np.uint8)
    Image.fromarray(image).save(folder / "mask.png")
    (folder / "mask.yaml").write_text(
        f"{{image: mask.png, resolution: {CELL_M}, origin: [0, 0, 0], negate: 0, "
        "free_thresh: 0.196, occupied_thresh: 0.65}"
    )
    geometry = shapely.to_geojson(shapely.box(*PALLET))
    (folder / "mask.geojson").write_text(geometry)
    return folder / f"mask.{kind}"


@pytest.mark.parametrize("kind", ["geojson", "png", "yaml"])
@pytest.mark.parametrize("preset", ["shortest", "octile", "grid-astar", "paper"])
def test_closed_areas_of_files_are_obstacles_unless_they_are_keepout(hall, kind, preset, tmp_path):
    path = by_file(kind, tmp_path, hall.grid)
    planner = hn.HybridPlanner(hall, preset=preset)
    pallet = planner.plan(START, GOAL, blocked=hn.load_blocked(path, hall.grid))
    # Cells are closed by their centres, as occupied ones are: at the radius less half a cell.
    assert distance_m(pallet) >= RADIUS_M - CELL_M / 2 - 1e-9
    zone = planner.plan(START, GOAL, blocked=hn.load_blocked(path, hall.grid, keepout=True))
    assert distance_m(zone) <= CELL_M / 2 + 1e-9


def test_areas_say_in_python_which_they_are(hall: hn.TopologicalMap) -> None:
    planner, box = hn.HybridPlanner(hall), shapely.box(*PALLET)
    assert distance_m(planner.plan(START, GOAL, blocked=box)) >= RADIUS_M - 1e-9
    assert distance_m(planner.plan(START, GOAL, blocked={"keepout": [box]})) < 1e-9
    both = hn.Blocked(keepout=[box]) | hn.Blocked(polygons=[box])
    assert distance_m(planner.plan(START, GOAL, blocked=both)) >= RADIUS_M - 1e-9
    as_any: Any = box
    with pytest.raises(hn.errors.InvalidValueError, match="keepout must be a sequence of areas"):
        hn.Blocked(keepout=as_any)
    with pytest.raises(hn.errors.InvalidValueError, match="must meet the map"):
        planner.plan(START, GOAL, blocked={"keepout": [shapely.box(8, 8, 9, 9)]})


@pytest.mark.parametrize("preset", BY_COSTS)
@pytest.mark.parametrize("by_update", [False, True])
def test_closed_cells_of_costs_are_obstacles_unless_they_are_keepout(hall, preset, *, by_update):
    """Given at once, or by an update of the area of the pallet alone."""
    cells, plain = pallet_cells(hall.grid), np.ones(hall.grid.shape, np.float32)
    for obstacle in (True, False):
        layer = hn.CostLayer(plain, cells) if obstacle else hn.CostLayer(plain, keepout=cells)
        planner = hn.HybridPlanner(
            hall, preset=preset, costs=hn.CostLayer(plain) if by_update else layer
        )
        before = planner.plan(START, GOAL).cost
        if by_update:
            planner.prepare()
            planner.update(costs=layer, changed=PALLET)
        away_m = distance_m(planner.plan(START, GOAL))
        assert (away_m >= RADIUS_M - CELL_M / 2 - 1e-9) == obstacle
        if by_update:
            planner.update(costs=hn.CostLayer(plain), changed=PALLET)
            assert planner.plan(START, GOAL).cost == pytest.approx(before)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=examples(60), deadline=None, derandomize=True)
def test_updates_of_areas_close_what_a_new_planner_closes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = tuple(rng.integers(2, 14, 2).tolist())
    grid = hn.OccupancyGrid(
        np.zeros(shape, np.float32), hn.Frame(), robot_radius_m=float(rng.choice([0, 1, 2.5]))
    )
    topology = map_of(grid)

    def drawn() -> tuple[Any, Any, Any]:
        return rng.choice([1.0, 2.0], shape), rng.random(shape) < 0.06, rng.random(shape) < 0.06

    whole = list(drawn())
    for cells in whole[1:]:
        cells[:] = cells & (rng.random() < 0.7)
    planner = hn.HybridPlanner(
        topology, preset="grid-astar", costs=hn.CostLayer(whole[0], whole[1], keepout=whole[2])
    )
    for _ in range(3):
        changed = drawn()
        low = [int(rng.integers(n)) for n in shape]
        high = [int(rng.integers(at, n)) + 1 for at, n in zip(low, shape, strict=True)]
        area = np.zeros(shape, np.bool_)
        area[low[0] : high[0], low[1] : high[1]] = True
        for mine, now in zip(whole, changed, strict=True):
            mine[area] = now[area]
        given = hn.CostLayer(changed[0], changed[1], keepout=changed[2])
        planner.update(costs=given, changed=area)
        found: Any = planner.costs
        expected = whole[2].copy()
        for row, col in np.argwhere(whole[1]).tolist():
            for at in np.ndindex(*shape):
                expected[at] |= math.dist(at, (row, col)) <= grid.robot_radius_m
        np.testing.assert_array_equal(found.closed_flat, np.flatnonzero(expected))
        np.testing.assert_array_equal(found.factors, whole[0])


def test_the_number_of_a_gap_is_no_door(office: hn.TopologicalMap) -> None:
    rooms = office.rooms
    gap = next(door for door in rooms.doors if door.is_gap)
    planner = hn.HybridPlanner(office)
    for number in (gap.number, 9999):
        with pytest.raises(
            hn.errors.InvalidValueError, match=f"no door has the number {number}"
        ) as caught:
            planner.plan((1.5, 2.0), (27.0, 14.5), blocked={"doors": [number]})
        assert "\n" not in str(caught.value)
        known = str(caught.value).split("the doors are ")[1].split(";")[0]
        numbers = [
            number
            for run in known.split(", ")
            for number in range(int(run.split("-")[0]), int(run.split("-")[-1]) + 1)
        ]
        assert numbers == [door.number for door in rooms.doors if not door.is_gap]
    assert planner.plan((1.5, 2.0), (27.0, 14.5), blocked=gap).solved


@pytest.fixture(scope="module")
def office() -> hn.TopologicalMap:
    grid = hn.example_map("office")
    return map_of(grid, rooms=hn.find_rooms(grid))


def test_the_command_says_and_does_which(cli: Any, tmp_path: Path, hall: hn.TopologicalMap) -> None:
    hn.write_ros_map(hall.grid, tmp_path / "hall.yaml")
    by_file("png", tmp_path, hall.grid)
    ends = ("--start", "0.55,1.55", "--goal", "4.55,1.55")
    query = (
        "plan",
        tmp_path / "hall.yaml",
        "--robot-radius",
        RADIUS_M,
        "--json",
        *ends,
        "--blocked",
    )
    for ending in ("png", "yaml", "geojson"):
        lengths = []
        for kind in ("", "keepout:"):
            done = cli(*query, f"{kind}{tmp_path / f'mask.{ending}'}")
            assert (done.code, done.answer["status"]) == (0, "solved")
            line = shapely.LineString(done.answer["points"])
            away_m = float(shapely.distance(line, shapely.box(*PALLET)))
            assert (away_m >= RADIUS_M - CELL_M / 2 - 1e-9) == (not kind)
            lengths.append(done.answer["length_m"])
        assert lengths[0] > lengths[1]
    assert json.loads(done.out)["blocked"][0].startswith("keepout:")
