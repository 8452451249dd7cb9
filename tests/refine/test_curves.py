"""Shortest curves, as short as OMPL's, and footprints: radii, convex parts, refusals."""

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from benchmarks.subjects.curves import drawn, faults
from hybridnav.errors import InvalidValueError
from hybridnav.refine.curves import shortest_curve
from hybridnav.refine.footprint import MAX_CORNERS, Footprint
from tests.strategies import examples

RADIUS_M = 0.8

anywhere = st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-4, 4))
on_lattice = st.tuples(*[st.integers(-4, 4)] * 3).map(
    lambda steps: (0.4 * steps[0], 0.4 * steps[1], math.pi / 4 * steps[2])
)
poses = st.one_of(anywhere, on_lattice)
both = pytest.mark.parametrize("reverses", [False, True])


@both
@given(start=poses, goal=poses)
@settings(max_examples=examples(125), derandomize=True)
def test_curve_arrives_and_bends_by_its_radius(reverses, start, goal):
    curve = shortest_curve(start, goal, radius_m=RADIUS_M, reverses=reverses)
    along = curve.poses(0.01)
    np.testing.assert_array_equal(along[0], start)
    assert np.abs(along[-1, :2] - goal[:2]).max() < 1e-7
    assert abs(math.remainder(along[-1, 2] - goal[2], math.tau)) < 1e-7
    assert reverses or (curve.lengths_m >= 0).all()
    steps, turns = np.diff(along[:, :2], axis=0), np.diff(along[:, 2])
    chords = np.hypot(*steps.T)
    assert chords.sum() == pytest.approx(curve.length_m, rel=1e-4, abs=1e-9)
    assert (np.abs(turns) <= chords / RADIUS_M * 1.001 + 1e-9).all()
    # Nothing moves sideways: the chord runs along the heading in the middle of its step.
    middle = along[:-1, 2] + turns / 2
    assert np.abs(steps[:, 1] * np.cos(middle) - steps[:, 0] * np.sin(middle)).max(initial=0) < 1e-9
    assert curve.length_m >= math.dist(start[:2], goal[:2]) - 1e-9


@both
@given(start=poses, goal=poses)
@settings(max_examples=examples(125), derandomize=True)
def test_curve_is_as_long_as_that_of_ompl(reverses, start, goal):
    base = pytest.importorskip("ompl.base")
    space = (base.ReedsSheppStateSpace if reverses else base.DubinsStateSpace)(RADIUS_M)
    states = [space.allocState(), space.allocState()]
    for state, (x, y, yaw) in zip(states, (start, goal), strict=True):
        state.setX(x)
        state.setY(y)
        state.setYaw(math.remainder(yaw, math.tau))
    curve = shortest_curve(start, goal, radius_m=RADIUS_M, reverses=reverses)
    turned = abs(math.remainder(goal[2] - start[2], math.tau))
    # OMPL 2.0 takes nearly equal headings at one place for equal ones, and drives nothing.
    assume(not 0 < turned < 1e-6 or math.dist(start[:2], goal[:2]) > 1e-6)
    assert curve.length_m == pytest.approx(space.distance(*states), abs=1e-5)


@given(start=poses, goal=poses)
@settings(max_examples=examples(60), derandomize=True)
def test_going_backwards_makes_no_curve_longer_and_works_both_ways(start: Any, goal: Any) -> None:
    forwards = shortest_curve(start, goal, radius_m=RADIUS_M, reverses=False)
    either = shortest_curve(start, goal, radius_m=RADIUS_M, reverses=True)
    back = shortest_curve(goal, start, radius_m=RADIUS_M, reverses=True)
    assert either.length_m <= forwards.length_m + 1e-6
    assert back.length_m == pytest.approx(either.length_m, abs=1e-6)


def test_reversing_out_of_a_dead_end() -> None:
    curve = shortest_curve((2, 0, 0), (0, 0, 0), radius_m=1, reverses=True)
    assert curve.lengths_m.sum() == -2
    assert curve.length_m == 2
    assert shortest_curve((2, 0, 0), (0, 0, 0), radius_m=1, reverses=False).length_m > 2 * math.pi


@both
def test_no_way_has_no_length(reverses: bool) -> None:
    curve = shortest_curve((1, 2, 3), (1, 2, 3), radius_m=1, reverses=reverses)
    assert curve.length_m == pytest.approx(0, abs=1e-9)
    assert curve.poses(0.1)[-1] == pytest.approx((1, 2, 3))


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e300])
def test_poses_and_radii_that_make_no_sense_are_refused(wrong: float) -> None:
    with pytest.raises(InvalidValueError, match="poses must be finite"):
        shortest_curve((0, 0, 0), (0, 0, wrong), radius_m=1, reverses=False)
    for radius_m in (0, -1, math.nan, math.inf):
        with pytest.raises(InvalidValueError, match="radius positive"):
            shortest_curve((0, 0, 0), (1, 0, 0), radius_m=radius_m, reverses=True)
    curve = shortest_curve((0, 0, 0), (9, 0, 0), radius_m=1, reverses=False)
    for step_m in (0, -1, math.nan, 1e-12):
        with pytest.raises(InvalidValueError, match="step must be a length"):
            curve.poses(step_m)


