"""Rooms and doors of a map that changes: what a build covers, lasting numbers, names, doors."""

from typing import Any

import numpy as np
import pytest
from hypothesis import Phase
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from scipy import ndimage

import hybridnav as hn
from benchmarks.common import OFFICE
from benchmarks.subjects.online import random_changes
from benchmarks.subjects.online_identities import agreement
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live import OnlineRooms
from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.rooms.cutting import Ground
from hybridnav.rooms.find import KINDS, outside_of, reaching
from tests.ext.live.identities import parts_of, run_machine
from tests.strategies import examples

NOTHING: Any = None
WRONG: Any = "rooms.yaml"
RESOLUTION_M = 0.25
SIDE = 9
"""Cells between two walls."""
PROBABILITY = np.array([1.0, 0.0, 0.5], np.float32)


def grid_of(classes, corner=(0, 0), resolution_m=RESOLUTION_M):
    origin_m = (corner[1] * resolution_m, corner[0] * resolution_m)
    return OccupancyGrid(PROBABILITY[classes], Frame(resolution_m, origin_m), robot_radius_m=0)


def floor_plan(rows, cols, open_doors):
    """Rooms in rows and columns; each wall between two of them has a door of three cells."""
    pitch = SIDE + 1
    classes = np.ones((rows * pitch + 1, cols * pitch + 1), np.uint8)
    classes[::pitch] = classes[:, ::pitch] = 0
    doors = []
    for row in range(rows):
        for col in range(cols):
            low, left = row * pitch + 1, col * pitch + 1
            if col + 1 < cols:
                doors.append((slice(low + 2, low + 5), slice(left + SIDE, left + SIDE + 1)))
            if row + 1 < rows:
                doors.append((slice(low + SIDE, low + SIDE + 1), slice(left + 4, left + 7)))
    for at, door in enumerate(doors):
        classes[door] = (open_doors >> at) & 1
    return classes, doors


def core_of(version):
    """The number of the room of each free cell, -1 elsewhere."""
    return np.where(version.grid.measured == 1, version.number_of, -1)


def pockets_of(grid):
    """Connected free cells too few for a room; and those that cells between rays join to others."""
    outside = outside_of(grid)
    free = (grid.measured == 1) & ~outside
    parts, _ = ndimage.label(free)
    pockets = free & (np.bincount(parts.ravel()) * grid.resolution_m**2 < 1.0)[parts]
    ground = Ground.of(KINDS[grid.measured] + free, grid.resolution_m)
    joined, n_joined = ndimage.label(ground.free)
    among_rays = np.isin(np.arange(n_joined + 1), joined[~free & (joined > 0)])
    return pockets, pockets & among_rays[joined]


def check_version(version, *, had_rays=False):
    """A version covers the free cells that a build covers, and its doors are those of its rooms.

    Pockets among rays may differ; they stay as they are where the map is none of rays any more.
    """
    core, fresh = core_of(version), hn.find_rooms(version.grid)
    free = version.grid.measured == 1
    pockets, among_rays = pockets_of(version.grid)
    differs = (core >= 0) != (free & (fresh.label_of >= 0))
    assert not (differs & ~(pockets if had_rays else among_rays)).any()
    areas = np.bincount(core[core >= 0])
    assert (areas[areas > 0] * version.grid.resolution_m**2 >= 1.0).all()
    assert np.array_equal(version.number_of, reaching(core.astype(np.int32), version.grid))
    pyramid = hn.DualGraphPyramid.build(version.grid, rooms=version.labels)
    expected = {
        door.number: (door.rooms, door.position, pytest.approx(door.width_m), door.is_gap)
        for door in hn.TopologicalMap(pyramid).rooms.doors
    }
    assert expected == {
        n: (
            tuple(None if room < 0 else version.name_of(room) for room in door.rooms),
            door.position,
            door.width_m,
            door.is_gap,
        )
        for n, door in version.doors.items()
    }


