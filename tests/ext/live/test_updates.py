"""Versions of a pyramid after changes of the map: every invariant, identities, growth."""

import copy
import itertools
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule

import hybridnav as hn
from benchmarks.common import OFFICE, with_classes
from benchmarks.subjects.online import area_of, random_changes
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live import OnlinePyramid, state
from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.pyramid.cracks import find_cracks
from tests.ext.live.identities import check_identities, run_machine
from tests.oracle.checks import check_base, check_cap, check_level, check_step, passes
from tests.oracle.pyramid import Base
from tests.strategies import class_grids, drawn, examples, occupancy_grid, seeds

MOST_CELLS = 900


def version_of(classes, *, merge_distance_m=4.0):
    grid = occupancy_grid(classes)
    return OnlinePyramid.of(hn.DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m))


def check_version(version):
    """Every invariant of every level, by the oracle's reading of the labels alone."""
    pyramid, classes = version.pyramid, version.grid.classes
    base = Base.of(classes)
    levels = list(pyramid)
    check_base(levels[0], base)
    cap = {"limit_m": version.merge_distance_m, "resolution_m": version.grid.resolution_m}
    for level in levels:
        check_level(level, base)
        check_cap(level, linkage="radius", **cap)
    for lower, upper in itertools.pairwise(levels):
        check_step(lower, upper)
    parts = version.state.places.read(version.place_numbers)["part"]
    assert not passes(levels[-1], linkage="radius", parts=parts, **cap).any()
    sizes = [(level.n_vertices, level.n_arcs) for level in levels]
    assert sizes == [(size.vertices, size.arcs) for size in pyramid.stats.sizes]


def numbers_of(version):
    numbers = np.append(version.place_numbers, -1)
    return numbers[version.pyramid[-1].field_of]


def check_events(before, update, shift=(0, 0)):
    """What an update states about places is what the cells show."""
    old, new = numbers_of(before), numbers_of(update.version)
    rows, cols = old.shape
    classes = np.zeros(new.shape, np.uint8)
    classes[shift[0] : shift[0] + rows, shift[1] : shift[1] + cols] = before.grid.classes
    differs = update.version.grid.classes != classes
    assert np.array_equal(update.cells, np.argwhere(differs))
    had, has = set(before.place_numbers.tolist()), set(update.version.place_numbers.tolist())
    check_identities(update, (had, has), (old, new), shift)


def unread(version):
    """Return a copy of a version of which nothing was read."""
    again = copy.copy(version)
    for name in [name for name in vars(again) if name not in version.__dataclass_fields__]:
        vars(again).pop(name)
    return again


