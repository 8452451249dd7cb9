"""The generated maps: what a user is promised to find in them, and that the files are theirs."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image
from scipy import ndimage

import hybridnav as hn
from benchmarks.__main__ import main
from benchmarks.worlds import World, figure1_world, office_world, tiled, write_world
from benchmarks.worlds.office import DOORS, ROOMS
from benchmarks.worlds.scan import window
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, Frame, OccupancyGrid

MAPS = Path(__file__).parents[2] / "maps"
RADIUS_M = 0.25
SEALED = "sealed archive"
START, GOAL = (1.0, 13.2), (40.6, 19.4)
NORTH_ARM, SOUTH_ARM = (19.0, 16.2, 19.4, 19.0), (19.0, 6.0, 19.4, 8.8)


@cache
def office(seed=0):
    return office_world(seed=seed)


@cache
def office_grid(seed=0, radius_m=RADIUS_M):
    return office(seed).grid(robot_radius_m=radius_m)


def mask_of(grid, rect):
    mask = np.zeros(grid.shape, dtype=bool)
    mask[window(grid.frame, rect)] = True
    return mask


def reach(grid, start, *, closed=()):
    """Free cells that can be reached from a point when rectangles are closed."""
    free = grid.classes == CellClass.FREE
    for rect in closed:
        free &= ~mask_of(grid, rect)
    labels, _ = ndimage.label(free)
    row, col = grid.frame.cells_of(start)
    assert labels[row, col] > 0
    return labels == labels[row, col]


def reaches(grid, start, goal, *, closed=()):
    row, col = grid.frame.cells_of(goal)
    return bool(reach(grid, start, closed=closed)[row, col])


def test_committed_files_are_what_the_generator_makes(tmp_path):
    assert main(["worlds", str(tmp_path)]) == 0
    generated = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*.*"))
    committed = sorted(
        path.relative_to(MAPS) for path in MAPS.rglob("*.*") if path.suffix in {".pgm", ".yaml"}
    )
    assert [str(path) for path in generated] == [
        "figure1/figure1.pgm",
        "figure1/figure1.yaml",
        "office/office.pgm",
        "office/office.yaml",
    ]
    assert set(generated) <= set(committed)
    for path in generated:
        assert (tmp_path / path).read_bytes() == (MAPS / path).read_bytes(), path


@pytest.mark.parametrize("world", [office_world(), figure1_world()], ids=lambda world: world.name)
def test_an_example_map_is_its_world(world, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    loaded = hn.example_map(world.name, robot_radius_m=RADIUS_M)
    made = world.grid(robot_radius_m=RADIUS_M)
    assert np.array_equal(made.classes, loaded.classes)
    # Greys are read as Nav2 does, step by step in float32.
    np.testing.assert_allclose(made.probability, loaded.probability, atol=1e-7)
    assert (made.frame, made.name) == (loaded.frame, loaded.name)


def test_an_example_map_without_a_radius_has_the_default():
    made = hn.example_map("figure1")
    assert (made.robot_radius_m, made.radius_is_default) == (0.25, True)


def test_an_unknown_example_map_names_those_there_are():
    with pytest.raises(InvalidValueError, match="'flat', only figure1 and office"):
        hn.example_map("flat", robot_radius_m=0.0)


def test_files_say_what_the_world_is(tmp_path):
    world = World(office().pixels, Frame(1e-4, (-3.0, 2.5), 0.3), "turned", 0.25, 0.7)
    path = write_world(world, tmp_path / "new" / "folder", "turned")
    assert yaml.safe_load(path.read_text()) == {
        "image": "turned.pgm",
        "mode": "trinary",
        "resolution": 1e-4,
        "origin": [-3.0, 2.5, 0.3],
        "negate": 0,
        "occupied_thresh": 0.7,
        "free_thresh": 0.25,
    }
    with Image.open(path.with_suffix(".pgm")) as image:
        assert image.mode == "L"
        np.testing.assert_array_equal(np.asarray(image), world.pixels)


@pytest.mark.parametrize("name", ["", "a/b", "../up", "a: b", ".hidden"])
def test_a_map_needs_a_plain_file_name(tmp_path, name):
    with pytest.raises(InvalidValueError, match="plain file name"):
        write_world(figure1_world(), tmp_path, name)
    assert not list(tmp_path.iterdir())


def test_command_line_wants_one_folder(capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["worlds"])
    assert "usage: python -m benchmarks worlds [-h] folder" in capsys.readouterr().err


def test_a_world_keeps_its_pixels_to_itself():
    pixels = np.full((2, 3), 254, dtype=np.uint8)
    world = World(pixels, Frame(), "w")
    pixels[0, 0] = 0
    assert (world.pixels == 254).all()
    with pytest.raises(ValueError, match="read-only"):
        world.pixels[0, 0] = 0


@pytest.mark.parametrize("pixels", [np.zeros((2, 2)), np.zeros(4, dtype=np.uint8)])
def test_a_world_needs_a_byte_image(pixels):
    with pytest.raises(InvalidValueError, match="two-dimensional uint8"):
        World(pixels, Frame(), "w")


def test_a_world_becomes_a_grid_with_its_lowest_row_first():
    pixels = np.array([[0, 205, 254], [254, 254, 254]], dtype=np.uint8)
    grid = World(pixels, Frame(0.5, (1.0, 2.0)), "w").grid(robot_radius_m=0)
    assert isinstance(grid, OccupancyGrid)
    assert grid.classes.tolist() == [[1, 1, 1], [0, 2, 1]]
    assert (grid.name, grid.frame) == ("w", Frame(0.5, (1.0, 2.0)))


def test_office_is_a_map_server_map_of_an_office_floor():
    world = office()
    assert world.pixels.shape == (580, 960)
    assert world.frame == Frame(0.05, (-3.0, -2.0))
    assert np.unique(world.pixels).tolist() == [0, 205, 254]
    rows, cols = np.nonzero(world.pixels == 0)
    assert np.ptp(cols) * 0.05 > 40
    assert np.ptp(rows) * 0.05 > 24.9
    border = np.r_[world.pixels[[0, -1]].ravel(), world.pixels[:, [0, -1]].ravel()]
    assert (border == 205).all()


def test_seed_changes_the_noise_and_nothing_else_does():
    first, again, other = office_world(seed=3), office_world(seed=3), office_world(seed=4)
    np.testing.assert_array_equal(first.pixels, again.pixels)
    changed = (first.pixels != other.pixels).mean()
    assert 0.001 < changed < 0.05


@pytest.mark.parametrize("seed", range(4))
def test_every_ordinary_room_can_be_reached(seed):
    grid = office_grid(seed)
    reached = reach(grid, START)
    for name, rect in ROOMS.items():
        room = mask_of(grid, rect)
        free = room & (grid.classes == CellClass.FREE)
        share = (reached & free).sum() / free.sum()
        assert share == 0 if name == SEALED else share > 0.98, name
        assert free.sum() > 0.4 * room.sum(), name


@pytest.mark.parametrize("seed", range(4))
def test_every_doorway_stays_wide_enough(seed):
    grid = office_grid(seed, radius_m=0.0)
    for door in DOORS:
        half = door.width_m / 2 - 0.05
        x, y = (half, 0.4) if door.along_x else (0.4, half)
        rows, cols = window(grid.frame, (door.x - x, door.y - y, door.x + x, door.y + y))
        assert (grid.classes[rows, cols] == CellClass.FREE).all(), door
        assert 2 * half >= 0.8


@pytest.mark.parametrize("radius_m", [0.0, RADIUS_M])
def test_sealed_room_is_a_component_of_its_own(radius_m):
    grid = office_grid(radius_m=radius_m)
    vertices, _ = ndimage.label(grid.classes != CellClass.OCCUPIED)
    inside = mask_of(grid, ROOMS[SEALED])
    row, col = grid.frame.cells_of((15.8, 13.6))
    sealed = vertices == vertices[row, col]
    assert vertices[row, col] > 0
    assert not (sealed & ~inside).any()
    assert sealed.sum() > 0.6 * inside.sum()


def test_corridor_is_a_loop():
    grid = office_grid()
    assert reaches(grid, START, GOAL, closed=[NORTH_ARM])
    assert reaches(grid, START, GOAL, closed=[SOUTH_ARM])
    assert not reaches(grid, START, GOAL, closed=[NORTH_ARM, SOUTH_ARM])


def test_seminar_room_has_two_doors_onto_one_corridor():
    grid = office_grid()
    doors = [(door.x - 0.6, door.y - 0.4, door.x + 0.6, door.y + 0.4) for door in DOORS[1:3]]
    seminar, corridor = (12.6, 4.8), (12.6, 7.4)
    assert reaches(grid, seminar, corridor, closed=doors[:1])
    assert reaches(grid, seminar, corridor, closed=doors[1:])
    assert not reaches(grid, seminar, corridor, closed=doors)


def test_inner_door_joins_secretary_and_director():
    grid = office_grid()
    onto_corridor = [(8.4, 18.5, 17.2, 19.1)]
    assert reaches(grid, (11.4, 20.0), (13.2, 20.0), closed=onto_corridor)
    assert not reaches(grid, (11.4, 20.0), START, closed=onto_corridor)


@pytest.mark.parametrize("radius_m", [0.0, RADIUS_M])
def test_unexplored_island_lies_wholly_inside_the_hall(radius_m):
    grid = office_grid(radius_m=radius_m)
    labels, _ = ndimage.label(grid.classes == CellClass.UNEXPLORED)
    row, col = grid.frame.cells_of((35.5, 12.5))
    island = labels == labels[row, col]
    assert labels[row, col] > 0
    for extent in np.nonzero(island):
        assert 1.5 <= (np.ptp(extent) + 1) * 0.05 <= 3
    shore = ndimage.binary_dilation(island, iterations=3) & ~island
    assert (grid.classes[shore] != CellClass.OCCUPIED).all()
    assert (reach(grid, START)[shore]).mean() > 0.95


def test_store_is_seen_in_part():
    grid = office_grid(radius_m=0.0)
    store = grid.classes[window(grid.frame, (17.6, 19.0, 21.2, 24.8))]
    assert 0.2 < (store == CellClass.FREE).mean() < 0.8
    assert 0.2 < (store == CellClass.UNEXPLORED).mean() < 0.8


def test_main_route_ends_are_clear():
    grid = office_grid(radius_m=0.0)
    clearance = ndimage.distance_transform_edt(grid.classes == CellClass.FREE) * 0.05
    for point in (START, GOAL):
        assert clearance[tuple(grid.frame.cells_of(point))] >= 0.4


def test_figure1_has_a_double_boundary_and_an_inclusion():
    classes = figure1_world().grid(robot_radius_m=0).classes
    free, free_count = ndimage.label(classes == CellClass.FREE)
    unexplored, unexplored_count = ndimage.label(classes == CellClass.UNEXPLORED)
    _, obstacles = ndimage.label(
        classes == CellClass.OCCUPIED, structure=np.ones((3, 3), dtype=bool)
    )
    assert (free_count, unexplored_count, obstacles) == (1, 2, 2)
    b, c = unexplored[15, 35], unexplored[15, 9]
    for region, boundaries in ((b, 2), (c, 1)):
        shore = ndimage.binary_dilation(unexplored == region) & (free == 1)
        assert ndimage.label(shore, structure=np.ones((3, 3), dtype=bool))[1] == boundaries
    around = ndimage.binary_dilation(unexplored == c, structure=np.ones((3, 3), dtype=bool))
    assert (free[around & (unexplored != c)] == 1).all()


def test_tiles_are_joined():
    world = office()
    large = tiled(world, rows=2, cols=3)
    assert large.pixels.shape == (2 * 580, 3 * 960)
    assert large.frame == world.frame
    grid = large.grid(robot_radius_m=RADIUS_M)
    reached = reach(grid, START)
    for row in range(2):
        for col in range(3):
            goal = grid.frame.cells_of(GOAL) + np.array([row * 580, col * 960])
            assert reached[tuple(goal)]
    single = reach(office_grid(), START).sum()
    assert 6 * single < reached.sum() < 6.2 * single
    sealed = grid.frame.cells_of((15.8, 13.6))
    assert grid.classes[tuple(sealed)] == CellClass.FREE
    assert not reached[tuple(sealed)]


def test_tiles_change_only_where_neighbours_meet():
    pixels = np.full((30, 40), 205, dtype=np.uint8)
    pixels[4:26, 5:35] = 0
    pixels[5:25, 6:34] = 254
    world = World(pixels, Frame(0.1), "room")
    large = tiled(world, rows=2, cols=2).pixels
    changed = large != np.tile(pixels, (2, 2))
    rows, cols = np.nonzero(changed)
    assert (rows.min(), rows.max(), cols.min(), cols.max()) == (8, 51, 13, 66)
    # Four passages, 10 cells wide: two along x from wall to wall 12 cells apart, two along y 10.
    assert (large[changed] == 254).sum() == 10 * (12 + 12 + 10 + 10)
    assert ndimage.label(large == 254)[1] == 1
    np.testing.assert_array_equal(tiled(world, rows=1, cols=1).pixels, pixels)


@pytest.mark.parametrize(("rows", "cols"), [(0, 1), (1, -1), (400, 400)])
def test_tiles_need_sensible_counts(rows, cols):
    with pytest.raises(InvalidValueError, match="tiles must be at least 1 x 1"):
        tiled(office(), rows=rows, cols=cols)


def test_tiles_need_room_for_a_passage():
    narrow = World(np.full((30, 3), 254, dtype=np.uint8), Frame(0.1), "narrow")
    with pytest.raises(InvalidValueError, match="free square with a side of 10 cells"):
        tiled(narrow, rows=1, cols=2)
