"""Worlds of shapes as two grids, held against polygons: finer circles outside and inside each."""

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import example
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from tests.maps.random_worlds import count
from tests.strategies import examples, tried

SIDE = 0.25
BOUNDS = (-1.0, -1.0, 2.0, 2.0)
_ARCS = 64
_CIRCLE = 1 / math.cos(math.pi / (2 * _ARCS))
"""How much further a circle's tangent polygon reaches than the circle: steps of a short arc are up
to twice as long, since GEOS rounds their number."""
eighths = st.integers(-12, 20).map(lambda number: number / 8)
"""Coordinates on the sides of cells and in their middle, so that shapes touch cells and others."""
places = st.tuples(eighths, eighths)
radii = st.sampled_from([0.0, 0.0, 0.125, 0.25, 0.3, 0.7])


@st.composite
def worlds(draw):
    """Draw points, lines, boxes and polygons, some of them not convex, and what to widen each."""
    shapes = draw(st.lists(st.lists(places, min_size=1, max_size=5, unique=True), max_size=5))
    made: list[Any] = []
    for points in shapes:
        if len(points) == 1:
            made.append(shapely.Point(points[0]))
        elif len(points) == 2 or not shapely.Polygon(points[:4] + points[:1]).is_valid:
            made.append(shapely.LineString(points[:2]))
        else:
            made.append(shapely.Polygon(points))
    made = [shape for shape in made if shape.is_valid and not shape.is_empty]
    return made, [draw(radii) for _ in made]


def _cells(shape):
    cells = np.indices(shape).reshape(2, -1).T
    low = cells[:, ::-1] * SIDE + BOUNDS[:2]
    boxes: Any = shapely.box(*low.T, *(low + SIDE).T)
    return boxes.reshape(shape)


def _grown(shapes, radii_m, factor):
    """Return the union of all shapes, each wider by a polygon of 256 sides, and its thin parts."""
    return shapely.union_all(
        [
            shape.buffer(radius * factor, quad_segs=_ARCS) if radius else shape
            for shape, radius in zip(shapes, radii_m, strict=True)
        ]
    )


@tried(100, world=worlds())
@example(
    (
        [shapely.LineString([(0, 0), (0, 0.125)]), shapely.LineString([(-0.125, 0), (1.75, 0.75)])],
        [0.0, 0.0],
    )
)
@example(([shapely.Polygon([(0, 1.125), (-0.125, 0), (0.25, -0.125)])], [0.125]))
@example(
    (
        [
            shapely.LineString([(-0.5, 1.5), (1, 1.125)]),
            shapely.Polygon([(0, 0), (0, 1.125), (0.25, 1.125)]),
        ],
        [0.125, 0.125],
    )
)
def test_cells_are_blocked_as_polygons_inside_and_outside_of_the_shapes_say(world):
    shapes, radii_m = world
    feasible, bounding = hn.grids_of_shapes(shapes, SIDE, BOUNDS, radii_m=radii_m)
    assert feasible.shape == bounding.shape == (12, 12)
    met, inside = feasible.classes == 0, bounding.classes == 0
    boxes = _cells(met.shape)
    small, large = _grown(shapes, radii_m, 1.0), _grown(shapes, radii_m, _CIRCLE)
    core = shapely.buffer(boxes, -1e-6 * SIDE, join_style="mitre")
    # What lies surely in, or surely not: between them the polygons of circles do not decide.
    assert met[shapely.intersects(core, small)].all()
    # The union's nodes are rounded: a line of it may miss the corner of a cell that it touches.
    wide = shapely.buffer(boxes, 1e-9 * SIDE, join_style="mitre")
    assert not met[~shapely.intersects(wide, large)].any()
    # Of collections with a point shapely 2.2 says they cover nothing: see findings/.
    thick = shapely.union_all([part for part in shapely.get_parts(large) if part.area])
    assert not inside[~shapely.covers(thick, core)].any()
    # A cell whose middle three quarters are covered in many pieces may be left to the bound.
    assert inside[shapely.covers(small.buffer(-1e-6), boxes) & _held(shapes, radii_m, boxes)].all()
    assert (met | ~inside).all()


