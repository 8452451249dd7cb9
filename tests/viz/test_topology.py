"""Pictures of graphs: asked what they show, not compared with pictures."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.colors import same_color
from matplotlib.figure import Figure
from matplotlib.path import Path as Curve

import hybridnav as hn
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.graphs import FaceKind
from hybridnav.viz import plot_dual, plot_figure1, plot_topology, save_figure, style
from hybridnav.viz.boundaries import Boundaries, boundary_line
from hybridnav.viz.fields import Field, Loops, distance_to_rim, smoothed
from hybridnav.viz.topology import Arc
from tests.strategies import drawn, examples, level_of, occupancy_grid, scenes

MAPS = Path(__file__).parents[2] / "maps"
SOME = settings(max_examples=examples(25), deadline=None)
WIDE = 1.5


@pytest.fixture(scope="module")
def figure1():
    grid = hn.load_map(MAPS / "figure1" / "figure1.yaml", robot_radius_m=0)
    return hn.TopologicalMap(DualGraphPyramid.build(grid, merge_distance_m=10.0))


@pytest.fixture(scope="module")
def two_doors():
    """A free and an unexplored room, so two places, with a pillar each, joined by two doors."""
    cells = np.zeros((12, 19))
    cells[[0, -1]] = cells[:, [0, 9, -1]] = 1.0
    cells[[2, 3, 8, 9], 9] = 0.0
    cells[1:-1, 10:-1] = 0.5
    cells[5:7, [4, 14]] = 1.0
    grid = hn.OccupancyGrid(cells.astype(np.float32), hn.Frame(1.0), name="two doors")
    return DualGraphPyramid.build(grid, merge_distance_m=30.0)[-1]


def found(ax, gid):
    return next((artist for artist in ax.findobj() if artist.get_gid() == gid), None)


def lines(ax, gid):
    drawn_lines = found(ax, gid)
    return [] if drawn_lines is None else drawn_lines.get_segments()


def points(ax, gid):
    return np.asarray(found(ax, gid).get_offsets())


def title(ax):
    return ax.get_title().replace("\n", "  ·  ")


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def place_of(topology, cell_class, *, largest):
    of_class = np.flatnonzero(topology.classes == cell_class)
    areas = topology.areas_m2[of_class]
    return int(of_class[areas.argmax() if largest else areas.argmin()])


def farthest_apart(one, other):
    """The largest distance of a point of one line from the other line's points."""
    return np.hypot(*np.moveaxis(one[:, None] - other[None], -1, 0)).min(axis=1).max()


def test_parallel_arcs_are_two_lines_round_what_parts_them(figure1):
    ax = plot_topology(figure1)
    one, other = lines(ax, "parallel-arcs")
    free = place_of(figure1, hn.CellClass.FREE, largest=True)
    outer = place_of(figure1, hn.CellClass.UNEXPLORED, largest=True)
    for line in (one, other):
        endpoints = {tuple(np.round(end, 9)) for end in line[[0, -1]]}
        assert endpoints == {tuple(np.round(figure1.positions[p], 9)) for p in (free, outer)}
    assert farthest_apart(one, other) > 0.3
    obstacle = (2.25, 1.55)
    assert Curve(np.concatenate([one, other[::-1]])).contains_point(obstacle)


def test_a_self_loop_goes_round_the_island_and_nothing_else(figure1):
    (loop,) = lines(plot_topology(figure1), "self-loops")
    free = place_of(figure1, hn.CellClass.FREE, largest=True)
    island = place_of(figure1, hn.CellClass.UNEXPLORED, largest=False)
    outer = place_of(figure1, hn.CellClass.UNEXPLORED, largest=True)
    np.testing.assert_allclose(loop[[0, -1]], figure1.positions[[free, free]])
    curve, level = Curve(loop), figure1.level
    middles = level.grid.frame.points_of(level.receptive_field(island))
    assert curve.contains_point(figure1.positions[island])
    assert curve.contains_points(middles).all()
    assert not curve.contains_point(figure1.positions[outer])
    assert not curve.contains_point((2.25, 1.55))