@pytest.mark.parametrize("seed", range(4))
def test_no_curve_is_longer_than_a_word_driven_with_50_digits(seed: int) -> None:
    """`python -m benchmarks curves` asks for a million; poses that touch, and arcs near full
    circles, are the half of them."""
    rng = np.random.default_rng(seed)
    drives = [drawn(rng) for _ in range(examples(1500))]
    wrong = [(drive, *found) for drive in drives if (found := faults(drive)[0])]
    assert wrong == []


def test_an_arc_is_no_full_circle() -> None:
    """OMPL 2.0.1, DubinsStateSpace(1.0).distance: 0.19796880276413198. The circles' centres are a
    rounding error apart, so that the direction from one to the other may be any."""
    start = (26.01560671128445, 31.674434869113384, -2.388290507987202)
    goal = (25.885503756946083, 31.525649666643357, -2.190321705223072)
    curve = shortest_curve(start, goal, radius_m=1.0, reverses=False)
    assert curve.length_m == pytest.approx(goal[2] - start[2], abs=1e-12)
    assert len(curve.poses(0.05)) < 8


TRUCK = [[1.5, 0.5], [1.5, -0.5], [-0.25, -0.5], [-0.25, 0.5]]
L_SHAPE = [[0, 0], [2, 0], [2, 1], [1, 1], [1, 2], [0, 2]]


def star(radii: list[float]) -> Any:
    """Corners at these distances all round the base, a simple polygon."""
    angles = np.linspace(0, 2 * math.pi, len(radii), endpoint=False)
    return np.array(radii)[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


stars = st.lists(st.floats(0.1, 2), min_size=4, max_size=12).map(star)


def test_radii_of_a_truck() -> None:
    footprint = Footprint.of(TRUCK)
    assert footprint.inscribed_radius_m == 0.25
    assert footprint.circumscribed_radius_m == math.hypot(1.5, 0.5)


def test_base_outside_has_no_inscribed_disc() -> None:
    assert Footprint.of([[1, 0], [2, 0], [2, 1]]).inscribed_radius_m == 0
    assert Footprint.of(L_SHAPE).inscribed_radius_m == 0


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize("step", [1, -1])
def test_same_footprint_however_it_is_given(closed: bool, step: int) -> None:
    corners = [*TRUCK, TRUCK[0]] if closed else TRUCK
    expected = shapely.Polygon(TRUCK)
    for shape in (corners[::step], np.array(corners)[::step], shapely.Polygon(corners[::step])):
        footprint = Footprint.of(shape)
        assert Footprint.of(footprint) is footprint
        assert len(footprint.corners_m) == 4
        assert shapely.LinearRing(footprint.corners_m).is_ccw
        assert shapely.Polygon(footprint.corners_m).equals(expected)


@given(stars)
@settings(max_examples=examples(200), derandomize=True)
def test_convex_parts_tile_the_outline(corners: Any) -> None:
    footprint = Footprint(corners)
    parts = [shapely.Polygon(part) for part in footprint.convex_parts()]
    outline = shapely.Polygon(corners)
    assert math.isclose(sum(part.area for part in parts), outline.area, rel_tol=1e-9)
    assert shapely.unary_union(parts).symmetric_difference(outline).area < 1e-9
    for part in parts:
        assert math.isclose(part.convex_hull.area, part.area, rel_tol=1e-9)


@given(stars)
@settings(max_examples=examples(100), derandomize=True)
def test_discs_of_the_radii_lie_inside_and_around(corners: Any) -> None:
    footprint, outline = Footprint(corners), shapely.Polygon(corners)
    inner = shapely.Point(0, 0).buffer(footprint.inscribed_radius_m * 0.999)
    outer = shapely.Point(0, 0).buffer(footprint.circumscribed_radius_m * 1.01, quad_segs=64)
    assert outline.contains(inner)
    assert outer.contains(outline)
    assert not outline.contains(shapely.Point(0, 0).buffer(footprint.inscribed_radius_m * 1.01))


def test_convex_outline_is_one_part_and_cannot_be_written_to() -> None:
    footprint = Footprint.of(TRUCK)
    (part,) = footprint.convex_parts()
    assert part is footprint.corners_m
    with pytest.raises(ValueError, match="read-only"):
        part[0, 0] = 1.0


@pytest.mark.parametrize(
    ("shape", "words"),
    [
        ([[0, 0], [1, 0]], "3 to 1000 corners"),
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0]], "3 to 1000 corners"),
        ([[0, 0], [1, 0], [1]], "3 to 1000 corners"),
        (None, "3 to 1000 corners"),
        ("[[0, 0", "3 to 1000 corners"),
        (star([1.0] * (MAX_CORNERS + 2)), "3 to 1000 corners"),
        ([[0, 0], [1, 0], [1, math.nan]], "within 10000 m"),
        ([[0, 0], [1, 0], [1, math.inf]], "within 10000 m"),
        ([[0, 0], [1, 0], [1, 1e9]], "within 10000 m"),
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "Self-intersection"),
        ([[0, 0], [1, 1], [2, 2]], "simple polygon"),
        ([[1, 1], [1, 1], [1, 1]], "simple polygon"),
        (shapely.Polygon(), "3 to 1000 corners"),
        (shapely.Point(0, 0).buffer(2) - shapely.Point(0, 0).buffer(1), "no holes"),
    ],
)
def test_refused_shapes(shape: Any, words: str) -> None:
    with pytest.raises(InvalidValueError, match=words) as caught:
        Footprint.of(shape)
    assert "\n" not in str(caught.value)
