"""Receptive fields and boundaries as shapely objects, against unions of cell boxes."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.grid import Frame
from hybridnav.pyramid import DualGraphPyramid, FaceKind
from hybridnav.pyramid._outline_kernels import boundary_corners
from hybridnav.pyramid.geometry import boundary_lines, field_polygons
from tests.strategies import drawn, examples, occupancy_grid, scenes

ORDINARY = settings(max_examples=examples(30), deadline=None, derandomize=True)
MANY = settings(max_examples=examples(1000), deadline=None)
UNIT = Frame()
LINKAGES = st.sampled_from(["radius", "survivor", "diameter"])
FRAMES = st.builds(
    Frame,
    resolution_m=st.sampled_from([0.05, 0.025, 1.0]),
    origin_m=st.tuples(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6)),
    yaw_rad=st.one_of(st.floats(-math.pi, math.pi), st.just(math.pi / 4)),
)


def levels_of(scene, linkage, frame=UNIT):
    grid = replace(occupancy_grid(scene.classes), frame=frame)
    merge_cells = scene.merge_distance_m / scene.resolution_m
    return DualGraphPyramid.build(
        grid,
        merge_distance_m=merge_cells * frame.resolution_m,
        linkage=linkage,
        seed=scene.seed,
    )


def top_of(*lines, frame=UNIT):
    grid = replace(occupancy_grid(drawn(*lines)), frame=frame)
    return DualGraphPyramid.build(grid, merge_distance_m=1000.0)[-1]


def points_of(geometry):
    return [tuple(point) for point in shapely.get_coordinates(geometry).tolist()]


def straight_points(lines):
    """How many points of lines in the unit frame lie on a straight stretch, ends of closed ones
    included."""
    closed = lines[shapely.is_closed(lines)]
    starts = [shapely.get_coordinates(shapely.get_point(closed, at)) for at in (-2, 0, 1)]
    points, line = shapely.get_coordinates(
        np.concatenate([lines, shapely.linestrings(np.stack(starts, axis=1))]), return_index=True
    )
    steps = np.diff(points, axis=0)
    bends = steps[:-1, 0] * steps[1:, 1] - steps[:-1, 1] * steps[1:, 0]
    return np.count_nonzero((bends == 0) & (line[2:] == line[:-2]))


def check_polygons(level):
    """In the unit frame everything is an integer, so that equality is exact."""
    polygons, noded = field_polygons(level), field_polygons(level, noded=True)
    for shapes in (polygons, noded):
        assert shapes.shape == (level.n_vertices,)
        assert (shapely.get_type_id(shapes) == shapely.GeometryType.POLYGON).all()
        assert shapely.is_valid(shapes).all(), shapely.is_valid_reason(shapes)
        assert shapely.is_ccw(shapely.get_exterior_ring(shapes)).all()
        rings, of_shape = shapely.get_rings(shapes, return_index=True)
        assert shapely.is_ccw(rings).sum() == len(shapes)
        assert shapely.is_simple(rings).all()
        assert np.array_equal(np.unique(of_shape), np.arange(len(shapes)))
        assert np.array_equal(shapely.area(shapes), level.areas)
    assert straight_points(shapely.get_rings(polygons)) == 0
    rows, cols = np.nonzero(level.field_of >= 0)
    cells = shapely.box(cols, rows, cols + 1, rows + 1)
    fields = level.field_of[rows, cols]
    order = np.argsort(fields, kind="stable")
    boxes = np.array(shapely.geometrycollections(cells[order], indices=fields[order]))
    unions = shapely.union_all(boxes[:, None], axis=1)
    assert shapely.equals(polygons, unions).all()
    assert shapely.equals(noded, unions).all()


def parts_and_holes(geometry):
    parts = shapely.get_parts(geometry)
    return len(parts), int(shapely.get_num_interior_rings(parts).sum())


def check_polygons_in_frame(level, flat):
    frame = level.grid.frame
    polygons, noded = field_polygons(level), field_polygons(level, noded=True)
    expected = level.areas * frame.resolution_m**2
    for shapes in (polygons, noded):
        assert shapely.is_valid(shapes).all(), shapely.is_valid_reason(shapes)
        assert shapely.is_ccw(shapely.get_exterior_ring(shapes)).all()
        assert shapely.area(shapes) == pytest.approx(expected, rel=1e-6)
    cells = np.argwhere(np.ones(level.grid.shape, dtype=bool))
    centres = shapely.points(frame.points_of(cells))
    found = np.full(len(cells), -1)
    hit, field = shapely.STRtree(polygons).query(centres, predicate="within")
    assert len(np.unique(hit)) == len(hit), "a centre in two polygons"
    found[hit] = field
    assert np.array_equal(found, level.field_of.ravel())
    union = shapely.union_all(noded)
    assert union.area == pytest.approx(expected.sum(), rel=1e-6)
    # No slits where three meet: the same parts and holes as where all numbers are integers.
    assert parts_and_holes(union) == parts_and_holes(shapely.union_all(field_polygons(flat)))


def check_lines(level):
    lines = boundary_lines(level)
    frame, loops = level.grid.frame, level.is_self_loop
    polygons = field_polygons(level)
    exact = frame == UNIT
    assert lines.shape == (level.n_arcs,)
    assert (shapely.get_type_id(lines) == shapely.GeometryType.LINESTRING).all()
    assert shapely.is_simple(lines).all()
    assert not shapely.is_closed(lines[loops]).any()
    pairs = [level.boundary(arc) for arc in range(level.n_arcs)]
    sizes = np.array([len(own) for own in pairs], dtype=float)
    assert shapely.length(lines) == pytest.approx(sizes * frame.resolution_m, rel=1e-6)
    sides = frame.points_of_grid(np.concatenate([np.empty((0, 2, 2)), *pairs]).mean(axis=1) + 0.5)
    apart = shapely.distance(np.repeat(lines, sizes.astype(int)), shapely.points(sides))
    assert (apart <= (0 if exact else 1e-6 * frame.resolution_m)).all()
    for first, second in ((0, 1), (-2, -1)):
        start, end = (
            shapely.get_coordinates(shapely.get_point(lines, at)) for at in (first, second)
        )
        assert np.array_equal(fields_beside(level, start, end), level.arcs)
    if not exact:
        return
    assert straight_points(lines) == 0
    first, second = polygons[level.arcs].T
    plain = ~loops
    assert shapely.covers(shapely.boundary(first[plain]), lines[plain]).all()
    assert shapely.covers(shapely.boundary(second[plain]), lines[plain]).all()
    # A self-loop's line touches the outline of its field at its ends alone.
    touched = shapely.intersection(shapely.boundary(first[loops]), lines[loops])
    assert shapely.equals(touched, shapely.boundary(lines[loops])).all()
    assert shapely.covers(first[loops], lines[loops]).all()


def fields_beside(level, start, end):
    """Vertices of the cells on the left and on the right of the first side of each step."""
    frame = level.grid.frame
    step = end - start
    along = step / np.hypot(*step.T)[:, None] * frame.resolution_m / 2
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    beside = frame.cells_of(np.stack([start + along + across, start + along - across], axis=1))
    return level.field_of[beside[..., 0], beside[..., 1]]


def check_meetings(level):
    """Lines end where the dual graph says; in the unit frame."""
    lines, dual, loops = boundary_lines(level), level.dual, level.is_self_loop
    ends = np.stack([shapely.get_point(lines, 0), shapely.get_point(lines, -1)], axis=1)
    ordinary = dual.kinds[dual.edges] == FaceKind.ORDINARY
    # An ordinary face with boundaries is one corner of four cells; others touch what is no vertex.
    corners = shapely.get_coordinates(ends[~loops]).astype(int).reshape(-1, 2, 2)
    padded = np.pad(level.field_of >= 0, 1)
    in_block = [padded[row : row + 2, col : col + 2].all() for col, row in corners.reshape(-1, 2)]
    assert np.array_equal(np.reshape(in_block, (-1, 2)), ordinary[~loops])
    meeting: dict[int, list[int]] = {}
    for face, corner in zip(
        dual.edges[~loops][ordinary[~loops]].tolist(),
        corners[ordinary[~loops]].tolist(),
        strict=True,
    ):
        assert meeting.setdefault(face, corner) == corner
    # A self-loop's line ends on a boundary or on the rim of what is no vertex, at its own face.
    for arc, side in np.argwhere(loops[:, None] & [True, True]):
        at_face = (dual.edges == dual.edges[arc, side]).any(axis=1) & ~loops
        on_line = shapely.distance(lines[at_face], ends[arc, side]).min(initial=np.inf) == 0
        assert on_line or not ordinary[arc, side]


@given(scene=scenes(), linkage=LINKAGES)
@ORDINARY
def test_a_polygon_is_the_union_of_the_cells_of_its_field(scene, linkage):
    for level in levels_of(scene, linkage):
        check_polygons(level)


@given(scene=scenes(), linkage=LINKAGES, frame=FRAMES)
@ORDINARY
def test_polygons_lie_where_the_map_lies(scene, linkage, frame):
    turned, flat = levels_of(scene, linkage, frame), levels_of(scene, linkage)
    for level, unit in zip(turned, flat, strict=True):
        check_polygons_in_frame(level, unit)


@given(scene=scenes(), linkage=LINKAGES, frame=st.one_of(st.just(UNIT), FRAMES))
@ORDINARY
def test_a_line_runs_along_the_sides_of_its_boundary(scene, linkage, frame):
    for level in levels_of(scene, linkage, frame):
        check_lines(level)


@given(scene=scenes(), linkage=LINKAGES)
@ORDINARY
def test_lines_meet_at_the_vertices_of_the_dual(scene, linkage):
    for level in levels_of(scene, linkage):
        check_meetings(level)


@pytest.mark.full
@given(scene=scenes(), linkage=LINKAGES, frame=FRAMES)
@MANY
def test_many_maps_have_valid_polygons_and_lines(scene, linkage, frame):
    turned, flat = levels_of(scene, linkage, frame), levels_of(scene, linkage)
    for level, unit in zip(turned, flat, strict=True):
        check_polygons(unit)
        check_lines(unit)
        check_meetings(unit)
        check_polygons_in_frame(level, unit)
        check_lines(level)


@pytest.mark.parametrize(
    ("lines", "rings"),
    [
        pytest.param(["."], [5], id="one cell"),
        pytest.param(["......"], [5], id="one row"),
        pytest.param([".", ".", "."], [5], id="one column"),
        pytest.param(["#.#", "...", "#.#"], [13], id="cross"),
        pytest.param(["...", ".#.", "..#"], [7, 5], id="hole that touches the outer ring"),
        pytest.param(["....", ".#..", "..#.", "...."], [5, 5, 5], id="two holes that touch"),
        pytest.param(
            [".....", ".#.#.", "..#..", ".#.#.", "....."], [5, 5, 5, 5, 5, 5], id="five of a board"
        ),
        pytest.param([".....", ".###.", ".#.#.", ".###.", "....."], [5, 5, 5], id="nested rings"),
        pytest.param(["......", "#####.", "....#.", ".####.", "......"], [13], id="spiral"),
    ],
)
def test_rings_of_small_maps(lines, rings):
    level = top_of(*lines)
    check_polygons(level)
    sizes = shapely.get_num_coordinates(shapely.get_rings(field_polygons(level)))
    assert sizes.tolist() == rings


def test_a_checkerboard_has_a_square_per_cell_and_a_line_per_side():
    level = top_of(".?.", "?.?", ".?.")
    rows, cols = level.cells.T
    squares = shapely.box(cols, rows, cols + 1, rows + 1)
    assert shapely.equals(field_polygons(level), squares).all()
    assert shapely.length(boundary_lines(level)).tolist() == [1] * 12


def test_points_are_metres_of_a_turned_map():
    frame = Frame(resolution_m=0.5, origin_m=(10.0, 20.0), yaw_rad=math.pi / 2)
    level = top_of("..??", frame=frame)
    free, unexplored = field_polygons(level)
    # Columns run along +y and rows along -x.
    assert free.hausdorff_distance(shapely.box(9.5, 20, 10, 21)) < 1e-9
    assert unexplored.hausdorff_distance(shapely.box(9.5, 21, 10, 22)) < 1e-9
    (line,) = boundary_lines(level)
    assert np.allclose(points_of(line), [(10, 21), (9.5, 21)])


def test_noded_polygons_keep_the_points_where_others_meet():
    level = top_of("??##", "....", "....")
    free = level.field_of[0, 0]
    plain, noded = (field_polygons(level, noded=keep)[free] for keep in (False, True))
    assert points_of(plain.exterior) == [(0, 0), (4, 0), (4, 2), (0, 2), (0, 0)]
    assert points_of(noded.exterior) == [(0, 0), (4, 0), (4, 2), (2, 2), (0, 2), (0, 0)]


def test_two_doors_are_two_lines_and_an_island_is_ringed_by_one():
    doors = boundary_lines(top_of("..#??", "...??", "..#??", "...??", "..#??"))
    assert [sorted(points_of(line)) for line in doors] == [
        [(3, 1), (3, 2)],
        [(3, 3), (3, 4)],
    ]
    island = top_of("......", "..??..", "..??..", "......")
    loop, arc = np.argsort(~island.is_self_loop)
    lines = boundary_lines(island)
    assert shapely.is_closed(lines[arc])
    assert shapely.Polygon(lines[arc]).equals(shapely.box(2, 1, 4, 3))
    # The self-loop goes round the island: its line leads from the rim to it.
    rim, ring = shapely.box(0, 0, 6, 4).exterior, lines[arc]
    ends = sorted(points_of(lines[loop].boundary), key=lambda end: rim.distance(shapely.Point(end)))
    assert [rim.distance(shapely.Point(ends[0])), ring.distance(shapely.Point(ends[1]))] == [0, 0]


def test_a_ring_starts_at_a_turn_whichever_edge_represents_it():
    level = top_of(".....", ".???.", ".???.", ".???.", ".....")
    cells = np.arange(level.field_of.size).reshape(level.field_of.shape)
    east = 2 * cells[:, :-1][level.field_of[:, :-1] != level.field_of[:, 1:]]
    north = 2 * cells[:-1][level.field_of[:-1] != level.field_of[1:]] + 1
    edges = np.concatenate([east, north])
    offsets, corners = boundary_corners(
        level.field_of, edges, np.empty(0, dtype=np.int64), np.zeros(13, dtype=np.int64)
    )
    assert offsets.tolist() == [5 * i for i in range(13)]
    assert {frozenset(map(tuple, ring.tolist())) for ring in corners.reshape(12, 5, 2)} == {
        frozenset([(1, 1), (1, 4), (4, 1), (4, 4)])
    }


@pytest.mark.parametrize("lines", [["#"], ["###", "###"]])
def test_a_map_without_places_has_no_shapes(lines):
    level = top_of(*lines)
    assert field_polygons(level).shape == boundary_lines(level).shape == (0,)


@pytest.mark.parametrize("name", ["bwi_gdc/3/3.yaml", "f1tenth_simulator/stata_basement.yaml"])
def test_shapes_of_real_maps_add_up(data, name):
    grid = hn.load_map(data / name, robot_radius_m=0.25)
    level = DualGraphPyramid.build(grid, merge_distance_m=4.0)[-1]
    polygons, lines = field_polygons(level), boundary_lines(level)
    cell_m2 = grid.resolution_m**2
    assert shapely.is_valid(polygons).all()
    assert shapely.area(polygons) == pytest.approx(level.areas * cell_m2, rel=1e-6)
    assert shapely.area(polygons).sum() == pytest.approx(
        np.count_nonzero(grid.classes) * cell_m2, rel=1e-6
    )
    first, second = shapely.boundary(polygons[level.arcs[~level.is_self_loop]]).T
    sides = lines[~level.is_self_loop]
    shared = shapely.length(sides)
    middles = shapely.line_interpolate_point(sides, shared / 2)
    for outlines in (first, second):
        assert shapely.distance(outlines, middles).max() < 1e-6 * grid.resolution_m
