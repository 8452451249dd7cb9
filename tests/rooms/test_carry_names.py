"""Names of rooms and numbers of doors that are carried to a later map.

The truth is the transform that a later map is made by, and the cells that rooms have in common.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.rooms import carry_names

ANGLE_RAD, SHIFT_M = 2.3, (31.0, -17.0)


@pytest.fixture(scope="module")
def office():
    """The office and its rooms, with a name and a point of their own."""
    grid = hn.example_map("office")
    found = hn.find_rooms(grid)
    doors = {d.number: d.position for d in topology(grid, found).rooms.doors if not d.is_gap}
    names = ("kitchen", *found.names[1:])
    return hn.RoomLabels(names, found.label_of, {"printer": (2.0, 13.0)}, doors), grid


def topology(grid, rooms):
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))


def moved_point(point, angle=ANGLE_RAD, shift=SHIFT_M):
    """A point of the old frame in the new one, by complex numbers."""
    there = complex(*point) * complex(math.cos(angle), math.sin(angle)) + complex(*shift)
    return there.real, there.imag


def scanned_again(grid, crop=1.0, boxes=0, seed=0):
    """A later map of a grid: turned, cropped, with boxes in free space; and each cell's old one."""
    rng = np.random.default_rng(seed)
    corners = [moved_point(p) for p in grid.frame.points_of_grid(_corners(grid.shape)).tolist()]
    low, high = np.min(corners, axis=0), np.max(corners, axis=0)
    side = grid.resolution_m
    shape = np.ceil((high - low)[::-1] * crop / side).astype(int)
    frame = hn.Frame(side, tuple((low + (high - low) * (1 - crop) / 2).tolist()))
    x, y = frame.points_of(np.indices(shape).reshape(2, -1).T).T
    back = (x + 1j * y - complex(*SHIFT_M)) * complex(math.cos(ANGLE_RAD), -math.sin(ANGLE_RAD))
    was = grid.frame.cells_of(np.stack([back.real, back.imag], axis=1))
    inside = ((was >= 0) & (was < grid.shape)).all(axis=1)
    probability = np.full(len(was), 0.5, np.float32)
    probability[inside] = grid.probability[tuple(was[inside].T)]
    probability = probability.reshape(shape)
    for _ in range(boxes):
        row, col = rng.integers(0, shape - 16)
        box = probability[row : row + rng.integers(6, 16), col : col + rng.integers(6, 16)]
        box[box == box.min()] = 1.0
    was[~inside] = -1
    new = hn.OccupancyGrid(probability, frame, robot_radius_m=grid.robot_radius_m)
    return new, was.reshape(*shape, 2)


def _corners(shape):
    return [[0, 0], [0, shape[1]], [shape[0], 0], list(shape)]


def wrong_and_missed(carried, old, new, was):
    """Rooms carried though less than 0.4 of either lies in the other; rooms not carried though more
    than 0.6 of both do."""
    labels = np.where((was >= 0).all(axis=2), old.label_of[was[..., 0], was[..., 1]], -1)
    shown = labels >= 0
    wrong, missed = [], []
    for at, name in enumerate(old.names):
        mine = labels == at
        shares = {}
        for to, other in enumerate(new.names):
            its = (new.label_of == to) & shown
            both = (mine & its).sum()
            shares[other] = min(both / max(mine.sum(), 1), both / max(its.sum(), 1))
        large = mine.sum() > 0.6 * (old.label_of == at).sum()
        best = max(shares, key=lambda other: shares[other])
        to = carried.rooms[name].new
        wrong += [(name, to)] if to is not None and shares[to] < 0.4 else []
        missed += [name] if large and shares[best] > 0.6 and to != best else []
    return wrong, missed


def test_a_map_carried_to_itself_keeps_every_name_number_and_point(office):
    rooms, grid = office
    carried = carry_names(rooms, grid, rooms, grid)
    assert carried.transform is not None
    assert carried.transform.rotation_rad == pytest.approx(0, abs=1e-3)
    assert carried.transform.translation_m == pytest.approx((0, 0), abs=grid.resolution_m)
    assert carried.labels.names == rooms.names
    assert np.array_equal(carried.labels.label_of, rooms.label_of)
    assert set(carried.labels.doors) >= set(rooms.doors)
    assert {n: carried.labels.doors[n] for n in rooms.doors} == dict(rooms.doors)
    assert carried.labels.points["printer"] == pytest.approx((2.0, 13.0), abs=grid.resolution_m)
    assert (carried.undecided, carried.lost, carried.new_rooms, carried.new_doors) == ((),) * 4


