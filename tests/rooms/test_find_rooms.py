"""Segmentation into rooms: what must be found."""

import math

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.maps import CellClass
from hybridnav.rooms.find import divide_rooms
from research._rooms_agreement import compare_rooms
from tests.strategies import class_grids, occupancy_grid

RESOLUTION_M = 0.1


def floor(turned_rad=0.0):
    """Three rooms of 4 m x 4 m side by side over a corridor of 2 m, doors of 1 m; and the rooms."""
    rows, cols = 65, 125
    free = np.zeros((rows, cols), dtype=bool)
    true = np.full((rows, cols), -1)
    free[2:22, 2:123], true[2:22, 2:123] = True, 3
    for number in range(3):
        left = 2 + 41 * number
        free[23:63, left : left + 39], true[23:63, left : left + 39] = True, number
        free[22, left + 15 : left + 25] = True
    if turned_rad:
        side = 150
        row, col = np.indices((side, side)) - (side - 1) / 2
        cosine, sine = math.cos(turned_rad), math.sin(turned_rad)
        from_row = np.rint(cosine * row - sine * col + (rows - 1) / 2).astype(int)
        from_col = np.rint(sine * row + cosine * col + (cols - 1) / 2).astype(int)
        inside = (from_row >= 0) & (from_row < rows) & (from_col >= 0) & (from_col < cols)
        at = from_row.clip(0, rows - 1), from_col.clip(0, cols - 1)
        free, true = inside & free[at], np.where(inside, true[at], -1)
    return occupancy_grid(free.astype(np.uint8), resolution_m=RESOLUTION_M), true


@pytest.mark.parametrize("turned_rad", [0.0, 0.5])
def test_rooms_are_parted_from_a_corridor(turned_rad):
    grid, true = floor(turned_rad)
    rooms = hn.find_rooms(grid)
    known = (true >= 0) & (grid.classes == CellClass.FREE)
    agreed = compare_rooms(true[known], rooms.label_of[known])
    assert agreed.n_found == 4
    assert agreed.mcc > 0.9
    assert (agreed.recall > 0.9).all()


def test_names_count_up_from_the_top_whatever_the_radius_of_the_robot():
    grid, _ = floor()
    rooms = hn.find_rooms(grid)
    assert rooms.names == ("room-1", "room-2", "room-3", "room-4")
    middles = [rooms.label_of[40, 20], rooms.label_of[40, 60], rooms.label_of[40, 100]]
    assert middles == [0, 1, 2]
    assert rooms.label_of[10, 60] == 3
    wide = hn.OccupancyGrid(grid.probability, grid.frame, robot_radius_m=0.3)
    assert (hn.find_rooms(wide).label_of == rooms.label_of).all()


def beside_a_closet(side_cells):
    """A room of 4 m x 6 m; behind a wall of one cell a closet without a door."""
    free = np.zeros((64, 70), dtype=np.uint8)
    free[2:62, 2:42] = 1
    free[10 : 10 + side_cells, 43 : 43 + side_cells] = 1
    return free


def test_a_closet_with_a_door_is_a_room_by_its_free_area():
    free = beside_a_closet(12)
    free[12:20, 42] = 1
    grid = occupancy_grid(free, resolution_m=RESOLUTION_M)
    small = hn.find_rooms(grid, least_area_m2=1.44)
    assert small.names == ("room-1", "room-2")
    assert small.label_of[15, 50] != small.label_of[15, 20]
    # Larger than the closet and its threshold are: it goes to the room it opens onto.
    whole = hn.find_rooms(grid, least_area_m2=1.8)
    assert whole.names == ("room-1",)
    assert (whole.label_of[free == 1] == 0).all()


@pytest.mark.parametrize("beyond", [CellClass.FREE, CellClass.UNEXPLORED])
def test_no_room_reaches_through_a_wall_of_one_cell(beyond):
    cells = beside_a_closet(6)
    closet = np.zeros(cells.shape, dtype=bool)
    closet[10:16, 43:49] = True
    cells[closet] = beyond
    rooms = hn.find_rooms(occupancy_grid(cells, resolution_m=RESOLUTION_M))
    assert rooms.names == ("room-1",)
    assert (rooms.label_of[closet] == -1).all()
    assert rooms.label_of[12, 42] == 0  # into the wall, not out of it


def test_rooms_reach_into_what_is_unexplored_on_their_side():
    cells = beside_a_closet(0)
    cells[30:42, 30:42] = CellClass.UNEXPLORED
    label_of = hn.find_rooms(occupancy_grid(cells, resolution_m=RESOLUTION_M)).label_of
    assert (label_of[32:40, 30] == 0).all()
    assert label_of[36, 36] == -1


@given(classes=class_grids(), side=st.sampled_from([1, 3]))
def test_rooms_of_any_map_hold_free_cells_of_one_connected_part(classes, side):
    """One view, or four of cells of 0.08 m, in which what hangs together may be two parts."""
    classes = np.kron(classes, np.ones((side, side), np.uint8))
    grid = occupancy_grid(classes, resolution_m=0.25 / side)
    rooms = hn.find_rooms(grid, least_area_m2=0.2)
    label_of = np.where(grid.measured == CellClass.FREE, rooms.label_of, -1)
    for number in range(len(rooms.names)):
        assert ndimage.label(label_of == number)[1] == 1
        assert np.count_nonzero(label_of == number) * grid.cell_area_m2 >= 0.2
    again = hn.find_rooms(grid, least_area_m2=0.2)
    assert (again.label_of == rooms.label_of).all()