def check_update(before, update, shift):
    """What an update states is what the cells show."""
    after = update.version
    rows, cols = before.grid.shape
    old, new = core_of(before), core_of(after)
    seen = new[shift[0] : shift[0] + rows, shift[1] : shift[1] + cols]
    had, has = set(before.numbers), set(after.numbers)
    assert set(update.died) == had - has
    assert set(update.born) == has - had
    assert min(update.born, default=max(had, default=0) + 1) > max(had, default=0)
    for room in had & has - set(update.changed):
        assert np.array_equal(old == room, seen == room)
        assert (new == room).sum() == (old == room).sum()
    for room in had:
        found, counts = np.unique(seen[old == room], return_counts=True)
        heirs = found[(2 * counts > (old == room).sum()) & (found >= 0)].tolist()
        assert heirs in ([room], []) if room in has else True
        assert update.merged.get(room) == (heirs[0] if heirs and room not in has else None)
        assert update.split.get(room, ()) == parts_of(found, counts, new)
    kept = {n: name for n, name in before.names.items() if n in has}
    assert after.names == kept
    assert update.lost_names == {n: name for n, name in before.names.items() if n not in has}
    born, died, changed, split, merged = update.doors
    assert set(died) == set(before.doors) - set(after.doors)
    assert set(born) == set(after.doors) - set(before.doors)
    for number in set(before.doors) & set(after.doors) - set(changed):
        one, other = before.doors[number], after.doors[number]
        assert one.rooms == other.rooms
        assert np.array_equal(one.cracks, other.cracks)
    owner_of = {int(crack): n for n, door in after.doors.items() for crack in door.cracks}
    for number, door in before.doors.items():
        owners = {owner_of[int(crack)] for crack in door.cracks if int(crack) in owner_of}
        assert split.get(number, ()) == (tuple(sorted(owners)) if len(owners) > 1 else ())
        is_part = number not in after.doors and len(owners) == 1
        assert merged.get(number) == (owners.pop() if is_part else None)


class Building(RuleBasedStateMachine):
    """A building in which doors open and close, walls appear and go, and that is explored."""

    @initialize(
        rows=st.integers(1, 3), cols=st.integers(1, 3), open_doors=st.integers(0, 2**12 - 1)
    )
    def start(self, rows, cols, open_doors):
        """Find the rooms of the first map, and name every second one."""
        self.classes, self.doors = floor_plan(rows, cols, open_doors)
        self.corner, self.had_rays = (0, 0), False
        self.version = OnlineRooms.of(grid_of(self.classes))
        for number in self.version.numbers[::2]:
            self.version = self.version.with_name(number, f"office {number}")

    def follow(self, classes, shift=(0, 0)):
        self.corner = self.corner[0] - shift[0], self.corner[1] - shift[1]
        before, cells = self.version, self.version.number_of.copy()
        update = before.update(grid_of(classes, self.corner))
        check_update(before, update, shift)
        assert np.array_equal(before.number_of, cells)
        self.classes, self.version = classes, update.version
        self.doors = [
            tuple(slice(at.start + by, at.stop + by) for at, by in zip(door, shift, strict=True))
            for door in self.doors
        ]

    @rule(data=st.data())
    def turn_a_door(self, data):
        """Close or open a door."""
        if self.doors:
            door = data.draw(st.sampled_from(self.doors))
            classes = self.classes.copy()
            classes[door] = 0 if classes[door].any() else 1
            self.follow(classes)

    @rule(data=st.data(), kind=st.sampled_from([0, 0, 1, 2]))
    def paint(self, data, kind):
        """Let a wall or a thing appear or go."""
        rows, cols = self.classes.shape
        low, left = data.draw(st.integers(0, rows - 1)), data.draw(st.integers(0, cols - 1))
        high, wide = data.draw(st.sampled_from([(1, 12), (12, 1), (2, 2), (6, 6), (14, 14)]))
        classes = self.classes.copy()
        classes[low : low + high, left : left + wide] = kind
        self.follow(classes)

    @rule(by=st.tuples(*[st.integers(0, 8)] * 4), kind=st.sampled_from([0, 1, 2]))
    def grow(self, by, kind):
        """Widen the map on any side."""
        south, north, west, east = by
        classes = np.pad(self.classes, ((south, north), (west, east)), constant_values=kind)
        if classes.size <= 3000:
            self.follow(classes, (south, west))

    @rule()
    def nothing(self):
        """Look again and see the same."""
        before = self.version
        self.follow(self.classes.copy())
        assert np.array_equal(self.version.number_of, before.number_of)

    @invariant()
    def the_version_is_sound(self):
        """Check the newest version."""
        if hasattr(self, "version"):
            self.had_rays |= pockets_of(self.version.grid)[1].any()
            check_version(self.version, had_rays=self.had_rays)


def test_rooms_follow_a_building():
    run_machine(Building, examples(12), 8, derandomize=True, phases=[Phase.generate])


@pytest.mark.full
def test_rooms_follow_a_building_for_2000_steps():
    run_machine(Building, 100, 20)


def two_rooms():
    """Two rooms with a door of three cells between them."""
    classes, doors = floor_plan(1, 2, 1)
    return classes, doors[0], OnlineRooms.of(grid_of(classes))


def test_a_door_that_closes_dies_and_rooms_keep_numbers_and_names():
    classes, door, version = two_rooms()
    version = version.with_name(2, "kitchen")
    classes[door] = 0
    update = version.update(grid_of(classes))
    assert (update.born, update.died) == ((), ())
    assert update.doors.died == tuple(version.doors)
    assert update.version.labels.names == ("room-1", "kitchen")
    assert update.closed_doors(version.doors) == ((), tuple(version.doors))
    classes[door] = 1
    again = update.version.update(grid_of(classes))
    assert again.doors.born == (max(version.doors) + 1,)


