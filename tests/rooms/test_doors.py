"""Doors keep their numbers by radius, seed, merge distance and file; their widths and places."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.maps import CellClass, RoomLabels
from hybridnav.rooms.files.paint import without_slivers
from hybridnav.viz import plot_rooms
from tests.drawn_rooms import write_ros
from tests.rooms.test_room_level import named
from tests.strategies import drawn, labelled, occupancy_grid, tried

# A closet with a door of one cell beside a hall with a door of three and a pillar in the lab's.
FLAT = drawn(
    "###################",
    "#.....#.....#.....#",
    "#.....#.....#.....#",
    "#...........#.....#",
    "#.....#...........#",
    "#.....#.....#.....#",
    "#.....#.....#.....#",
    "###################",
)
SIDE = 0.3


def flat(radius_m=0.0):
    """Three rooms in a row, and the doors of one cell between them; cells of 30 cm."""
    label_of = np.full(FLAT.shape, -1, dtype=np.int32)
    for room, left in enumerate((1, 7, 13)):
        label_of[1:7, left : left + 5] = room
    label_of[4, 6], label_of[3, 12] = 0, 1
    grid = occupancy_grid(FLAT, resolution_m=SIDE)
    rooms = RoomLabels(("kitchen", "hall", "lab"), label_of)
    return replace(grid, robot_radius_m=radius_m), rooms


def rooms_of(grid, labels, **settings):
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels, **settings)).rooms


def identity(rooms):
    """What a door is, whatever the robot."""
    return [(door.number, door.rooms, door.position, door.width_m) for door in rooms.doors]


def oracle(measured, label_of):
    """Sets of cracks, as pairs of cells, joined in full 2x2 blocks that hold exactly two."""
    rows, cols = measured.shape

    def kind(cell):
        return int(measured[cell]), int(label_of[cell])

    def is_crack(pair):
        return all(measured[cell] != CellClass.OCCUPIED for cell in pair) and (
            kind(pair[0]) != kind(pair[1])
        )

    cells = list(itertools.product(range(rows), range(cols)))
    pairs = [((r, c), (r, c + 1)) for r, c in cells if c + 1 < cols]
    pairs += [((r, c), (r + 1, c)) for r, c in cells if r + 1 < rows]
    root = {pair: pair for pair in pairs if is_crack(pair)}

    def find(pair):
        while root[pair] != pair:
            pair = root[pair]
        return pair

    for r, c in itertools.product(range(rows - 1), range(cols - 1)):
        a, b, d, e = (r, c), (r, c + 1), (r + 1, c), (r + 1, c + 1)
        if (measured[r : r + 2, c : c + 2] == CellClass.OCCUPIED).any():
            continue
        held = [pair for pair in ((a, b), (d, e), (a, d), (b, e)) if pair in root]
        if len(held) == 2:
            root[find(held[0])] = find(held[1])
    classes: dict[Any, set[Any]] = {}
    for pair in root:
        if all(measured[cell] == CellClass.FREE for cell in pair):
            classes.setdefault(find(pair), set()).add(pair)
    return list(classes.values())


@tried(
    25,
    scene=labelled(),
    radius=st.sampled_from([1.0, 1.5, 2.3]),
    seed=st.integers(0, 3),
    merge_distance_m=st.sampled_from([1.5, 30.0]),
)
def test_doors_are_the_boundaries_as_measured_whatever_the_robot(
    scene, radius, seed, merge_distance_m
):
    classes, labels = scene
    grid = occupancy_grid(classes)
    plain = rooms_of(grid, labels)
    robot = replace(grid, robot_radius_m=radius)
    rooms = rooms_of(robot, labels, seed=seed, merge_distance_m=merge_distance_m)
    assert identity(rooms) == identity(plain)
    assert [door.number for door in rooms.doors] == list(range(1, len(rooms.doors) + 1))
    boundaries = oracle(classes, labels.label_of)
    assert len(rooms.doors) == len(boundaries)
    free = robot.classes == CellClass.FREE
    found = []
    for door in rooms.doors:
        cracks = [
            {tuple(sorted(map(tuple, pair))) for pair in rooms.level.boundary(arc.index).tolist()}
            for arc in door.arcs
        ]
        at = np.asarray(door.position)
        (own,) = [b for b in boundaries if any(np.allclose(_middle(pair), at) for pair in b)]
        found.append(id(own))
        # Its arcs are what the robot can cross of it, each part once.
        crossable = {pair for pair in own if free[pair[0]] and free[pair[1]]}
        assert set().union(*cracks) == crossable
        assert sum(map(len, cracks)) == len(crossable)
        assert door.passable == bool(crossable)
        names = {rooms.name_of(int(labels.label_of[cell])) for cell in next(iter(own))}
        assert set(door.rooms) == names
    assert len(set(found)) == len(found)


def _middle(pair):
    return (np.array(pair[0]) + np.array(pair[1]))[::-1] / 2 + 0.5


def test_a_door_is_found_by_its_number():
    grid, labels = flat()
    rooms = rooms_of(grid, labels)
    assert [rooms.door(n) for n in (1, 2)] == list(rooms.doors)
    with pytest.raises(hn.errors.InvalidValueError, match="number 39: the doors are 1-2"):
        rooms.door(39)
    alone = rooms_of(grid, RoomLabels(("a",), np.zeros(FLAT.shape, dtype=np.int32)))
    with pytest.raises(hn.errors.InvalidValueError, match="no doors"):
        alone.door(1)


def test_gaps_are_numbered_after_the_doors():
    classes = drawn("#######", "#.....#", "###.###", "#.....#", "#.....#", "#.....#", "#######")
    labels = np.zeros(classes.shape, dtype=np.int32)
    labels[1:4, :3], labels[1:4, 3:] = 0, 1
    labels[4:] = 2
    rooms = rooms_of(
        occupancy_grid(classes, resolution_m=0.25), RoomLabels(("a", "b", "c"), labels)
    )
    assert [door.is_gap for door in rooms.doors] == sorted(door.is_gap for door in rooms.doors)
    assert any(door.is_gap for door in rooms.doors)
    assert "below 0.3 m" in rooms.counted()[2]


def test_a_door_that_is_too_narrow_for_the_robot_is_listed_as_such():
    grid, labels = flat(radius_m=0.4)
    rooms = rooms_of(grid, labels)
    assert [door.passable for door in rooms.doors] == [False, False]
    assert rooms.counted()[:2] == (
        "3 rooms",
        "2 doors, 2 of them too narrow for a robot 0.8 m wide",
    )
    ax = plot_rooms(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels)))
    assert "2 doors, 2 of them too narrow for a robot 0.8 m wide" in ax.get_title().replace(
        "\n", " "
    )
    (hollow,) = [line for line in ax.lines if line.get_gid() == "narrow-doors"]
    at = np.column_stack(hollow.get_data())
    assert np.allclose(at, [door.position for door in rooms.doors])


def test_a_room_that_the_robot_does_not_fit_in_stays_a_room(tmp_path):
    classes = drawn("##########", "#.....##.#", "#........#", "#.....##.#", "##########")
    label_of = np.zeros(classes.shape, dtype=np.int32)
    label_of[:, 7:] = 1
    labels = RoomLabels(("hall", "shaft"), label_of)
    grid = replace(occupancy_grid(classes, resolution_m=0.5), robot_radius_m=0.5)
    hn.save_rooms(tmp_path / "rooms.yaml", labels, grid)
    rooms = rooms_of(grid, hn.load_rooms(tmp_path / "rooms.yaml", grid))
    assert rooms.fits.tolist() == [True, False]
    assert rooms.areas_m2.tolist() == [4.0, 1.0]
    assert rooms.labels.label_of[grid.frame.cell_of(*rooms.point_of("shaft"))] == 1
    (door,) = rooms.doors
    assert (door.rooms, door.passable) == (("hall", "shaft"), False)
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels)))
    with pytest.raises(
        hn.errors.InvalidValueError, match="room 'shaft' has no free cell for this robot"
    ):
        planner.plan("hall", "shaft")


def by_number(rooms):
    return {door.number: set(door.rooms) for door in rooms.doors}


RADII_M = (0.0, 0.25, 0.4)


def round_trip(grid, labels, folder, radii_m=RADII_M):
    """The rooms of a file, and its file written once more; both for some robots."""
    before = by_number(rooms_of(grid, labels))
    hn.save_rooms(folder / "a.yaml", labels, grid)
    first = hn.load_rooms(folder / "a.yaml", grid)
    hn.save_rooms(folder / "b.yaml", first, grid)
    for radius_m, name in itertools.product(radii_m, "ab"):
        robot = replace(grid, robot_radius_m=radius_m)
        read = rooms_of(robot, hn.load_rooms(folder / f"{name}.yaml", robot))
        assert read.names == labels.names
        yield read, before


@pytest.mark.parametrize(
    ("name", "radii_m"),
    [
        ("figure1/figure1.yaml", RADII_M),
        ("office/office.yaml", (0.25,)),
        pytest.param("office/office.yaml", (0.0, 0.4), marks=pytest.mark.full),
    ],
)
def test_doors_and_rooms_keep_their_names_in_files(name, radii_m, tmp_path):
    grid = hn.load_map(f"maps/{name}")
    for read, before in round_trip(grid, hn.find_rooms(grid), tmp_path, radii_m):
        assert by_number(read) == before


@pytest.mark.full
@pytest.mark.parametrize(
    "name",
    [
        "aws_small_house/map.yaml",
        "bwi_gdc/3ne/3ne.yaml",
        "willow/willow-2010-02-18-0.10.yaml",
        "radish_grids/freiburg-101.yaml",
    ],
)
def test_a_number_never_goes_to_a_door_of_other_rooms(data, name, tmp_path):
    grid = hn.load_map(data / name)
    seen = []
    for read, before in round_trip(grid, hn.find_rooms(grid), tmp_path):
        found = by_number(read)
        assert all(before[number] == found[number] for number in before.keys() & found.keys())
        seen.append(identity(read))
    # Every robot; the second file was drawn from the first, so its outlines may differ again.
    assert seen[0] == seen[2] == seen[4]
    assert seen[1] == seen[3] == seen[5]


@tried(15, scene=labelled(), shift=st.integers(0, 50))
def test_numbers_that_are_known_survive_any_file(tmp_path_factory, scene, shift):
    classes, labels = scene
    grid = occupancy_grid(classes)
    doors = {d.number + shift: d.position for d in rooms_of(grid, labels).doors}
    known = RoomLabels(labels.names, labels.label_of, doors=doors)
    assert [d.number for d in rooms_of(grid, known).doors] == sorted(doors)
    path = tmp_path_factory.mktemp("doors") / "rooms.yaml"
    try:
        hn.save_rooms(path, known, grid)
    except hn.errors.RoomsError:
        return  # a room without a cell
    first = rooms_of(grid, hn.load_rooms(path, grid))
    hn.save_rooms(path, first.labels, grid)
    again = rooms_of(grid, hn.load_rooms(path, grid))
    same = [d for d in first.doors if d.position in {e.position for e in again.doors}]
    assert [again.door(door.number).rooms for door in same] == [door.rooms for door in same]


DOORS = "doors:\n  7: [1.95, 1.35]\n  9: [0.5, 0.5]\n"
OLDER = "doors:\n- {number: 7, point: [1.95, 1.35]}\n- {number: 9, point: [0.5, 0.5]}\n"


@pytest.mark.parametrize("doors", [DOORS, OLDER])
def test_a_file_edited_by_hand_keeps_the_doors_that_it_knows(tmp_path, doors):
    grid, labels = flat()
    path = tmp_path / "rooms.yaml"
    hn.save_rooms(path, labels, grid)
    text = path.read_text().replace("name: hall", "name: parlour")
    head, _ = text.split("doors:")
    path.write_text(head + doors)
    rooms = rooms_of(grid, hn.load_rooms(path, grid))
    # 9 is no door any more, so that nothing else is called it.
    assert by_number(rooms) == {7: {"kitchen", "parlour"}, 10: {"parlour", "lab"}}
    hn.save_rooms(path, rooms.labels, grid)
    assert by_number(rooms_of(grid, hn.load_rooms(path, grid))) == by_number(rooms)
    path.write_text(head)
    assert sorted(by_number(rooms_of(grid, hn.load_rooms(path, grid)))) == [1, 2]


def test_slivers_that_outlines_leave_over_go_to_the_room_beside_them():
    label_of = np.full((20, 30), -1, dtype=np.int32)
    label_of[:, :14], label_of[:, 15:24] = 0, 1  # a strip of 5 cm, and a space of 0.3 m2
    label_of[8:12, 24:] = 1
    grid = occupancy_grid(np.ones((20, 30), dtype=np.uint8), resolution_m=0.05)
    assert (without_slivers(label_of, grid, {1}) >= 0).all()
    assert (without_slivers(label_of, grid, set()) == label_of).all()  # nobody has drawn them
    coarse = occupancy_grid(np.ones((20, 30), dtype=np.uint8), resolution_m=0.5)
    assert (without_slivers(label_of, coarse, {1}) == label_of).all()


@pytest.fixture
def map_file(tmp_path):
    """Three rooms in a row as a ROS map, with their file beside it."""
    grid, labels = flat()
    hn.save_rooms(tmp_path / "rooms.yaml", labels, grid)
    return write_ros(tmp_path, "flat", np.where(FLAT == 0, 0, 254), SIDE)


def test_list_picture_file_json_and_words_tell_the_same_doors(cli, map_file, tmp_path):
    out = tmp_path / "again.yaml"
    query = ("rooms", map_file, "--rooms", tmp_path / "rooms.yaml", "--robot-radius")
    told = cli(*query, "0.4", "-o", out, "--plot", tmp_path / "rooms.svg").out
    assert "rooms      3; 2 doors, 2 of them too narrow for a robot 0.8 m wide" in told
    assert "hall (2: 0.30 m, too narrow)" in told
    assert 'id="narrow-doors"' in (tmp_path / "rooms.svg").read_text()
    wide = cli("rooms", map_file, "--rooms", out, "--robot-radius", "0", "--json").answer
    narrow = cli(*query, "0.4", "--json").answer
    assert not any(door["is_gap"] for door in wide["doors"])
    assert [door.pop("passable") for door in wide["doors"]] == [True, True]
    assert [door.pop("passable") for door in narrow["doors"]] == [False, False]
    assert wide["doors"] == narrow["doors"]
    assert [door["number"] for door in wide["doors"]] == [1, 2]
    assert [room["area_m2"] for room in wide["rooms"]] == pytest.approx([2.79, 2.79, 2.7])
    path = cli(
        "plan", map_file, "--from", "kitchen", "--to", "lab", "--robot-radius", "0", "--json"
    )
    for leg in path.answer["legs"]:
        if leg["door"] is not None:
            (door,) = [door for door in wide["doors"] if door["number"] == leg["door"]]
            assert leg["door_m"] == pytest.approx(door["position_m"])
            assert leg["room"] in door["rooms"]


def test_a_room_that_does_not_fit_is_marked_in_the_list(cli, map_file):
    rooms_file = map_file.parent / "rooms.yaml"
    slit = "[[3.6, 0.3], [3.9, 0.3], [3.9, 2.1], [3.6, 2.1]]"
    corners = {"kitchen": "[[0.3, 0.3], [1.8, 0.3], [1.8, 2.1], [0.3, 2.1]]", "slit": slit}
    rooms_file.write_text(
        "rooms:\n" + "".join(f"- name: {n}\n  polygon: {ring}\n" for n, ring in corners.items())
    )
    query = (map_file, "--rooms", rooms_file, "--robot-radius", "0.65")
    done = cli("rooms", *query)
    assert "rooms      2, 1 of them too small for a robot 1.3 m wide" in done.out
    (line,) = [line for line in done.out.splitlines() if line.startswith("slit")]
    assert "no robot 1.3 m wide fits" in line
    path = cli("plan", *query, "--from", "kitchen", "--to", "slit")
    assert path.refuses(2, "'slit'", "no free cell for this robot radius")


def test_no_listed_area_is_below_the_one_that_was_asked_for(cli, map_file):
    query = ("rooms", map_file, "--least-area", "2.7", "-o", map_file.parent / "found.yaml")
    found = cli(*query, "--robot-radius", "0.25", "--json").answer["rooms"]
    assert found
    assert min(room["area_m2"] for room in found) >= 2.7


RESOLUTION_M = 0.1


def doors_of(free, label_of):
    grid = occupancy_grid(free.astype(np.uint8), resolution_m=RESOLUTION_M)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=named(label_of))
    return hn.TopologicalMap(pyramid).rooms.doors


def bay(width):
    """A corridor of 2 m x 20 m, and a bay over it that is open along its side."""
    free = np.zeros((64, 204), dtype=bool)
    free[2:22, 2:202] = True
    label_of = np.where(free, 0, -1)
    free[22:62, 60 : 60 + width], label_of[22:62, 60 : 60 + width] = True, 1
    return free, label_of


def test_an_opening_is_as_wide_as_it_is_though_the_corridor_before_it_is_narrow():
    (opening,) = doors_of(*bay(75))
    assert opening.width_m == pytest.approx(7.5)
    assert opening.position == pytest.approx((9.75, 2.2), abs=0.06)
    assert (opening.kind, opening.is_opening) == ("opening", True)
    assert opening.passage_m < 5.0


@pytest.mark.parametrize(("width", "kind"), [(9, "door"), (20, "door"), (23, "opening")])
def test_a_passage_of_more_than_2_m_is_no_door(width, kind):
    (found,) = doors_of(*bay(width))
    assert found.width_m == pytest.approx(width * RESOLUTION_M)
    assert found.kind == kind


def test_an_outline_that_lies_before_its_door_makes_the_door_no_wider():
    free, label_of = bay(10)
    label_of[21, 40:90] = 1  # drawn a cell too far, along the wall on both sides of the door
    (door,) = doors_of(free, label_of)
    assert door.width_m == pytest.approx(1.0, abs=0.25)
    assert door.kind == "door"


def test_rooms_that_meet_in_the_open_have_no_door_between_them():
    free = np.zeros((64, 64), dtype=bool)
    free[2:62, 2:62] = True
    label_of = np.where(free, 0, -1)
    label_of[2:22, 25:40] = 1
    label_of[22:40, 25:40] = 2
    between = [d for d in doors_of(free, label_of) if d.rooms in {("r1", "r2"), ("r2", "r1")}]
    assert [door.kind for door in between] == ["opening"]
    assert between[0].width_m == pytest.approx(1.5)


def test_lists_and_pictures_tell_doors_from_openings():
    free, label_of = bay(75)
    free[22, 20:29], label_of[22, 20:29] = True, 2
    free[23:62, 10:50], label_of[23:62, 10:50] = True, 2
    grid = occupancy_grid(free.astype(np.uint8), resolution_m=RESOLUTION_M)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=named(label_of)))
    assert topology.rooms.counted()[1] == "1 door, 1 opening"
    drawn = {line.get_gid(): line for line in plot_rooms(topology).lines}
    positions = {door.kind: door.position for door in topology.rooms.doors}
    for kind in ("door", "opening"):
        assert np.asarray(drawn[f"{kind}s"].get_xydata())[0] == pytest.approx(positions[kind])
    assert drawn["doors"].get_marker() != drawn["openings"].get_marker()


def hall_beside(posts):
    """A hall of 8 m x 4 m beside a corridor; between both an opening with some posts in it."""
    free = np.zeros((64, 104), dtype=bool)
    free[2:22, 2:102] = True
    free[22:62, 10:90] = True
    free[22, 10:90] = ~np.isin(np.arange(80) // 2, list(posts))
    label_of = np.where(free, 0, -1)
    label_of[22:62][free[22:62]] = 1
    return free, label_of


def test_posts_in_a_wide_opening_make_no_doors_of_it():
    found = doors_of(*hall_beside(range(0, 40, 5)))
    assert len(found) == 8
    assert all(door.width_m == pytest.approx(0.8) for door in found[:-1])
    assert {door.kind for door in found} == {"opening"}


def test_two_doors_beside_each_other_and_doors_along_a_wall_stay_doors():
    wall = set(range(40))
    near = doors_of(*hall_beside(wall - {10, 11, 12, 13, 17, 18, 19, 20}))
    assert [door.kind for door in near] == ["door", "door"]
    apart = doors_of(*hall_beside(wall - {1, 2, 3, 4, 13, 14, 15, 16, 25, 26, 27, 28, 35, 36, 37}))
    assert [door.kind for door in apart] == ["door"] * 4


@pytest.mark.parametrize("beside", [[(27, 30)], [(20, 24), (24, 41)]])
def test_an_object_beside_a_border_in_the_open_makes_no_door_of_it(beside):
    free = np.zeros((64, 64), dtype=bool)
    free[2:62, 2:62] = True
    for row, col in beside:
        free[row, col] = False
    label_of = np.where(free, 0, -1)
    label_of[2:22, 25:40][free[2:22, 25:40]] = 1
    label_of[22:40, 25:40][free[22:40, 25:40]] = 2
    between = [d for d in doors_of(free, label_of) if set(d.rooms) == {"r1", "r2"}]
    assert [door.kind for door in between] == ["opening"]
