"""Masks and costmap filters of Nav2: every mode, other frames and resolutions, in every preset."""

import cmath
import math
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import example
from hypothesis import strategies as st
from PIL import Image

import hybridnav as hn
from hybridnav.harness.judges import segment_faults
from hybridnav.maps.costs import filter_costs
from hybridnav.maps.files.ros import read_mask
from tests.layers import grid_of
from tests.strategies import seeds, tried

GREYS = [0, 50, 89, 90, 100, 101, 128, 204, 205, 206, 254, 255]


def mask_file(folder: Path, mode: str, **changes: Any) -> Path:
    """A mask of one row of greys, cells of 1 m."""
    (folder / "mask.pgm").write_bytes(b"P5 %d 1 255 " % len(GREYS) + bytes(GREYS))
    values = {
        "image": "mask.pgm",
        "mode": mode,
        "resolution": 1.0,
        "origin": "[0, 0, 0]",
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    } | changes
    path = folder / "mask.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in values.items()))
    return path


def values_by_nav2(mode: str) -> list[int]:
    """nav2_map_server/map_io.cpp: occupancy 1 - grey / 255, then by mode."""
    found = []
    for grey in GREYS:
        occupancy = (255 - grey) / 255
        if mode == "raw":
            found.append(grey if grey <= 100 else -1)
        elif occupancy >= 0.65:
            found.append(100)
        elif occupancy <= 0.196:
            found.append(0)
        elif mode == "scale":
            found.append(math.floor((occupancy - 0.196) / (0.65 - 0.196) * 100 + 0.5))
        else:
            found.append(-1)
    return found


@pytest.mark.parametrize("mode", ["raw", "scale", "trinary"])
def test_values_are_those_of_map_server(tmp_path: Path, mode: str) -> None:
    values, frame = read_mask(mask_file(tmp_path, mode), max_cells=100)
    assert values.tolist() == [values_by_nav2(mode)]
    assert frame == hn.Frame(1.0)


def test_mode_scale_spreads_over_0_to_100_and_rounds_half_away(tmp_path: Path) -> None:
    # Printed by the code of nav2_map_server/src/map_io.cpp (jazzy), Eigen 3.4.0.
    path = mask_file(tmp_path, "scale", free_thresh=0.0, occupied_thresh=1.0)
    expected = [100, 80, 65, 65, 61, 60, 50, 20, 20, 19, 0, 0]
    assert read_mask(path, max_cells=100)[0].tolist() == [expected]
    path = mask_file(tmp_path, "scale", free_thresh=0.25, occupied_thresh=0.75)
    expected = [100, 100, 80, 79, 72, 71, 50, 0, 0, 0, 0, 0]
    assert read_mask(path, max_cells=100)[0].tolist() == [expected]


def test_masks_become_layers_of_the_map(tmp_path: Path) -> None:
    grid = grid_of(np.zeros((2, 24)), hn.Frame(0.5, (0.0, 0.0)), robot_radius_m=0)
    path = mask_file(tmp_path, "raw")
    with pytest.warns(hn.errors.MapWarning, match="value 100 limits nothing"):
        slow = hn.load_speed_mask(path, grid)
    # Values 0, 50, 89, 90 and 100: limits of none, 50, 11, 10 and 0 %, the last one none.
    expected = np.repeat([1, 2, 100 / 11, 10, 1, 1, 1, 1, 1, 1, 1, 1], 2)
    assert np.abs(slow.factors - expected).max() < 2**-14
    zones = hn.load_keepout_mask(path, grid)
    assert zones.keepout.any(axis=0).tolist() == np.repeat(np.array(GREYS) == 100, 2).tolist()


def test_unreadable_masks_are_refused(tmp_path: Path) -> None:
    grid = grid_of(np.zeros((1, 12)), robot_radius_m=0)
    with pytest.raises(hn.errors.MapNotFoundError):
        hn.load_speed_mask(tmp_path / "none.yaml", grid)
    with pytest.raises(hn.errors.MapError, match="mode must be one of"):
        hn.load_keepout_mask(mask_file(tmp_path, "loud"), grid)
    with pytest.raises(hn.errors.MapError, match="cells"):
        hn.load_keepout_mask(mask_file(tmp_path, "raw"), grid, max_cells=5)
    with pytest.raises(hn.errors.InvalidValueError, match="full_speed_mps is needed"):
        hn.load_speed_mask(mask_file(tmp_path, "raw"), grid, unit="m/s")