def test_a_door_is_as_wide_as_walls_leave_it_that_appear_in_no_room():
    classes, door, _ = two_rooms()
    jambs = [door[0].start - 1, door[0].stop], SIDE + 1
    classes[jambs] = 2
    version = OnlineRooms.of(grid_of(classes))
    classes[jambs] = 0
    update = version.update(grid_of(classes))
    assert (update.born, update.died, update.changed) == ((), (), ())
    assert [door.passage_m for door in version.doors.values()] == [1.25]
    assert [door.passage_m for door in update.version.doors.values()] == [0.75]
    check_version(update.version)


def test_rooms_whose_wall_goes_merge_and_the_lost_name_is_returned():
    classes, _, version = two_rooms()
    version = version.with_name(1, "kitchen").with_name(2, "hall")
    classes[1:-1, SIDE + 1] = 1
    update = version.update(grid_of(classes))
    (died,) = update.died
    (left,) = update.version.numbers
    assert update.merged == {died: left}
    assert update.lost_names == {died: version.names[died]}
    assert update.version.names == {left: version.names[left]}


def test_a_closet_stays_a_room_while_those_round_it_come_and_go():
    closets = np.pad(np.tile(np.pad(np.ones((4, 4), np.uint8), (0, 2)), (3, 3)), (2, 0))
    version = OnlineRooms.of(grid_of(closets))
    assert len(version.numbers) == 9
    for kind in (0, 1):
        closets[14:18, 2:6] = kind
        version = version.update(grid_of(closets)).version
        check_version(version)
    assert len(version.numbers) == 9


def test_only_pockets_among_rays_may_differ_from_a_build():
    """Rays too small for a room are such pockets; none is where no cell is unexplored."""
    classes = np.full((30, 40), 2, np.uint8)
    classes[2:12, 2:38] = classes[15:17, 2:9] = classes[20:26, 2:20:2] = 1
    classes[1, 2:14] = 0
    _, pockets = pockets_of(grid_of(classes))
    assert pockets[20:26, 2:20:2].all()
    assert not pockets[:20].any()
    classes[classes == 2] = 0
    assert not pockets_of(grid_of(classes))[1].any()


def test_a_new_wall_parts_a_room_and_the_larger_part_keeps_number_and_name():
    classes = np.pad(np.ones((10, 20), np.uint8), 1)
    version = OnlineRooms.of(grid_of(classes)).with_name(1, "hall")
    classes[:, 8] = 0
    update = version.update(grid_of(classes))
    assert update.split == {1: (1, 2)}
    assert update.version.number_of[5, 15] == 1
    assert update.version.name_of(1) == "hall"
    assert (update.born, update.changed, update.lost_names) == ((2,), (1,), {})


def test_a_closed_door_that_a_post_parts_stays_closed_on_both_sides():
    classes, door, version = two_rooms()
    classes[door[0].start + 1, door[1].start] = 0
    update = version.update(grid_of(classes))
    kept, lost = update.closed_doors([1])
    assert kept == update.doors.split[1] == tuple(update.version.doors)
    assert (len(kept), lost) == (2, ())


def test_a_closed_door_that_becomes_part_of_a_wider_one_is_returned_with_that():
    classes, door, _ = two_rooms()
    classes[door[0].start + 1, door[1].start] = 0
    version = OnlineRooms.of(grid_of(classes))
    assert len(version.doors) == 2
    classes[door] = 1
    update = version.update(grid_of(classes))
    (died,), (left,) = update.doors.died, update.version.doors
    assert update.doors.merged == {died: left}
    assert update.closed_doors(version.doors) == ((left,), (died,))


def test_closed_doors_are_closed_for_planners_by_the_same_numbers():
    _, _, version = two_rooms()
    rooms = version.labels
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(version.grid, rooms=rooms))
    planner = hn.HybridPlanner(topology)
    goal = (4.0, 1.0)
    assert planner.plan((1.0, 1.0), goal).status.name == "SOLVED"
    shut = planner.plan((1.0, 1.0), goal, blocked=hn.Blocked(doors=tuple(version.doors)))
    assert shut.status.name == "NO_PATH"


def test_rooms_read_from_a_file_keep_their_names_points_and_doors():
    classes, _ = floor_plan(1, 2, 1)
    label_of = np.zeros(classes.shape, np.int32)
    label_of[:, SIDE + 1 :] = 1
    labels = hn.RoomLabels(("room-2", "hall"), label_of, {"dock": (0.5, 0.5)}, {5: (2.5, 0.9)})
    version = OnlineRooms.of(grid_of(classes), labels)
    assert (version.numbers, version.names) == ((1, 2), {1: "hall"})
    assert list(version.doors) == [5]
    classes[3, 3] = 0
    after = version.update(grid_of(classes)).version
    assert after.labels.names == ("hall", "room-2")
    assert after.labels.points == {"dock": (0.5, 0.5)}
    assert list(after.doors) == [5]