@pytest.mark.parametrize("width", [3.0, 7.0, 14.0])
def test_a_self_loop_goes_round_at_every_width(figure1, width):
    (loop,) = lines(plot_topology(figure1, width_in=width), "self-loops")
    island = place_of(figure1, hn.CellClass.UNEXPLORED, largest=False)
    assert Curve(loop).contains_point(figure1.positions[island])


def test_an_arc_runs_through_its_own_door(two_doors):
    ax = plot_topology(two_doors)
    parallel = lines(ax, "parallel-arcs")
    assert len(parallel) == 2
    heights = []
    for line in parallel:
        order = np.argsort(line[:, 0])
        heights.append(float(np.interp(9.5, line[order, 0], line[order, 1])))
    low, high = sorted(heights)
    assert 2 < low < 4
    assert 8 < high < 10


def test_arcs_and_loops_stay_inside_their_places(two_doors):
    grid = two_doors.grid
    ax = plot_topology(two_doors)
    curves = [line for gid in ("parallel-arcs", "self-loops") for line in lines(ax, gid)]
    assert len(curves) == two_doors.n_arcs == 4
    for curve in curves:
        rows, cols = grid.frame.cells_of(curve).T
        assert (grid.classes[rows, cols] != hn.CellClass.OCCUPIED).all()


def test_a_simple_graph_is_one_straight_line_for_two_places(figure1):
    ax = plot_topology(figure1, simple=True)
    edges = lines(ax, "edges")
    assert len(edges) == 2
    assert all(len(edge) == 2 for edge in edges)
    assert not lines(ax, "self-loops")
    assert "2 edges  ·  parallel arcs dropped: 1  ·  self-loops dropped: 1" in title(ax)


def test_free_places_are_black_and_unexplored_ones_grey(figure1):
    ax = plot_topology(figure1)
    for gid, cell_class, colour in (
        ("free-dots", hn.CellClass.FREE, style.INK),
        ("unexplored-dots", hn.CellClass.UNEXPLORED, style.UNEXPLORED_NODE),
    ):
        expected = figure1.positions[figure1.classes == cell_class]
        np.testing.assert_allclose(points(ax, gid), expected)
        assert same_color(found(ax, gid).get_facecolor()[0], colour)
    assert labels(ax) == ["free place", "unexplored place", "arc", "parallel arcs", "self-loop"]


def test_noise_is_left_out_and_counted():
    cells = np.full((30, 30), 0.0)
    cells[5, 5] = 0.5
    cells[15:22, 15:22] = 0.5
    grid = hn.OccupancyGrid(cells.astype(np.float32), hn.Frame(0.1), name="speck", robot_radius_m=0)
    level = DualGraphPyramid.build(grid, merge_distance_m=10.0)[-1]
    ax = plot_topology(level)
    assert len(points(ax, "unexplored-dots")) == 1
    assert len(lines(ax, "self-loops")) == 1
    assert "places under 0.1 m² not drawn: 1" in title(ax)
    everything = plot_topology(level, least_area_m2=0.0)
    assert len(points(everything, "unexplored-dots")) == 2
    assert len(lines(everything, "self-loops")) == 2
    assert "not drawn" not in everything.get_title()