class Robot(RuleBasedStateMachine):
    """A map that changes and grows while a pyramid follows it."""

    old: Sequence[Any] = ()
    """The version before, and the number of the place of each of its cells."""

    @initialize(
        classes=class_grids(14),
        merge_distance_m=st.sampled_from([1.5, 2.0, 3.0, 4.0, 5.0, 8.0, 13.0, 40.0]),
    )
    def start(self, classes, merge_distance_m):
        """Build the first version."""
        self.classes, self.origin = classes, (0.0, 0.0)
        self.version = version_of(classes, merge_distance_m=merge_distance_m)

    def follow(self, classes, *, changed, shift=(0, 0)):
        self.origin = self.origin[0] - shift[1], self.origin[1] - shift[0]
        frame = Frame(origin_m=self.origin)
        grid = OccupancyGrid(occupancy_grid(classes).probability, frame, robot_radius_m=0)
        self.old = [(self.version, numbers_of(self.version))]
        if isinstance(changed, tuple):
            changed = area_of(frame, changed[:2], changed[2:])
        update = self.version.update(grid, changed=changed)
        check_events(self.version, update, shift)
        self.classes, self.version = classes, update.version

    @rule(data=st.data(), kind=st.sampled_from([0, 1, 1, 2]), noisy=st.booleans())
    def paint(self, data, kind, noisy):
        rows, cols = self.classes.shape
        low, high = sorted(data.draw(st.integers(0, rows - 1)) for _ in range(2))
        left, right = sorted(data.draw(st.integers(0, cols - 1)) for _ in range(2))
        high, right = min(high, low + 7), min(right, left + 7)
        classes = self.classes.copy()
        painted = classes[low : high + 1, left : right + 1]
        if noisy:
            rng = np.random.default_rng(data.draw(seeds))
            painted[:] = rng.integers(0, 3, painted.shape)
        else:
            painted[:] = kind
        self.follow(classes, changed=(low, left, high + 1, right + 1))

    @rule(by=st.tuples(*[st.integers(0, 3)] * 4), kind=st.sampled_from([0, 1, 2]))
    def grow(self, by, kind):
        """Widen the map on any side."""
        south, north, west, east = by
        classes = np.pad(self.classes, ((south, north), (west, east)), constant_values=kind)
        if classes.size <= MOST_CELLS:
            none = np.zeros(classes.shape, dtype=bool)
            self.follow(classes, changed=none, shift=(south, west))

    @rule()
    def swap(self):
        """Explore what was unexplored, and the reverse."""
        swapped = np.array([0, 2, 1], np.uint8)[self.classes]
        self.follow(swapped, changed=None)

    @invariant()
    def every_level_is_sound(self):
        """Check the newest version."""
        if hasattr(self, "version"):
            assert np.array_equal(self.version.grid.classes, self.classes)
            check_version(self.version)

    @invariant()
    def the_version_before_is_as_it_was(self):
        """An update leaves the older version alone."""
        for version, numbers in self.old:
            assert np.array_equal(numbers_of(unread(version)), numbers)


def test_versions_follow_a_map():
    run_machine(Robot, examples(20), 8, derandomize=True)


def test_versions_follow_a_map_in_groups_of_changes(monkeypatch):
    monkeypatch.setattr(state, "_SMALL_CELLS", 0)
    run_machine(Robot, examples(20), 8, derandomize=True)


@pytest.mark.full
def test_versions_follow_a_map_for_10_000_steps():
    run_machine(Robot, 200, 50)


@pytest.mark.full
def test_a_thousand_updates_of_an_office_keep_places_as_many_as_a_fresh_build_makes():
    office = hn.load_map(OFFICE, robot_radius_m=0.25)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(office))
    for at, (classes, box) in enumerate(random_changes(office, 1000), start=1):
        version = version.update(with_classes(office, classes), changed=box).version
        if at % 25 == 0:
            level = version.pyramid[-1]
            rows, cols = classes.shape
            _, boundary = find_cracks(level.field_of.ravel(), rows, cols)
            assert len(np.unique(boundary)) == (~level.is_self_loop).sum()
            fresh = hn.DualGraphPyramid.build(version.grid)
            assert version.n_places == pytest.approx(fresh[-1].n_vertices, rel=0.15)


def test_places_that_no_change_touches_keep_cells_levels_and_arcs():
    classes = np.ones((24, 60), np.uint8)
    version = version_of(classes)
    classes[10, 4] = 0
    after = version.update(occupancy_grid(classes), changed=(4, 10, 5, 11)).version
    old, new = version.pyramid, after.pyramid
    far = np.zeros(classes.shape, dtype=bool)
    far[:, 25:] = True
    assert np.array_equal(numbers_of(version)[far], numbers_of(after)[far])
    assert np.array_equal(old.record.vertex_end[far.ravel()], new.record.vertex_end[far.ravel()])
    edges = np.repeat(far.ravel(), 2)
    assert np.array_equal(old.record.edge_end[edges], new.record.edge_end[edges])


def test_a_closed_door_splits_a_place_and_an_open_one_joins_its_parts():
    door_open, closed = drawn("...", "...", "...", "...", "..."), drawn(*["..."] * 5)
    closed[2] = 0
    version = version_of(door_open, merge_distance_m=10.0)
    assert version.n_places == 1
    update = version.update(occupancy_grid(closed))
    assert update.version.n_places == 2
    assert update.died == (0,)
    assert update.split == {0: update.born}
    back = update.version.update(occupancy_grid(door_open))
    assert back.version.n_places == 1
    assert len(back.changed) == len(back.merged) == 1
    assert set(back.merged.values()) == set(back.changed)


