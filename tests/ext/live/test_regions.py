"""Regions of a map that changes: every invariant, identities, size limits, the level above."""

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from hypothesis.stateful import invariant, rule
from scipy import ndimage

import hybridnav as hn
from benchmarks.common import OFFICE, with_classes
from benchmarks.subjects.online import random_changes
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live import OnlinePyramid, OnlineRegions
from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.pyramid.cracks import find_cracks
from tests.ext.live.identities import check_identities, run_machine
from tests.ext.live.test_updates import Robot, version_of
from tests.oracle.checks import check_level, check_step
from tests.oracle.pyramid import Base
from tests.strategies import drawn, examples, occupancy_grid

NOTHING: Any = None


def regions_beside(number_of, classes):
    """Pairs of regions of one class with a common side of cells."""
    pairs = set()
    for one, other, same in (
        (number_of[1:], number_of[:-1], classes[1:] == classes[:-1]),
        (number_of[:, 1:], number_of[:, :-1], classes[:, 1:] == classes[:, :-1]),
    ):
        apart = same & (one != other) & (one >= 0)
        pairs |= set(zip(one[apart].tolist(), other[apart].tolist(), strict=True))
    return pairs


def check_partition(version):
    """Regions are connected sets of whole places of one class, of a size, and could not grow."""
    places, classes = version.places.number_of, version.places.grid.classes
    number_of, areas = np.full(places.shape, -1), {}
    assert sorted(version.region_of) == sorted(set(places[places >= 0].tolist()))
    for region in version.numbers:
        members = version.places_of(region)
        inside = np.isin(places, members)
        number_of[inside] = region
        areas[region] = int(inside.sum())
        assert [version.region_of[place] for place in members] == [region] * len(members)
        assert ndimage.label(inside)[1] == 1
        assert len(np.unique(classes[inside])) == 1
        assert len(members) == 1 or areas[region] <= version.most_cells
    assert sum(areas.values()) == (classes > 0).sum()
    assert np.array_equal(number_of, version.number_of)
    for one, other in regions_beside(number_of, classes):
        assert areas[one] + areas[other] > version.most_cells


def check_levels(version):
    """The levels above the places, by the oracle's reading of the labels alone."""
    pyramid = version.pyramid
    base = Base.of(version.places.grid.classes)
    levels = [pyramid[index] for index in range(pyramid.place_level, len(pyramid))]
    for level in levels:
        check_level(level, base)
    for lower, upper in itertools.pairwise(levels):
        check_step(lower, upper)
    numbers = np.append(version.region_numbers, -1)
    assert np.array_equal(numbers[pyramid[pyramid.region_level].field_of], version.number_of)
    assert pyramid.with_regions(version.most_cells) is pyramid


def check_events(old, update, shift):
    """What an update states about regions is what the cells show."""
    had, has = set(old.numbers), set(update.version.numbers)
    cells = old.number_of, update.version.number_of
    check_identities(update, (had, has), cells, shift)
    assert not set(update.born) & set(range(old._next))


class Follower(Robot):
    """A map that changes and grows while regions follow its places."""

    skips = False
    """Whether the next update of the places is followed only with the one after it."""

    @rule(most_cells=st.sampled_from([1, 4, 6, 9, 12, 16, 30, 100, 10**6]))
    def begin(self, most_cells):
        """Make new regions."""
        self.regions, self.shift = OnlineRegions.of(self.version, most_cells), (0, 0)

    @rule()
    def skip(self):
        """Follow two updates of the places at once."""
        self.skips = True

    def follow(self, classes, *, changed, shift=(0, 0)):
        """Update the places, and the regions too."""
        if not hasattr(self, "regions"):
            self.begin(9)
        super().follow(classes, changed=changed, shift=shift)
        self.shift = tuple(np.add(self.shift, shift).tolist())
        if self.skips:
            self.skips = False
            return
        before, numbers = self.regions, self.regions.number_of.copy()
        update = before.update(self.version)
        check_events(before, update, self.shift)
        assert np.array_equal(before.number_of, numbers)
        self.regions, self.shift = update.version, (0, 0)
        check_partition(self.regions)
        check_levels(self.regions)

    @invariant()
    def every_level_is_sound(self):
        """Leave the levels below to the tests of places."""


def test_regions_follow_a_map():
    run_machine(Follower, examples(25), 10, derandomize=True)


@pytest.mark.full
def test_regions_follow_a_map_for_5_000_steps():
    run_machine(Follower, 200, 25)


