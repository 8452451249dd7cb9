"""Contacts and clearances of lines against shapely, of whose squares the cells alone are shared."""

import itertools

import numpy as np
import shapely
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import clearance_of, contacts_of, segment_faults
from hybridnav.maps import CellClass
from tests.strategies import drawn, framed, occupancy_grid, seeds, tried

WITHIN = 1 / 128 + 1e-6


def squares(chosen):
    """The union of the squares of some cells, x along the columns."""
    return shapely.union_all([shapely.box(c, r, c + 1, r + 1) for r, c in np.argwhere(chosen)])


@st.composite
def lines_on_maps(draw):
    shape = draw(st.tuples(st.integers(1, 8), st.integers(1, 8)))
    seed = draw(seeds)
    rng = np.random.default_rng(seed)
    classes = rng.choice(3, p=[0.3, 0.6, 0.1], size=shape).astype(np.uint8)
    per_cell = draw(st.sampled_from([1, 2, 1024]))  # corners, halves of sides, anywhere
    points = rng.uniform(-1, 1 + np.array(shape)[::-1], (draw(st.integers(1, 6)), 2))
    points = np.round(points * per_cell) / per_cell
    return classes, points


@tried(150, lines_on_maps(), st.booleans())
def test_contacts_are_what_shapely_finds_outside_the_free_squares(scene, allow_unexplored):
    classes, points = scene
    grid = occupancy_grid(classes)
    found = contacts_of(grid, points, allow_unexplored=allow_unexplored)
    faults = segment_faults(grid, points, allow_unexplored=allow_unexplored)
    assert bool(found) == bool(faults)

    is_free = (classes == CellClass.FREE) | (allow_unexplored & (classes == CellClass.UNEXPLORED))
    free = squares(is_free)
    line = shapely.LineString(points) if len(points) > 1 else shapely.Point(points[0])
    pieces = [
        shapely.difference(shapely.LineString(pair), free) for pair in itertools.pairwise(points)
    ]
    outside = sum(piece.length for piece in pieces)
    assert abs(sum(each.to_m - each.from_m for each in found) - outside) < 1e-6
    assert all(a.to_m < b.from_m for a, b in itertools.pairwise(found))
    assert (outside > 1e-9) <= bool(found)
    if not is_free.any():
        return
    fine = shapely.get_coordinates(shapely.segmentize(line, 0.01)) if line.length > 0 else points
    depth = max(shapely.distance(shapely.points(fine), free))
    assert abs(max((each.depth_m for each in found), default=0.0) - depth) < WITHIN + 0.01
    for each in found:
        assert abs(shapely.Point(each.x, each.y).distance(free) - each.depth_m) < 1e-6
        assert line.distance(shapely.Point(each.x, each.y)) < 1e-6


@tried(100, lines_on_maps(), st.floats(0.1, 3.0))
def test_clearances_are_those_of_shapely(scene, limit_m):
    classes, points = scene
    found = clearance_of(occupancy_grid(classes), points, limit_m=limit_m)
    occupied = classes == CellClass.OCCUPIED
    if not occupied.any():
        assert found.least_m == found.mean_m == np.inf
        return
    line = shapely.LineString(points) if len(points) > 1 else shapely.Point(points[0])
    shape = squares(occupied)
    assert -1e-6 < found.least_m - line.distance(shape) < WITHIN
    shares = (np.arange(2000) + 0.5) / 2000
    fine = shapely.points(points[:1])
    if isinstance(line, shapely.LineString):
        fine = shapely.line_interpolate_point(line, shares, normalized=True)
    distances = shapely.distance(fine, shape)
    assert abs(found.mean_m - distances.mean()) < 0.05
    near = (np.abs(distances - limit_m) < 0.15).mean()
    assert abs(found.below - (distances < limit_m).mean()) <= near + 1e-9


def test_a_contact_goes_on_over_points_of_the_path_and_is_named():
    grid = occupancy_grid(drawn(".....", ".##..", ".....", "..?.."))
    points = [(0.5, 2.5), (1.5, 2.5), (2.5, 2.5), (3.5, 2.5), (3.5, 0.5), (2.5, 0.5)]
    wall, unknown = contacts_of(grid, points)
    assert (wall.what, wall.from_m, wall.to_m, wall.depth_m) == ("obstacle", 0.5, 2.5, 0.5)
    assert (unknown.what, unknown.from_m, unknown.to_m) == ("unexplored", 5.5, 6.0)
    assert contacts_of(grid, points[-2:], allow_unexplored=True) == ()
    (beyond,) = contacts_of(grid, [(4.5, 0.5), (4.5, -1.0)])
    assert (beyond.what, beyond.depth_m) == ("outside the map", 1.0)


def test_a_radius_is_told_from_an_obstacle():
    grid = hn.OccupancyGrid(np.array([[0.0, 0, 0, 1, 0, 0, 0]]), robot_radius_m=1.0)
    (near,) = contacts_of(grid, [(0.5, 0.5), (2.3, 0.5)])
    assert (near.what, round(near.depth_m, 6), near.from_m) == ("near an obstacle", 0.3, 1.5)


def test_a_yaw_and_an_origin_change_nothing_but_the_place():
    classes = drawn("....", ".##.", "....")
    for yaw in (0.0, 0.7):
        grid = framed(classes, yaw)
        points = grid.frame.points_of_grid(np.array([(1.5, 0.5), (1.5, 3.5)]))
        (found,) = contacts_of(grid, points)
        assert abs(found.depth_m - 0.025) < 1e-6
        assert abs(found.to_m - found.from_m - 0.1) < 1e-6