def test_a_place_that_loses_few_cells_keeps_its_number():
    classes = np.ones((6, 6), np.uint8)
    version = version_of(classes, merge_distance_m=20.0)
    classes[0, 0] = 0
    update = version.update(occupancy_grid(classes))
    assert (update.born, update.died, update.changed) == ((), (), (0,))
    assert update.version.place_at((0, 0)) == -1
    assert update.version.place_at((5, 5)) == 0
    cells = {tuple(cell) for cell in update.version.receptive_field(0).tolist()}
    assert cells == {(row, col) for row in range(6) for col in range(6)} - {(0, 0)}


def test_a_place_no_cell_of_which_is_near_to_all_others_gives_away_those_far_from_the_nearest():
    classes = np.ones((5, 5), np.uint8)
    version = version_of(classes, merge_distance_m=3.2)
    assert version.n_places == 1
    classes[2, 2] = 0  # from its centre alone all cells are within 3.2
    update = version.update(occupancy_grid(classes))
    assert (update.died, update.changed, len(update.born)) == ((), (0,), 2)
    assert len(update.version.receptive_field(0)) == 22
    check_version(update.version)


def test_unchanged_parts_of_a_map_are_shared_between_versions():
    classes = np.ones((300, 900), np.uint8)
    version = version_of(classes, merge_distance_m=20.0)
    classes[5, 5] = 0
    after = version.update(occupancy_grid(classes), changed=(5, 5, 6, 6)).version
    old, new = version.state.tiles.arrays(), after.state.tiles.arrays()
    assert len(old) == 75
    assert sum(new[key] is tile for key, tile in old.items()) >= 73


def test_the_robots_radius_reaches_beyond_the_stated_box():
    probability = np.zeros((20, 20), np.float32)
    version = OnlinePyramid.of(
        hn.DualGraphPyramid.build(OccupancyGrid(probability, Frame(0.1), robot_radius_m=0.3))
    )
    probability[10, 10] = 1.0
    grid = OccupancyGrid(probability, Frame(0.1), robot_radius_m=0.3)
    check_version(version.update(grid, changed=(1.0, 1.0, 1.1, 1.1)).version)


@pytest.mark.parametrize("beyond", [1, 4])
def test_obstacles_in_new_cells_reach_into_old_ones(beyond):
    small = OccupancyGrid(np.zeros((20, 20), np.float32), Frame(1.0), robot_radius_m=2.0)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(small))
    probability = np.zeros((20 + beyond, 20 + beyond), np.float32)
    probability[10, 20] = probability[20, 3] = 1.0
    grid = OccupancyGrid(probability, Frame(1.0), robot_radius_m=2.0)
    update = version.update(grid, changed=np.zeros(grid.shape, np.bool_))
    check_version(update.version)
    assert update.version.place_at((10, 19)) == -1


def test_a_narrow_map_grows_on_all_sides():
    small = OccupancyGrid(np.zeros((1, 3), np.float32), Frame(1.0), robot_radius_m=3.0)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(small))
    probability = np.zeros((3, 5), np.float32)
    probability[0, 0] = 1.0
    grid = OccupancyGrid(probability, Frame(1.0, (-1.0, -1.0)), robot_radius_m=1.0)
    version = version.update(grid).version
    check_version(version)
    wider = OccupancyGrid(np.pad(probability, 1), Frame(1.0, (-2.0, -2.0)), robot_radius_m=1.0)
    check_version(version.update(wider, changed=(-2, -2, -1, -1)).version)


def test_cells_that_changed_elsewhere_are_reported():
    classes = np.ones((5, 5), np.uint8)
    version = version_of(classes)
    classes[4, 4] = 0
    after = version.update(occupancy_grid(classes), changed=(0, 0, 2, 2)).version
    with pytest.raises(InvalidValueError, match=r"1 cells changed outside .* row 4, column 4"):
        after.pyramid  # noqa: B018 - a property