@pytest.mark.parametrize("quarters", [1, 2])
def test_a_map_turned_by_quarters_keeps_every_name(office, quarters):
    rooms, grid = office
    new_grid = hn.OccupancyGrid(np.rot90(grid.probability, quarters), hn.Frame(0.05))
    new = hn.RoomLabels(
        tuple(f"later {n}" for n in range(len(rooms.names))), np.rot90(rooms.label_of, quarters)
    )
    carried = carry_names(rooms, grid, new, new_grid)
    assert carried.transform is not None
    assert carried.labels.names == rooms.names
    # Rows run upward: numpy's turn from the first axis to the second is one to the right.
    assert math.remainder(carried.transform.rotation_rad + quarters * math.pi / 2, math.tau) == (
        pytest.approx(0, abs=1e-3)
    )
    assert all(each.status == "carried" for each in carried.doors.values())


@pytest.fixture(scope="module")
def cropped(office):
    """A later map, its rooms, and the old cell of each of its cells."""
    grid, was = scanned_again(office[1], crop=0.6, boxes=40)
    return hn.find_rooms(grid), grid, was


def test_names_come_to_a_cropped_map_in_another_frame(office, cropped):
    rooms, grid = office
    new, new_grid, was = cropped
    carried = carry_names(rooms, grid, new, new_grid)
    assert carried.transform is not None
    turn = math.remainder(carried.transform.rotation_rad - ANGLE_RAD, math.tau)
    assert abs(math.degrees(turn)) < 0.2
    middle = grid.frame.points_of([[grid.shape[0] // 2, grid.shape[1] // 2]])
    assert carried.transform.moved(middle)[0] == pytest.approx(moved_point(middle[0]), abs=0.05)
    there = carried.transform.moved(middle)
    assert carried.transform.inverse.moved(there)[0] == pytest.approx(middle[0], abs=1e-9)
    assert wrong_and_missed(carried, rooms, new, was) == ([], [])
    for number, each in carried.doors.items():
        if each.status == "carried":
            at = carried.labels.doors[number]
            assert math.dist(at, moved_point(rooms.doors[number])) < 1.0
    # Each name once, all others new; what is not carried is listed.
    names = carried.labels.names
    assert len(set(names)) == len(names) == len(new.names)
    kept = {name for name, each in carried.rooms.items() if each.status == "carried"}
    assert kept == set(rooms.names) & set(names)
    assert set(carried.new_rooms) == set(names) - kept
    assert kept | set(carried.undecided) | set(carried.lost) == set(rooms.names)
    assert all(0 < carried.rooms[name].confidence <= 1 for name in kept)
    assert all(carried.rooms[name].reason for name in (*carried.undecided, *carried.lost))


def test_names_carried_there_and_back_are_those_before(office, cropped):
    rooms, grid = office
    new, new_grid, _ = cropped
    there = carry_names(rooms, grid, new, new_grid)
    plain = replace(rooms, names=tuple(f"plain {at}" for at in range(len(rooms.names))))
    back = carry_names(there.labels, new_grid, plain, grid)
    kept = {n for n, each in there.rooms.items() if each.status == "carried"}
    again = {n for n, each in back.rooms.items() if each.status == "carried" and n in kept}
    assert "kitchen" in again
    assert all(back.labels.names.index(name) == rooms.names.index(name) for name in again)
    assert len(again) >= 0.9 * len(kept)


def test_a_room_that_a_person_divides_is_listed_and_its_name_given_to_no_part(office):
    """Without a wall, found rooms are joined as they were."""
    rooms, grid = office
    label_of = rooms.label_of.copy()
    cells = np.argwhere(label_of == 0)
    right = cells[cells[:, 1] > np.quantile(cells[:, 1], 0.66)]
    label_of[tuple(right.T)] = len(rooms.names)
    left = cells[cells[:, 1] < np.quantile(cells[:, 1], 0.34)]
    label_of[tuple(left.T)] = len(rooms.names) + 1
    new = hn.RoomLabels((*rooms.names, "annex", "store"), label_of)
    joined = carry_names(rooms, grid, new, grid)
    assert joined.undecided == ()
    assert np.array_equal(joined.labels.label_of, rooms.label_of)
    assert joined.rooms["kitchen"].reason == "cut as before: kitchen, annex, store"
    carried = carry_names(rooms, grid, new, grid, recut=False)
    assert carried.rooms["kitchen"].new is None
    assert carried.undecided == ("kitchen",)
    assert "annex" in carried.rooms["kitchen"].reason
    assert "kitchen" not in carried.labels.names


BOXES_M = {
    "hall": (0, 4, 20, 8),
    "lab": (0, 0, 9, 4),
    "shop": (9, 1, 16, 4),
    "den": (0, 8, 6, 11),
    "store": (12, 8, 20, 13),
}
"""Left, low, right and high side of each room of a floor, in metres; walls have 0.2 m."""
DOORS_M = (4, 3.9, 5, 4.1), (13, 3.9, 14, 4.1), (3, 7.9, 4, 8.1), (14, 7.9, 15, 8.1)


def drawn(free=DOORS_M, walls=(), cuts=(), joined=()):
    """The floor, with boxes that are free in its walls, and walls in its rooms. Its rooms, some cut
    off from an x on under a name of their own, others joined."""
    cells, label_of = np.full((300, 440), 0.5, np.float32), np.full((300, 440), -1)

    def box(where, in_m=0.0):
        left, low, right, high = (round(20 * each) + 20 for each in where)
        inside = round(20 * in_m)
        return np.s_[low + inside : high - inside, left + inside : right - inside]

    for name, (at, where) in zip(BOXES_M, enumerate(BOXES_M.values()), strict=True):
        cells[box(where, in_m=-0.1)] = 1
        label_of[box(where)] = list(BOXES_M).index(joined[0]) if name in joined else at
        for x in (x for cut, x in cuts if cut == name):
            label_of[box((x, *where[1:]))] = len(BOXES_M)
    for where in BOXES_M.values():
        cells[box(where, in_m=0.1)] = 0
    for value, boxes in ((0, free), (1, walls)):
        for where in boxes:
            cells[box(where)] = value
    used, dense = np.unique(label_of, return_inverse=True)
    names = [*BOXES_M, "other"]
    rooms = hn.RoomLabels(
        tuple(names[at] for at in used[1:]), dense.reshape(cells.shape).astype(np.int32) - 1
    )
    return rooms, hn.OccupancyGrid(cells, hn.Frame(0.05), robot_radius_m=0)


HALF_WALL = (9.9, 4, 10.1, 5.5), (9.9, 6.5, 10.1, 8)
GONE = (8.9, 1.1, 9.1, 3.9)


@pytest.mark.parametrize(
    ("floor", "undecided"),
    [
        ({"cuts": [("hall", 8)]}, ()),
        ({"joined": ("hall", "lab")}, ()),
        ({"joined": ("hall", "lab", "store"), "cuts": [("hall", 12)]}, ()),
        ({"walls": HALF_WALL}, ()),
        ({"walls": HALF_WALL, "cuts": [("hall", 10)]}, ("hall",)),
        ({"free": (*DOORS_M, GONE), "joined": ("shop", "lab")}, ("shop",)),
        ({"free": (*DOORS_M, GONE), "walls": [(9.7, 1, 9.9, 4)]}, ()),
        ({"free": [(x + 3, *y) for x, *y in DOORS_M], "joined": ("hall", "den")}, ()),
    ],
)
@pytest.mark.parametrize("is_turned", [False, True])
def test_rooms_are_cut_as_before_unless_walls_come_or_go(floor, undecided, is_turned):
    old, old_grid = drawn()
    new, grid = drawn(**floor)
    if is_turned:
        grid, was = scanned_again(grid)
        labels = np.where((was >= 0).all(axis=2), new.label_of[was[..., 0], was[..., 1]], -1)
        new = hn.RoomLabels(new.names, labels)
    carried = carry_names(old, old_grid, new, grid)
    assert (carried.undecided, carried.lost) == (undecided, ())


def test_doors_rules_and_uses_outlive_another_cut_and_the_file(tmp_path):
    old, old_grid = drawn()
    doors = {d.number: d.position for d in topology(old_grid, old).rooms.doors if not d.is_gap}
    rules = tuple(hn.OneWayRule(number, into="hall") for number in doors)
    old = replace(old, doors=doors, one_way=rules, uses={"shop": hn.RoomUse(private=True)})
    new, grid = drawn(joined=("hall", "lab", "den"), cuts=[("shop", 12)])
    label_of = new.label_of.copy()
    label_of[:2, :2] = new.index("shop")  # in a wall, apart from the room, which is joined
    carried = carry_names(old, old_grid, replace(new, label_of=label_of), grid)
    assert carried.lost_one_way == ()
    hn.save_rooms(tmp_path / "rooms.yaml", carried.labels, grid)
    again = hn.load_rooms(tmp_path / "rooms.yaml", grid)
    assert set(again.names) == set(old.names)
    assert (again.one_way, again.uses, set(again.doors)) == (old.one_way, old.uses, set(old.doors))


def test_rooms_outside_of_a_crop_are_lost(office):
    rooms, grid = office
    cols = slice(0, grid.shape[1] // 2)
    new_grid = replace(grid, probability=grid.probability[:, cols])
    old_cells = [(rooms.label_of == at).any(axis=0).nonzero()[0] for at in range(len(rooms.names))]
    gone = {n for n, at in zip(rooms.names, old_cells, strict=True) if at.min() > cols.stop + 5}
    carried = carry_names(rooms, grid, hn.find_rooms(new_grid), new_grid)
    assert gone
    assert gone <= set(carried.lost)


def test_another_building_has_no_transform_and_no_name(office):
    rooms, grid = office
    blocks = np.zeros((400, 500), np.float32)
    blocks[[0, -1], :] = blocks[:, [0, -1]] = 1
    for at in range(60, 500, 73):
        blocks[at % 400 : at % 400 + 40, at : at + 3] = 1
        blocks[(3 * at) % 350 : (3 * at) % 350 + 3, at - 40 : at + 20] = 1
    new_grid = hn.OccupancyGrid(blocks, hn.Frame(0.05))
    new = hn.find_rooms(new_grid)
    carried = carry_names(rooms, grid, new, new_grid)
    assert carried.transform is None
    assert carried.reason
    assert carried.labels.names == new.names
    assert all(each.new is None for each in (*carried.rooms.values(), *carried.doors.values()))


def test_a_building_that_looks_the_same_turned_round_is_said_to(office):
    _, grid = office
    half = grid.probability[:, : grid.shape[1] // 2]
    twice = np.concatenate([half, half[::-1, ::-1]], axis=1)
    symmetric = hn.OccupancyGrid(twice, hn.Frame(0.05))
    rooms = hn.find_rooms(symmetric)
    carried = carry_names(rooms, symmetric, rooms, symmetric)
    assert carried.transform is None
    assert "equally well, 180 degrees apart" in carried.reason
    assert set(carried.undecided) == set(rooms.names)


@pytest.mark.parametrize("shape", [(1, 1), (3, 40)])
@pytest.mark.parametrize("probability", [0.0, 0.5, 1.0])
def test_maps_without_walls_carry_nothing(office, shape, probability):
    rooms, grid = office
    nothing = hn.OccupancyGrid(np.full(shape, probability, np.float32), robot_radius_m=0)
    label = 0 if probability == 0 else -1
    one = hn.RoomLabels(("hall",), np.full(shape, label))
    for carried in (carry_names(one, nothing, rooms, grid), carry_names(rooms, grid, one, nothing)):
        assert carried.transform is None
        assert "too few walls" in carried.reason
    assert carry_names(one, nothing, one, nothing).undecided == ("hall",)


def test_a_map_without_rooms_is_registered_all_the_same(office):
    rooms, grid = office
    none = hn.RoomLabels((), np.full(grid.shape, -1))
    carried = carry_names(rooms, grid, none, grid)
    assert carried.transform is not None
    assert set(carried.lost) == set(rooms.names)
    assert carry_names(none, grid, rooms, grid).new_rooms == rooms.names


def test_rooms_of_another_map_are_refused(office):
    rooms, grid = office
    small = hn.OccupancyGrid(np.zeros((2, 2), np.float32), robot_radius_m=0)
    with pytest.raises(InvalidValueError, match="the old rooms are labels of"):
        carry_names(rooms, small, rooms, grid)
    with pytest.raises(InvalidValueError, match="the new rooms are labels of"):
        carry_names(rooms, grid, rooms, small)
    with pytest.raises(InvalidValueError, match=r"new is .rooms\.yaml. of type str"):
        carry_names(rooms, grid, "rooms.yaml", grid)  # type: ignore[arg-type]


def test_one_site_in_two_years_has_one_frame(data):
    old, new = (
        hn.load_map(data / "strands" / name, robot_radius_m=0)
        for name in ("tsc_y3/tsc20160523.yaml", "tsc_y4/tsc_1701.yaml")
    )
    nothing = [hn.RoomLabels((), np.full(grid.shape, -1)) for grid in (old, new)]
    found = carry_names(nothing[0], old, nothing[1], new).transform
    assert found is not None
    assert found.translation_m == pytest.approx((0, 0), abs=0.2)
    assert abs(math.degrees(found.rotation_rad)) < 1