@pytest.mark.full
def test_a_thousand_updates_of_an_office_keep_regions_as_a_fresh_build_makes_them():
    office = hn.load_map(OFFICE, robot_radius_m=0.25)
    places = OnlinePyramid.of(hn.DualGraphPyramid.build(office))
    regions = OnlineRegions.of(places, 9000)
    for at, (classes, box) in enumerate(random_changes(office, 1000), start=1):
        places = places.update(with_classes(office, classes), changed=box).version
        regions = regions.update(places).version
        if at % 50 == 0:
            check_partition(regions)
            level = regions.pyramid[regions.pyramid.region_level]
            _, boundary = find_cracks(level.field_of.ravel(), *classes.shape)
            assert len(np.unique(boundary)) == (~level.is_self_loop).sum()
            fresh = hn.DualGraphPyramid.build(places.grid).with_regions(9000)
            n_fresh = fresh[fresh.region_level].n_vertices
            assert regions.n_regions == pytest.approx(n_fresh, rel=0.15)


def test_a_place_all_of_whose_cells_change_class_leaves_its_region():
    classes = drawn("........", "........", "........", "........")
    version = version_of(classes, merge_distance_m=2.0)
    regions = OnlineRegions.of(version, 100)
    assert regions.n_regions == 1
    place = version.place_at((0, 0))
    for row, col in version.receptive_field(place).tolist():
        classes[row, col] = 2
    update = version.update(occupancy_grid(classes))
    assert place in update.changed
    after = regions.update(update.version)
    assert after.version.n_regions == 2
    assert (after.changed, after.born) == ((0,), (1,))
    check_partition(after.version)
    check_levels(after.version)


def test_regions_that_no_change_touches_keep_places_and_number():
    classes = np.ones((12, 120), np.uint8)
    version = version_of(classes)
    regions = OnlineRegions.of(version, 200)
    classes[5, 4] = 0
    update = regions.update(version.update(occupancy_grid(classes)).version)
    assert set(update.changed) | set(update.died) <= {*regions.number_of[:, :60].ravel().tolist()}
    far = regions.number_of[:, 60:]
    assert np.array_equal(far, update.version.number_of[:, 60:])
    for region in np.unique(far).tolist():
        assert update.version.places_of(region) == regions.places_of(region)
    again = update.version.update(update.version.places)
    assert (again.born, again.died, again.changed) == ((), (), ())


def test_plans_are_made_on_regions_that_followed():
    office = hn.load_map(OFFICE, robot_radius_m=0.25)
    places = OnlinePyramid.of(hn.DualGraphPyramid.build(office))
    regions = OnlineRegions.of(places, 9000)
    classes, box = next(random_changes(office, 1))
    regions = regions.update(
        places.update(with_classes(office, classes), changed=box).version
    ).version
    topology = hn.TopologicalMap(regions.pyramid)
    paper, exact = (hn.HybridPlanner(topology, preset=name) for name in ("paper", "octile"))
    ends = (2.0, 2.0), (40.0, 20.0)
    assert exact.plan(*ends).cost <= paper.plan(*ends).cost <= 1.5 * exact.plan(*ends).cost


def test_regions_follow_the_places_of_any_version_of_their_map():
    classes = np.ones((9, 20), np.uint8)
    first = version_of(classes, merge_distance_m=4.0)
    classes[:, 10] = 0
    second = first.update(occupancy_grid(classes)).version
    most_cells: Any = np.int64(30)
    regions = OnlineRegions.of(second, most_cells)
    back = regions.update(first)
    check_events(regions, back, (0, 0))
    check_partition(back.version)


@pytest.mark.parametrize(
    ("ask", "message"),
    [
        (lambda regions, _: OnlineRegions.of(regions.places, 0), "at most 0 cells"),
        (lambda _, __: OnlineRegions.of(NOTHING, 5), "places is None"),
        (lambda regions, _: regions.update(NOTHING), "places is None"),
        (lambda regions, other: regions.update(other), "make new regions"),
        (lambda regions, _: regions.places_of(77), "no region 77 in this version"),
        (lambda regions, _: regions.places_of(None), "no region None in this version"),
    ],
)
def test_wrong_arguments_end_in_one_line(ask, message):
    regions = OnlineRegions.of(version_of(np.ones((5, 5), np.uint8)), 9)
    frame = Frame(origin_m=(-1.0, -1.0))
    grid = OccupancyGrid(np.zeros((7, 7), np.float32), frame, robot_radius_m=0)
    other = OnlinePyramid.of(hn.DualGraphPyramid.build(grid))
    with pytest.raises(InvalidValueError, match=message) as error:
        ask(regions, other)
    assert "\n" not in str(error.value)