@pytest.mark.parametrize(
    ("grid", "changed", "message"),
    [
        pytest.param(np.zeros((4, 5)), None, "does not cover", id="smaller"),
        pytest.param(np.zeros((5, 5)), (1, 2), "changed is", id="half a box"),
        pytest.param(np.zeros((5, 5)), np.zeros((4, 5), dtype=bool), "mask of shape", id="mask"),
        pytest.param(np.zeros((5, 5)), (3, 3, 1, 1), "changed is", id="inverted"),
        pytest.param(np.zeros((5, 5)), np.ones((5, 5), int), "or a mask, bool", id="whole numbers"),
    ],
)
def test_wrong_arguments_end_in_one_line(grid, changed, message):
    version = version_of(np.ones((5, 5), np.uint8))
    with pytest.raises(InvalidValueError, match=message) as error:
        version.update(OccupancyGrid(grid.astype(np.float32), robot_radius_m=0), changed=changed)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("frame", "message"),
    [
        pytest.param(Frame(0.5), "build a new pyramid", id="resolution"),
        pytest.param(Frame(1.0, yaw_rad=0.1), "build a new pyramid", id="yaw"),
        pytest.param(Frame(1.0, (0.5, 0.0)), "expected whole numbers", id="half a cell"),
        pytest.param(Frame(1.0, (1.0, 0.0)), "does not cover", id="moved in"),
    ],
)
def test_cells_must_stay_where_they_are(frame, message):
    version = version_of(np.ones((5, 5), np.uint8))
    with pytest.raises(InvalidValueError, match=message):
        version.update(OccupancyGrid(np.zeros((5, 5), np.float32), frame, robot_radius_m=0))


def test_a_pyramid_with_rooms_is_refused():
    grid = occupancy_grid(np.ones((4, 4), np.uint8))
    rooms = hn.RoomLabels(("a",), np.zeros((4, 4), np.int32))
    with pytest.raises(InvalidValueError, match="built with rooms"):
        OnlinePyramid.of(hn.DualGraphPyramid.build(grid, rooms=rooms))


@pytest.mark.parametrize("linkage", ["survivor", "diameter"])
def test_a_pyramid_of_another_linkage_is_refused(linkage):
    grid = occupancy_grid(np.ones((4, 4), np.uint8))
    with pytest.raises(InvalidValueError, match=f"linkage '{linkage}', expected 'thro") as error:
        OnlinePyramid.of(hn.DualGraphPyramid.build(grid, linkage=linkage))
    assert "\n" not in str(error.value)


def test_a_number_that_is_no_place_is_refused():
    version = version_of(np.ones((4, 4), np.uint8))
    for number in (7, -1, 10**30, None):
        with pytest.raises(InvalidValueError, match=f"no place {number}"):
            version.receptive_field(number)


def test_cells_that_an_area_left_out_are_found_by_a_later_update():
    classes = np.ones((5, 5), np.uint8)
    version = version_of(classes)
    classes[4, 4] = 0
    grid = occupancy_grid(classes)
    after = version.update(grid, changed=(0, 0, 2, 2)).version
    assert after.place_at((4, 4)) == 0
    update = after.update(grid)
    assert update.cells.tolist() == [[4, 4]]
    assert update.version.place_at((4, 4)) == -1
    check_version(update.version)


def test_a_door_that_is_shut_and_opened_again_stays_a_border():
    classes = np.zeros((52, 104), np.uint8)
    classes[1:51, 1:51] = classes[1:51, 53:103] = classes[20:28, 51:53] = 1
    opened = occupancy_grid(classes, resolution_m=0.1)
    shut = classes.copy()
    shut[20:28, 51:53] = 0
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(opened))
    for changed in (shut, classes):
        version = version.update(occupancy_grid(changed, resolution_m=0.1)).version
    west, east = version.number_of[1:51, 1:51], version.number_of[1:51, 53:103]
    assert not set(np.unique(west)) & set(np.unique(east))
    old = OnlinePyramid.of(hn.DualGraphPyramid.build(opened, linkage="radius"))
    west, east = old.number_of[1:51, 1:51], old.number_of[1:51, 53:103]
    assert set(np.unique(west)) & set(np.unique(east))