def _held(shapes, radii_m, boxes):
    """Return the cells that one convex shape covers alone and does not touch from within, or that
    all polygons as they are cover."""
    alone = [
        shapely.covers(shape.buffer(radius - 1e-6 if radius else 0, quad_segs=_ARCS), boxes)
        for shape, radius in zip(shapes, radii_m, strict=True)
        if (radius or shape.area) and shape.equals(shape.convex_hull)
    ]
    solid = shapely.union_all([shape for shape in shapes if shape.area])
    return np.any([*alone, shapely.covers(solid, boxes)], axis=0)


def test_cells_held_by_two_discs_together_are_inside():
    # The lens of the two covers what neither does alone, about (0.5, 0.5).
    discs: list[Any] = [shapely.Point(0.1, 0.5), shapely.Point(0.9, 0.5)]
    for radius, held in ((0.66, True), (0.45, False)):
        _, bounding = hn.grids_of_shapes(discs, 0.5, (0.25, 0.25, 0.75, 0.75), radii_m=radius)
        assert (bounding.classes == 0).all() == held


def test_boxes_that_share_a_side_have_no_seam_and_a_wall_without_width_parts():
    boxes = [shapely.box(0, 0, 1.1, 1), shapely.box(1.1, 0, 2, 1)]
    _, bounding = hn.grids_of_shapes(boxes, 0.25, (0, 0, 2, 2))
    assert (bounding.classes[:4] == 0).all()
    assert (bounding.classes[4:] == 1).all()
    wall = shapely.LineString([(1, -1), (1, 3)])  # along the sides of cells
    feasible, bounding = hn.grids_of_shapes(wall, 0.25, (0, 0, 2, 2))
    assert (feasible.classes[:, 3:5] == 0).all()
    assert (bounding.classes == 1).all()


def test_sides_that_rounding_moves_still_end_on_the_sides_of_cells():
    # 3 * 0.1 is 0.30000000000000004, and the box ends at 0.3.
    feasible, bounding = hn.grids_of_shapes(shapely.box(0.3, 0, 0.6, 1), 0.1, (0, 0, 1, 1))
    for grid in (feasible, bounding):
        assert np.flatnonzero(grid.classes[5] == 0).tolist() == [3, 4, 5]


def test_collections_are_read_and_bounds_extended_to_whole_cells():
    ring = shapely.Point(1, 1).buffer(1).difference(shapely.Point(1, 1).buffer(0.5))
    parts: Any = [ring]
    both = shapely.GeometryCollection([shapely.MultiPolygon(parts), shapely.Point()])
    feasible, bounding = hn.grids_of_shapes(both, 0.1, (0, 0, 2.05, 2))
    assert feasible.shape == (20, 21)
    for grid in (feasible, bounding):
        assert grid.robot_radius_m == 0
        assert grid.classes[10, 10] == 1, "the hole of the ring"
        assert grid.classes[10, 2] == 0
    empty = hn.grids_of_shapes([], 0.1, (0, 0, 1, 1))
    assert all((grid.classes == 1).all() for grid in empty)


def test_no_bound_is_above_a_path_that_shapely_calls_free():
    judged, wrong = count(examples(1000))
    assert judged >= examples(1000)
    assert wrong == 0


@pytest.mark.parametrize(
    ("shapes", "bounds", "radii_m", "message"),
    [
        (["a"], (0, 0, 1, 1), 0, r"expected shapely geometries"),
        (
            shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]),
            (0, 0, 1, 1),
            0,
            "shape 0 is not valid",
        ),
        (shapely.Point(0, 0), (0, 0, 0, 1), 0, r"expected \(x_min"),
        (shapely.Point(0, 0), (0, 0, math.inf, 1), 0, r"expected \(x_min"),
        (shapely.Point(0, 0), "abcd", 0, r"expected \(x_min"),
        (shapely.Point(0, 0), (0, 0, 1e6, 1e6), 0, "at most"),
        (shapely.Point(0, 0), (0, 0, 1, 1), -1, "radii_m is -1, expected finite metres >= 0"),
        ([shapely.Point(0, 0)] * 2, (0, 0, 1, 1), [1, 2, 3], "one for each of 2 shapes"),
    ],
)
def test_mistakes_are_named(shapes, bounds, radii_m, message):
    with pytest.raises(InvalidValueError, match=message):
        hn.grids_of_shapes(shapes, 0.1, bounds, radii_m=radii_m)