def test_walls_that_a_scan_left_unexplored_part_rooms_too():
    grid, true = floor()
    probability = np.where(grid.probability > 0, 0.5, 0.0).astype(np.float32)
    rooms = hn.find_rooms(hn.OccupancyGrid(probability, grid.frame, robot_radius_m=0))
    known = (true >= 0) & (grid.classes == CellClass.FREE)
    assert compare_rooms(true[known], rooms.label_of[known]).mcc > 0.9


def test_closets_that_lie_whole_in_gaps_between_walls_are_rooms():
    closets = np.pad(np.tile(np.pad(np.ones((4, 4), np.uint8), (0, 2)), (3, 3)), (2, 0))
    found = hn.find_rooms(occupancy_grid(closets, resolution_m=0.25))
    assert len(found.names) == 9
    assert (found.label_of[closets == 1] >= 0).all()


def test_open_ground_without_a_wall_is_one_room():
    grid = hn.OccupancyGrid(np.zeros((40, 60), np.float32), hn.Frame(0.1), robot_radius_m=0)
    assert hn.find_rooms(grid).names == ("room-1",)


def test_a_map_without_free_cells_has_no_rooms():
    grid = hn.OccupancyGrid(np.ones((5, 5), np.float32), hn.Frame(0.1), robot_radius_m=0)
    assert hn.find_rooms(grid).names == ()


def test_areas_out_of_range_are_refused():
    grid = hn.OccupancyGrid(np.zeros((5, 5), np.float32))
    for area_m2 in (0.0, -1.0, math.nan, math.inf, 1e308):
        with pytest.raises(hn.errors.InvalidValueError, match="positive"):
            hn.find_rooms(grid, least_area_m2=area_m2)


@given(classes=class_grids(12), seed=st.integers(0, 2**32 - 1))
def test_rooms_are_divided_by_the_way_to_walk_from_the_seeds(classes, seed):
    rng = np.random.default_rng(seed)
    room_of = np.where(classes > 0, rng.integers(0, 2, classes.shape), -1).astype(np.int32)
    inside = np.argwhere(room_of >= 0)
    if len(inside) == 0:
        return
    seeds = {label: tuple(cell) for label, cell in enumerate(rng.permutation(inside)[:4].tolist())}
    walks = nx.grid_2d_graph(*room_of.shape)
    walks.remove_edges_from([(a, b) for a, b in walks.edges if room_of[a] != room_of[b]])
    divided = divide_rooms(room_of, seeds)
    steps = {n: nx.single_source_shortest_path_length(walks, at) for n, at in seeds.items()}
    for cell in map(tuple, np.argwhere(room_of >= -1).tolist()):
        reached = {label: far[cell] for label, far in steps.items() if cell in far}
        nearest = {n for n, far in reached.items() if far == min(reached.values())}
        assert divided[cell] in (nearest or {-1})


def framed(margin, *, door):
    """A building of two rooms in the middle of an image whose margin is free, in cells of 10 cm."""
    inner = np.zeros((32, 62), dtype=np.uint8)
    inner[1:31, 1:30] = inner[1:31, 31:61] = inner[12:22, 30] = 1
    if door:
        inner[0, 10:20] = 1
    return occupancy_grid(np.pad(inner, margin, constant_values=1), resolution_m=0.1)


@pytest.mark.parametrize("margin", [1, 5, 30])
def test_what_lies_round_the_building_is_no_room(margin):
    rooms = hn.find_rooms(framed(margin, door=False), least_area_m2=0.5)
    assert len(rooms.names) == 2
    assert (rooms.label_of[0] == -1).all()
    assert (rooms.label_of[margin + 5, margin + 5 : margin + 55] >= 0).all()


def test_a_yard_that_the_building_opens_to_stays_a_room():
    assert (hn.find_rooms(framed(30, door=True)).label_of[0] >= 0).any()


def test_a_hall_that_the_border_cuts_off_stays_a_room():
    classes = np.ones((60, 60), dtype=np.uint8)
    classes[20:40, 20:40] = 0
    classes[25:30, 25:30] = 1  # a lift in the core of it
    rooms = hn.find_rooms(occupancy_grid(classes, resolution_m=0.1))
    assert (rooms.label_of[0] >= 0).all()


@pytest.mark.parametrize(
    ("name", "outside"), [("bwi_gdc/3/3.yaml", True), ("nav2/maps/depot.yaml", False)]
)
@pytest.mark.full
@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
def test_the_frame_of_a_real_image_is_no_room(data, name, outside):
    rooms = hn.find_rooms(hn.load_map(data / name))
    rim = np.concatenate([rooms.label_of[0], rooms.label_of[-1]])
    assert (rim >= 0).any() != outside