@SOME
@given(scenes(max_side=20), st.integers(0, 9))
def test_loops_enclose_what_inclusion_says(scene, index):
    pyramid = DualGraphPyramid.build(
        scene.grid, merge_distance_m=scene.merge_distance_m, seed=scene.seed
    )
    topology, level = hn.TopologicalMap(pyramid), pyramid[-1]
    for place in np.unique(level.arcs[level.is_self_loop, 0]).tolist():
        loops = Loops(Field(level, place, WIDE))
        inside = np.any(list(loops.enclosed.values()), axis=0)
        rows, cols = (np.argwhere(inside) + loops.field.corner).T
        held = np.unique(level.field_of[rows, cols])
        assert held[held >= 0].tolist() == topology.encloses(place).places.tolist()
    lower = pyramid[min(index, len(pyramid) - 1)]
    for place in np.unique(lower.arcs[lower.is_self_loop, 0]).tolist():
        loops = Loops(Field(lower, place, WIDE))
        for loop in loops.enclosed:
            endpoints = loops.curve(loop)[[0, -1]]
            np.testing.assert_allclose(endpoints, lower.cells[[place, place]] + 0.5)


@SOME
@given(scenes(max_side=20), st.integers(0, 9))
def test_an_arc_joins_its_two_places_on_every_map(scene, index):
    level = level_of(scene, index)
    for arc in np.flatnonzero(~level.is_self_loop)[:20].tolist():
        endpoints = level.arcs[arc].tolist()
        one, other = (Field(level, end, WIDE) for end in endpoints)
        curve = Arc(one, other, level.boundary(arc)).curve()
        np.testing.assert_allclose(curve[[0, -1]], level.cells[endpoints] + 0.5)


@SOME
@given(scenes(max_side=16), st.integers(0, 9))
def test_a_boundary_is_one_line_from_face_to_face(scene, index):
    level = level_of(scene, index)
    for arc in range(level.n_arcs):
        line = boundary_line(level, arc)
        assert len(line) == len(level.boundary(arc)) + 1
        assert (np.abs(np.diff(line, axis=0)).sum(axis=1) == 1).all()


@SOME
@given(scenes(max_side=16), st.integers(1, 9))
def test_dual_edges_end_at_their_dual_vertices(scene, index):
    level = level_of(scene, index)
    dual, drawing = level.dual, Boundaries(level)
    incident = dict.fromkeys(range(dual.n_faces), 0)
    for line, faces in zip(drawing.lines, dual.edges.tolist(), strict=True):
        for face, end in zip(faces, line[[0, -1]], strict=True):
            incident[face] += 1
            if face in drawing.holes:
                assert any((link[0] == end).all() for link in drawing.holes[face].links)
    for face, hole in drawing.holes.items():
        assert dual.kinds[face] != FaceKind.ORDINARY
        assert len(hole.links) == incident[face]
        for link in hole.links:
            np.testing.assert_allclose(link[-1], drawing.positions[face])
    holes = [face for face, kind in enumerate(dual.kinds) if kind != FaceKind.ORDINARY]
    assert sorted(drawing.holes) == holes


def test_the_dual_of_figure_1_shows_a_ring_a_hole_and_the_outside(figure1):
    ax = plot_dual(figure1)
    assert len(lines(ax, "dual-edges")) == figure1.n_arcs
    rings = [line for line in lines(ax, "dual-edges") if np.allclose(line[0], line[-1])]
    assert len(rings) == 1
    island = place_of(figure1, hn.CellClass.UNEXPLORED, largest=False)
    assert Curve(rings[0]).contains_point(figure1.positions[island])
    np.testing.assert_allclose(points(ax, "ordinary-faces"), rings[0][[0]])
    ((x, y),) = points(ax, "protected-faces")
    assert figure1.grid.classes[tuple(figure1.grid.frame.cells_of((x, y)))] == 0
    assert len(points(ax, "outside-faces")) == 1
    assert len(lines(ax, "protected-links")) == 3
    assert len(lines(ax, "outside-links")) == 2
    markers = {
        len(found(ax, f"{kind}-faces").get_paths()[0].vertices)
        for kind in ("ordinary", "protected", "outside")
    }
    assert len(markers) > 1
    assert labels(ax)[1:] == ["meeting point or ring", "protected: a hole", "outside"]