GRID = grid_of(np.zeros((1, 4)), robot_radius_m=0)
MASK = GRID.to_message("floor") | {"data": [0, -1, 40, 100]}
UNIT = 2.0**-14


def info(kind: Any, base: Any, multiplier: Any) -> Any:
    return SimpleNamespace(type=kind, base=base, multiplier=multiplier, filter_mask_topic="/mask")


@pytest.mark.parametrize(
    ("of", "full", "expected"),
    [
        (info(1, 100.0, -1.0), None, [1, 1, 100 / 60, 1]),  # 40 limits to 60 %, 100 to nothing
        (info(1, 0.0, 1.0), None, [1, 1, 100 / 40, 1]),  # the value is the percentage
        (info(2, 2.0, -0.015), 2.0, [1, 1, 2 / 1.4, 2 / 0.5]),
        (info(0, 0.0, 1.0), None, [1, 1, 1 + 2 * 102 / 252, 1]),  # 40 costs round(101.6)
    ],
)
def test_type_base_and_multiplier_are_read(of: Any, full: Any, expected: list[float]) -> None:
    layer = filter_costs(GRID, of, MASK, full_speed_mps=full)
    assert (np.abs(layer.factors[0] - expected) <= UNIT).all()
    closes = layer.keepout is not None
    assert closes == (of.type == 0)
    if layer.keepout is not None:
        assert layer.keepout.tolist() == [[False, False, False, True]]


@pytest.mark.parametrize(
    ("of", "pose", "words"),
    [
        (info(1, 100.0, -1.0), (0.0, 0.0, 0.0), "filter mask: value 100 limits nothing"),
        (info(1, 50.0, -0.25), (100.0, 0.0, 0.0), "filter mask: no cell of the mask lies on"),
        (info(0, 0.0, 1.0), (100.0, 0.0, 0.0), "filter mask: no cell of the mask lies on"),
    ],
)
def test_messages_warn_as_files_do(of: Any, pose: Any, words: str) -> None:
    with pytest.warns(hn.errors.MapWarning, match=words) as caught:
        filter_costs(GRID, of, MASK, pose=pose)
    assert [each.filename for each in caught] == [__file__]


def test_the_frame_of_the_mask_has_a_pose() -> None:
    # Half a turn about (4, 1): the last cell of the mask lies on the first one of the map.
    layer = filter_costs(GRID, info(0, 0, 1), MASK, pose=(4.0, 1.0, math.pi))
    assert layer.keepout.tolist() == [[True, False, False, False]]


@pytest.mark.parametrize(
    ("of", "words"),
    [
        (info(3, 0, 1), "type must be 0"),
        (info(0.5, 0, 1), "type must be 0"),
        (info(math.nan, 0, 1), "type must be a finite number"),
        (info(0, 100.0, -1.0), "base and multiplier of a keepout filter must be 0 and 1"),
        (info(1, math.inf, 1), "base must be a finite number"),
        (info(1, 1, "1"), "multiplier must be a finite number"),
        (info(2, 1, 1), "full_speed_mps is needed"),
        ({}, "costmap filter info has no field type"),
        (None, "costmap filter info has no field type"),
    ],
)
def test_wrong_infos_are_refused_in_one_line(of: Any, words: str) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match=words):
        filter_costs(GRID, of, MASK)


def test_wrong_masks_are_refused_as_masks() -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="filter mask: data has 1 values"):
        filter_costs(GRID, info(0, 0, 1), MASK | {"data": [0]})


EDGE = 1e-6
"""Cells nearer than this to a border between cells of the mask may be rounded either way."""

angles = st.floats(-math.pi, math.pi)
lengths = st.floats(-3, 3)
sides = st.sampled_from([0.05, 0.1, 0.25, 0.3, 1.0])


def index_in(place: complex, frame: hn.Frame, pose: Any) -> tuple[float, float]:
    """Row and column, as real numbers, of a point of the map frame in a mask: complex numbers."""
    in_mask_frame = (place - complex(*pose[:2])) * cmath.exp(-1j * pose[2])
    in_cells = (in_mask_frame - complex(*frame.origin_m)) * cmath.exp(-1j * frame.yaw_rad)
    return in_cells.imag / frame.resolution_m, in_cells.real / frame.resolution_m