def test_rooms_of_every_version_can_be_written_and_read(tmp_path):
    """The outlines of the file hold furniture and walls; rooms are born, die, and come back."""
    path = tmp_path / "rooms.yaml"
    outline = "polygon: [[{0}, 0.25], [{1}, 0.25], [{1}, 5], [{0}, 5]]"
    names = "".join(
        f"- name: {name}\n  {outline.format(low, high)}\n"
        for name, low, high in (("kitchen", 0.25, 5), ("hall", 5, 10))
    )
    path.write_text(f"rooms:\n{names}")
    plain = np.zeros((21, 41), np.uint8)
    plain[1:20, 1:20] = plain[1:20, 21:40] = 1
    plain[8:11, 20] = 1
    plain[12:19, 2:9] = 0  # a block of shelves
    shut, halves = plain.copy(), plain.copy()
    shut[:, :20] = 0
    halves[10, 21:40] = 0
    rooms = OnlineRooms.of(grid_of(plain), hn.load_rooms(path, grid_of(plain)))
    born = 0
    for classes in (halves, shut, plain, halves, plain):
        update = rooms.update(grid_of(classes))
        rooms, born = update.version, born + len(update.born)
        free = rooms.grid.measured == hn.CellClass.FREE
        assert set(rooms.numbers) == set(np.unique(rooms.number_of[free])) - {-1}
        assert not set(update.died) & set(rooms.numbers)
        hn.save_rooms(path, rooms.labels, rooms.grid)
        again = hn.load_rooms(path, rooms.grid)
        assert again.names == rooms.labels.names
        assert (again.label_of == rooms.labels.label_of).all()
        numbers = hn.TopologicalMap(hn.DualGraphPyramid.build(rooms.grid, rooms=again)).rooms
        assert {d.number: d.position for d in numbers.doors} == {
            n: door.position for n, door in rooms.doors.items()
        }
        rooms = OnlineRooms.of(rooms.grid, again)
    assert born >= 2
    with pytest.raises(InvalidValueError, match="give the grid of that version"):
        hn.save_rooms(path, rooms.labels, grid_of(np.ones((5, 5), np.uint8)))


def test_rooms_of_an_office_stay_close_to_those_of_a_build():
    office = hn.load_map(OFFICE, robot_radius_m=0)
    version = OnlineRooms.of(office)
    for classes, _ in random_changes(office, 6):
        grid = OccupancyGrid(PROBABILITY[classes], office.frame, robot_radius_m=0)
        version = version.update(grid).version
    assert agreement(version) > 0.9


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda rooms: rooms.name_of(9), "there is no room 9"),
        (lambda rooms: rooms.with_name(9, "x"), "there is no room 9"),
        (lambda rooms: rooms.with_name(1, ""), "name"),
        (lambda rooms: rooms.with_name(1, "room-2"), "choose another name"),
        (lambda rooms: rooms.with_name(1, "hall").with_name(2, "hall"), "names that differ"),
        (lambda rooms: rooms.update(grid_of(np.ones((3, 3), int))), "does not cover"),
        (lambda rooms: rooms.update(grid_of(np.ones((30, 30), int), resolution_m=1)), "anew"),
        (lambda rooms: rooms.update(rooms.grid).closed_doors([7]), "there was no door 7"),
        (lambda rooms: OnlineRooms.of(grid_of(np.ones((3, 3), int)), rooms.labels), "this map"),
        (lambda rooms: OnlineRooms.of(rooms.grid, WRONG), "labels is 'rooms.yaml'"),
        (lambda rooms: OnlineRooms.of(rooms.grid, least_area_m2=-1), "least area"),
        (lambda rooms: OnlineRooms.of(rooms.grid, rooms.labels, least_area_m2=-1), "least area"),
        (lambda rooms: OnlineRooms.of(rooms.grid, least_area_m2=WRONG), "got 'rooms.yaml'"),
        (lambda rooms: rooms.update(rooms.grid).closed_doors(WRONG), "there was no door 'r'"),
        (lambda rooms: rooms.update(rooms.grid).closed_doors(NOTHING), "no door None"),
        (lambda rooms: rooms.update(rooms.grid).closed_doors([1, "x"]), "no door 'x'"),
        (lambda rooms: rooms.update(rooms.grid).closed_doors([[1]]), r"no door \[1\]"),
    ],
)
def test_wrong_arguments_end_in_one_line(ask, message):
    _, _, version = two_rooms()
    with pytest.raises(InvalidValueError, match=message) as error:
        ask(version)
    assert "\n" not in str(error.value)