def test_figure_1_sets_both_graphs_side_by_side(figure1, tmp_path):
    surfaces, simple, graph, dual = plot_figure1(figure1, width_in=7.0)
    assert not lines(surfaces, "edges")
    assert len(lines(simple, "edges")) == 2
    assert len(lines(graph, "parallel-arcs")) == 2
    assert len(lines(graph, "self-loops")) == 1
    assert len(lines(dual, "dual-edges")) == 4
    save_figure(surfaces, tmp_path / "figure.png", dpi=60)
    assert (tmp_path / "figure.png").stat().st_size > 1000


@pytest.mark.parametrize("width", [3.0, 7.0])
def test_panels_and_legends_of_figure_1_do_not_touch(figure1, width):
    figure = plot_figure1(figure1, width_in=width)[0].figure.figure
    figure.draw_without_rendering()
    boxes = [ax.get_window_extent() for ax in figure.axes]
    boxes += [ax.title.get_window_extent() for ax in figure.axes if ax.title.get_text()]
    boxes += [legend.get_window_extent() for ax in figure.axes if (legend := ax.get_legend())]
    for index, box in enumerate(boxes):
        assert box.y0 >= figure.bbox.y0 - 1
        assert box.y1 <= figure.bbox.y1 + 1
        assert not any(box.overlaps(other) for other in boxes[:index])


def test_given_axes_are_drawn_on_and_their_figure_is_left_alone(figure1):
    figure = Figure(figsize=(9, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    assert plot_topology(figure1, ax=left, title="mine") is left
    assert plot_dual(figure1.level, ax=right, title="") is right
    assert (left.get_title(), right.get_title()) == ("mine", "")
    assert tuple(figure.get_size_inches()) == (9, 4)


def test_figure_1_is_drawn_on_four_given_axes(figure1):
    figure = Figure(figsize=(9, 7), layout="constrained")
    axes = figure.subplots(2, 2).flatten().tolist()
    assert plot_figure1(figure1, axes=axes) == tuple(axes)
    assert tuple(figure.get_size_inches()) == (9, 7)
    assert len(lines(axes[2], "parallel-arcs")) == 2
    with pytest.raises(hn.errors.InvalidValueError, match="4 panels, got 3 axes"):
        plot_figure1(figure1, axes=axes[:3])


@pytest.mark.parametrize("plot", [plot_topology, plot_dual])
def test_maps_without_arcs_are_drawn(plot):
    for rows in ((".",), ("#",), (".#.", "###", "?#?")):
        level = DualGraphPyramid.build(occupancy_grid(drawn(*rows)), merge_distance_m=4.0)[-1]
        assert level.grid.name in plot(level).get_title()


@pytest.mark.parametrize("plot", [plot_topology, plot_dual, plot_figure1])
def test_a_level_too_large_for_a_graph_is_refused(plot):
    grid = hn.OccupancyGrid(np.zeros((150, 150), np.float32))
    base = DualGraphPyramid.build(grid, merge_distance_m=4.0)[0]
    with pytest.raises(
        hn.errors.InvalidValueError, match="up to 20000 vertices, level 0 has 22500"
    ):
        plot(base)


@pytest.mark.parametrize("clearance", [1.0, 20.0, 40.0])
def test_a_curve_stays_in_the_window_where_no_cell_is_clear_enough(clearance):
    rng = np.random.default_rng(0)
    rows = 6 + np.cumsum(rng.integers(-1, 2, 20)).clip(-4, 4)
    walk = np.column_stack([rows, np.arange(1, 21)]).astype(np.float64)
    mask = rng.random((12, 22)) < 0.3
    mask[rows, np.arange(1, 21)] = mask[rows[:-1], np.arange(2, 21)] = True
    curve = smoothed(walk, distance_to_rim(mask), clearance)
    assert (curve >= -0.5).all()
    assert (curve <= np.array(mask.shape) - 0.5).all()
    assert curve[[0, -1]].tolist() == walk[[0, -1]].tolist()