def centre(frame: hn.Frame, row: int, col: int) -> complex:
    turned = complex(col + 0.5, row + 0.5) * frame.resolution_m * cmath.exp(1j * frame.yaw_rad)
    return complex(*frame.origin_m) + turned


def is_near_border(row: float, col: float) -> bool:
    return any(abs(x - round(x)) < EDGE for x in (row, col))


def write_mask(folder: Path, values: Any, frame: hn.Frame) -> Path:
    """A mask in the mode raw: a pixel holds the value, 255 is unknown."""
    pixels = np.where(values < 0, np.int16(255), values).astype(np.uint8)[::-1]
    rows, cols = pixels.shape
    (folder / "mask.pgm").write_bytes(b"P5 %d %d 255 " % (cols, rows) + pixels.tobytes())
    x, y = frame.origin_m
    path = folder / "mask.yaml"
    path.write_text(
        f"image: mask.pgm\nmode: raw\nresolution: {frame.resolution_m}\nnegate: 0\n"
        f"origin: [{x:.17f}, {y:.17f}, {frame.yaw_rad:.17f}]\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


@st.composite
def frames(draw: st.DrawFn) -> hn.Frame:
    return hn.Frame(draw(sides), (draw(lengths), draw(lengths)), draw(angles))


@pytest.mark.filterwarnings("ignore:.*no cell of the mask:hybridnav.errors.MapWarning")
@tried(100, st.data())
def test_the_value_at_the_centre_of_a_cell_counts_wherever_the_mask_lies(tmp_path_factory, data):
    own, frame = data.draw(frames()), data.draw(frames())
    pose = data.draw(st.tuples(lengths, lengths, angles) | st.just((0.0, 0.0, 0.0)))
    rng = np.random.default_rng(data.draw(seeds))
    values = rng.choice([-1, 0, 30, 50, 99, 100], rng.integers(1, 12, 2)).astype(np.int8)
    grid = grid_of(np.zeros(rng.integers(1, 12, 2)), own, robot_radius_m=0)
    path = write_mask(tmp_path_factory.mktemp("mask"), values, frame)
    slow = hn.load_speed_mask(path, grid, pose=pose)
    zones = hn.load_keepout_mask(path, grid, multiplier=4.0, pose=pose)
    closed = np.zeros(grid.shape, bool) if zones.keepout is None else zones.keepout
    may_close = np.zeros(grid.shape, bool)
    unsure = np.zeros(grid.shape, bool)
    for row, col in np.argwhere(values >= 100).tolist():
        place = complex(*pose[:2]) + centre(frame, row, col) * cmath.exp(1j * pose[2])
        at = index_in(place, own, (0.0, 0.0, 0.0))
        cell = math.floor(at[0]), math.floor(at[1])
        if all(0 <= k < n for k, n in zip(cell, grid.shape, strict=True)):
            may_close[cell] = True
            low = np.maximum(np.array(cell) - 1, 0)
            if is_near_border(*at):
                unsure[low[0] : cell[0] + 2, low[1] : cell[1] + 2] = True
    for row, col in np.ndindex(grid.shape):
        at = index_in(centre(own, row, col), frame, pose)
        if is_near_border(*at):
            continue
        cell = math.floor(at[0]), math.floor(at[1])
        inside = all(0 <= k < n for k, n in zip(cell, values.shape, strict=True))
        value = int(values[cell]) if inside else -1
        limit = 100 - value  # the defaults of Nav2's tutorial
        factor = 100 / limit if 0 < value < 100 else 1.0
        assert factor - UNIT <= slow.factors[row, col] <= factor
        cost = math.floor(value * 2.54 + 0.5) if value > 0 else 0
        if not unsure[row, col]:
            assert closed[row, col] == (cost >= 253 or may_close[row, col])
        factor = 1.0 if cost >= 253 else 1 + 4 * cost / 252
        assert factor - UNIT <= zones.factors[row, col] <= factor


@tried(
    300,
    st.integers(-1, 100),
    st.floats(-200, 200),
    st.floats(-3, 3),
    st.sampled_from(["percent", "m/s"]),
    st.floats(0.1, 5),
)
@example(0, 0.0, 2.225073858507203e-309, "percent", 1.0)
def test_limits_are_those_of_the_speed_filter(value, base, multiplier, unit, full):
    """SpeedFilter::process: 0 and unknown limit nothing, base + multiplier * value else; a limit
    below 0, or of more than 100 percent, is dropped, and 0 is no limit."""
    grid = grid_of(np.zeros((1, 1)), robot_radius_m=0)
    speed = None if unit == "percent" else full
    layer = hn.CostLayer.speed_mask(
        grid, [[value]], base=base, multiplier=multiplier, unit=unit, full_speed_mps=speed
    )
    limit = value * multiplier + base if value > 0 else 0.0
    if limit <= 0 or (unit == "percent" and limit > 100):
        expected = 1.0
    else:
        expected = min(max((100 if unit == "percent" else full) / limit, 1.0), 1000.0)
    assert expected - UNIT - 1e-9 <= layer.factors[0, 0] <= expected + 1e-9


def test_a_mask_may_have_another_size_in_the_frame_of_the_map() -> None:
    grid = grid_of(np.zeros((2, 4)), hn.Frame(0.5, (1.0, 1.0)), robot_radius_m=0)
    small = hn.CostLayer.keepout_mask(grid, [[0, 100]], grid.frame)
    assert small.keepout.tolist() == [[False, True, False, False], [False] * 4]
    with pytest.raises(hn.errors.InvalidValueError, match="give the frame of the mask"):
        hn.CostLayer.keepout_mask(grid, [[0, 100]])


@pytest.mark.parametrize("offset", [0.0, 0.1, 0.2, 0.3, 0.4])
def test_no_thin_zone_of_a_fine_mask_is_lost_between_centres(offset: float) -> None:
    """A line of one cell of 0.1 m on a map of cells of 0.5 m."""
    grid = grid_of(np.zeros((4, 4)), hn.Frame(0.5), robot_radius_m=0)
    line = np.zeros((20, 20), np.int8)
    line[:, 5 + round(offset * 10)] = 100
    layer = hn.CostLayer.keepout_mask(grid, line, hn.Frame(0.1))
    assert layer.keepout.tolist() == [[False, True, False, False]] * 4


@pytest.mark.parametrize("pose", [(1.0, 2.0), "abc", (math.nan, 0.0, 0.0), (1e12, 0, 0), None])
def test_wrong_poses_are_refused_in_one_line(tmp_path: Path, pose: Any) -> None:
    grid = grid_of(np.zeros((1, 1)), robot_radius_m=0)
    path = write_mask(tmp_path, np.array([[100]]), hn.Frame())
    for load in (hn.load_keepout_mask, hn.load_speed_mask, hn.load_blocked):
        with pytest.raises(hn.errors.InvalidValueError) as error:
            load(path, grid, pose=pose)
        assert "\n" not in str(error.value)


# A room of 4 x 3 m, a wall with two doorways in it, and a zone in the lower one.
SIDE = 0.1
PLAN = np.zeros((30, 40))
PLAN[:, 20] = 1.0
PLAN[4:9, 20] = 0.0
PLAN[22:27, 20] = 0.0
START, GOAL = (1.05, 0.65), (2.95, 0.65)
POSE = (5.0, -1.0, 0.7)


@pytest.fixture(scope="module")
def floor(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Map, topological map, and the file of a mask in a turned frame whose zone shuts a doorway."""
    grid = hn.OccupancyGrid(PLAN.astype(np.float32), hn.Frame(SIDE), robot_radius_m=0.1)
    away = complex(*POSE[:2])
    corner = (complex(1.82, 0.32) - away) * cmath.exp(-1j * POSE[2])
    frame = hn.Frame(0.05, (corner.real, corner.imag), -POSE[2])
    path = write_mask(tmp_path_factory.mktemp("floor"), np.full((14, 8), 100), frame)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    return grid, topology, path


def shut_of(grid: hn.OccupancyGrid) -> Any:
    """Centres of cells inside the zone, x from 1.82 to 2.22 m, y from 0.32 to 1.02 m."""
    x, y = np.moveaxis(grid.frame.points_of(np.argwhere(np.ones(grid.shape))), -1, 0)
    inside = (x > 1.82) & (x < 2.22) & (y > 0.32) & (y < 1.02)
    return inside.reshape(grid.shape)


def test_the_zone_lies_where_it_was_drawn(floor: Any) -> None:
    grid, _, path = floor
    expected = shut_of(grid)
    assert 20 < expected.sum() < 40
    layer = hn.load_keepout_mask(path, grid, pose=POSE)
    assert layer.keepout is not None
    assert (layer.keepout == expected).all()
    blocked = hn.load_blocked(path, grid, keepout=True, pose=POSE)
    assert (np.asarray(blocked.cells) == np.argwhere(expected)).all()


QUICK = [name for name in hn.preset_names() if name != "ompl"]
SOME_OMPL = ["ompl"]


@pytest.mark.parametrize("preset", QUICK + SOME_OMPL)
def test_every_preset_keeps_out(floor: Any, preset: str) -> None:
    grid, topology, path = floor
    closed = np.where(shut_of(grid), np.uint8(hn.CellClass.OCCUPIED), grid.classes)
    shut = hn.OccupancyGrid(
        (closed != hn.CellClass.FREE).astype(np.float32), grid.frame, robot_radius_m=0
    )
    settings_ = hn.load_preset(preset, overrides=["pyramid.robot_radius_m=0.1"])
    planner = hn.HybridPlanner(topology, preset=settings_)
    plain = planner.plan(START, GOAL)
    around = planner.plan(START, GOAL, blocked=hn.load_blocked(path, grid, keepout=True, pose=POSE))
    planner.close()
    assert plain.path.points[:, 1].max() < 1.2  # by the lower doorway
    assert around.path.points[:, 1].max() > 2.2  # by the upper one
    if not around.path.is_curved:
        assert segment_faults(shut, around.path.points) == ()
    poses = around.path.poses(0.02)
    assert (shut.classes[tuple(grid.frame.cells_of(poses[:, :2]).T)] == hn.CellClass.FREE).all()


@pytest.mark.parametrize("preset", ["robot", "grid-astar", "paper"])
def test_presets_with_costs_take_the_mask_as_costs(floor: Any, preset: str) -> None:
    grid, topology, path = floor
    layer = hn.load_keepout_mask(path, grid, pose=POSE)
    settings_ = hn.load_preset(preset, overrides=["pyramid.robot_radius_m=0.1"])
    result = hn.HybridPlanner(topology, preset=settings_, costs=layer).plan(START, GOAL)
    assert result.path.points[:, 1].max() > 2.2
    cells = grid.frame.cells_of(result.path.poses(0.02)[:, :2])
    assert not shut_of(grid)[tuple(cells.T)].any()


def test_presets_on_lengths_name_the_way_that_they_have(floor: Any) -> None:
    grid, topology, path = floor
    layer = hn.load_keepout_mask(path, grid, pose=POSE)
    with pytest.raises(hn.errors.InvalidValueError, match="closed cells alone go as `blocked`"):
        hn.HybridPlanner(topology, preset="shortest", costs=layer)


def test_a_mask_off_the_map_is_a_warning(floor: Any) -> None:
    grid, _, path = floor
    # Without the pose it lies elsewhere.
    with pytest.warns(hn.errors.MapWarning, match=r"no cell of the mask lies on the map: its"):
        assert hn.load_blocked(path, grid) is not None
    with pytest.warns(hn.errors.MapWarning, match=r"no cell of the mask lies on the map: its"):
        assert hn.load_keepout_mask(path, grid).keepout is None
    with pytest.warns(hn.errors.MapWarning, match=r"no cell of the mask lies on the map: its"):
        assert (hn.load_speed_mask(path, grid).factors == 1).all()


def test_a_mask_of_another_resolution_that_covers_little_says_how_much(tmp_path: Path) -> None:
    grid = grid_of(np.zeros((20, 20)), hn.Frame(1.0, (0.0, 0.0)), robot_radius_m=0)
    path = mask_file(tmp_path, "trinary", resolution=0.7)
    with pytest.warns(hn.errors.MapWarning, match="covers 8 of 400 cells of the map: its cells"):
        hn.load_keepout_mask(path, grid)


def test_value_100_of_a_speed_mask_limits_nothing(tmp_path: Path) -> None:
    # Nav2, main of 2026, nav2_costmap_2d/plugins/costmap_filters/speed_filter.cpp: 100 * -1 + 100
    # is within 0 to 100 %, so 0 is published, which is NO_SPEED_LIMIT in filter_values.hpp.
    grid = grid_of(np.zeros((1, 12)), hn.Frame(1.0, (0.0, 0.0)), robot_radius_m=0)
    with pytest.warns(hn.errors.MapWarning, match="value 100 limits nothing, as in Nav2"):
        layer = hn.load_speed_mask(mask_file(tmp_path, "trinary"), grid)
    assert (layer.factors == 1).all()


def test_a_pose_goes_with_masks_alone(floor: Any, tmp_path: Path) -> None:
    line = tmp_path / "line.geojson"
    line.write_text('{"type": "LineString", "coordinates": [[1, 1], [2, 2]]}')
    with pytest.raises(hn.errors.InvalidValueError, match="goes with a mask of map_server"):
        hn.load_blocked(line, floor[0], pose=POSE)


def test_the_command_takes_masks_in_other_frames(floor: Any, cli: Any, tmp_path: Path) -> None:
    grid, _, path = floor
    hn.write_ros_map(grid, tmp_path / "floor.yaml")
    endpoints = ("--start", "1.05,0.65", "--goal", "2.95,0.65")
    query = ("plan", tmp_path / "floor.yaml", "--robot-radius", "0.1", *endpoints, "--json")
    placed = f"keepout:{path},x=5,y=-1,yaw=0.7"
    straight = cli(*query).answer["length_m"]
    for options in (
        ["--blocked", placed],
        ["--costs", placed],
        ["--preset", "octile", "--blocked", placed],
    ):
        done = cli(*query, *options).answer
        assert done["status"] == "solved"
        assert max(y for _, y in done["points"]) > 2.2
        assert done["length_m"] > straight + 1.9
    assert cli(*query, "--blocked", placed).answer["blocked"] == [placed]
    for option in ("--blocked", "--costs"):
        with warnings.catch_warnings():
            warnings.simplefilter("always")
            done = cli(*query, option, f"keepout:{path}")
        assert "warning: mask" in done.err, option
        assert "no cell of the mask lies on the map: its origin is" in done.err
        assert done.answer["length_m"] == straight


MASKS = {
    "fetch_maps/3_1_16_keepout": "fetch_maps/3_1_16_localization",
    "fetch_maps/4_26_15_keepout": "fetch_maps/4_26_15",
    "fetch_maps/9_16_15_keepout": "fetch_maps/9_16_15",
    "nav2/filter_masks/depot_keepout": "nav2/maps/depot",
    "strands/g4s/g4s_y2_nogo": "strands/g4s/g4s_y2",
    "strands/tsc_y3/tsc20160523_nogo": "strands/tsc_y3/tsc20160523",
}


@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
@pytest.mark.parametrize("mask", MASKS)
def test_masks_that_people_drew_close_their_cells(data: Path, mask: str) -> None:
    """By Pillow and index arithmetic: the masks have the yaw 0 and the resolution of the map."""
    grid = hn.load_map(data / f"{MASKS[mask]}.yaml", robot_radius_m=0)
    path = data / f"{mask}.yaml"
    layer = hn.load_keepout_mask(path, grid)
    known = yaml.safe_load(path.read_text())
    with Image.open(path.parent / known["image"]) as image:
        grey = np.asarray(image.convert("L")).astype(float)[::-1]
    occupied = (255 - grey) / 255 >= known["occupied_thresh"]
    shift = (np.array(known["origin"][:2]) - grid.frame.origin_m) / grid.resolution_m
    col0, row0 = np.rint(shift).astype(int).tolist()
    assert np.allclose(shift, (col0, row0), atol=1e-6)
    expected = np.zeros(grid.shape, bool)
    rows, cols = grid.shape
    part = occupied[max(-row0, 0) : rows - row0, max(-col0, 0) : cols - col0]
    top, left = max(row0, 0), max(col0, 0)
    expected[top : top + part.shape[0], left : left + part.shape[1]] = part
    assert expected.any()
    assert layer.keepout is not None
    assert (layer.keepout == expected).all()


@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
def test_the_speed_mask_of_nav2_slows_its_lanes(data: Path) -> None:
    grid = hn.load_map(data / "nav2/maps/depot.yaml", robot_radius_m=0)
    path = data / "nav2/filter_masks/depot_speed.yaml"
    layer = hn.load_speed_mask(path, grid)
    with Image.open(path.parent / "depot_speed.pgm") as image:
        grey = np.asarray(image).astype(float)[::-1]
    value = np.rint((255 - grey) / 255 * 100)  # mode scale from 0 to 1
    limited = (value > 0) & (value < 100)
    expected = np.where(limited, 100 / np.maximum(100 - value, 1), 1.0)
    assert limited.any()
    assert np.abs(layer.factors - expected).max() <= UNIT
