"""Pictures of a pyramid's steps and levels, of a mesh, and of searches: asked what they show."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

import hybridnav as hn
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.refine.ompl import Search
from hybridnav.search.mesh import build_mesh
from hybridnav.viz import plot_kernels, plot_levels, plot_mesh, plot_search
from tests.strategies import examples, full_but, occupancy_grid, scenes

MAPS = Path(__file__).parents[2] / "maps"
SOME = settings(max_examples=examples(4), deadline=None)


@pytest.fixture(scope="module")
def figure1():
    grid = hn.load_map(MAPS / "figure1" / "figure1.yaml", robot_radius_m=0)
    return DualGraphPyramid.build(grid, merge_distance_m=10.0)


def found(ax, gid):
    return next(artist for artist in ax.findobj() if artist.get_gid() == gid)


def points(ax, gid):
    return {tuple(at) for at in np.round(np.asarray(found(ax, gid).get_offsets()), 9).tolist()}


def labels(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def positions(level):
    return [tuple(at) for at in np.round(level.grid.frame.points_of(level.cells), 9).tolist()]


@SOME
@given(scenes())
def test_every_thick_line_joins_a_vertex_to_the_one_it_is_pulled_into(scene):
    pyramid = DualGraphPyramid.build(
        scene.grid, merge_distance_m=scene.merge_distance_m, seed=scene.seed
    )
    for lower, upper in itertools.pairwise(pyramid):
        ax = plot_kernels(pyramid, lower.index)
        at, parents = positions(lower), pyramid.parent(lower.index).tolist()
        survivors = positions(upper)
        joined = {
            frozenset({place, survivors[parent]})
            for place, parent in zip(at, parents, strict=True)
            if place != survivors[parent]
        }
        segments = found(ax, "contraction-kernel").get_segments()
        drawn = {frozenset(map(tuple, np.round(line[[0, -1]], 9).tolist())) for line in segments}
        assert drawn == joined
        assert len(segments) == lower.n_vertices - upper.n_vertices
        assert points(ax, "surviving") == set(survivors)
        assert points(ax, "not-surviving") == set(at) - set(survivors)


def test_thin_lines_are_the_arcs_of_the_next_level_and_dashed_ones_are_gone(figure1):
    for lower, upper in itertools.pairwise(figure1):
        if lower.n_vertices > 60:
            continue
        ax = plot_kernels(figure1, lower.index)
        kept, gone = (
            len(found(ax, gid).get_segments())
            for gid in ("arc-of-the-next-level", "removal-kernel")
        )
        assert kept == upper.n_arcs
        assert gone == lower.n_arcs - upper.n_arcs - (lower.n_vertices - upper.n_vertices)
        without = plot_kernels(figure1, lower.index, removed=False)
        assert not found(without, "removal-kernel").get_segments()
        assert "removal kernel" not in labels(without)


def test_arcs_of_a_small_step_have_numbers_and_axes_are_in_metres():
    small = DualGraphPyramid.build(
        hn.example_map("figure1", robot_radius_m=0.0), merge_distance_m=10.0, linkage="radius"
    )
    ax = plot_kernels(small, 6)
    numbers = {text.get_text(): text for text in ax.texts if text.get_gid() == "arc-number"}
    assert sorted(map(int, numbers)) == list(range(small[6].n_arcs))
    assert ax.get_xlabel() == "x in metres"
    assert len(ax.get_xticks()) > 2
    assert not any(text.get_gid() == "arc-number" for text in plot_kernels(small, 4).texts)
    # What the page on teaching says of the exercise.
    kinds = small[6].classes[small[6].arcs[[2, 17]]]
    assert (kinds[:, 0] != kinds[:, 1]).all()
    gone = set(small.removal_kernel(6).tolist()) | set(small.contraction_kernel(6).tolist())
    assert not gone & {2, 17}
    island = int(small[6].field_of[small.grid.frame.cell_of(1.0, 1.4)])
    of_island = np.flatnonzero((small[6].arcs == island).any(axis=1)).tolist()
    assert len(of_island) == 4
    assert gone & set(of_island) == {7, 13}
    y = [small.grid.frame.points_of(small[6].boundary(arc).reshape(-1, 2))[:, 1] for arc in (2, 17)]
    obstacle = np.argwhere(small[6].field_of[8:22, 16:30] < 0)[:, 0] + 8
    assert y[0].max() < obstacle.min() * 0.1 + 0.1
    assert y[1].min() > obstacle.max() * 0.1 - 0.1


def test_nothing_becomes_of_the_apex(figure1):
    with pytest.raises(IndexError):
        plot_kernels(figure1, -1)


def test_levels_are_panels_with_their_own_fields(figure1):
    axes = plot_levels(figure1, [2, 5, -1], columns=2, graph_up_to=30)
    assert [ax.get_title().split()[:2] for ax in axes] == [["level", n] for n in "259"]
    for ax, index in zip(axes, (2, 5, 9), strict=True):
        level = figure1[index]
        image = np.asarray(ax.images[0].get_array())[..., :3].astype(np.int64) @ [65536, 256, 1]
        inside = level.field_of >= 0
        shown = {
            (int(field), int(colour))
            for field, colour in zip(level.field_of[inside], image[inside], strict=True)
        }
        assert len(shown) == level.n_vertices  # one colour a field
        colour_of = dict(shown)
        pairs = level.arcs[~level.is_self_loop].tolist()
        assert all(colour_of[tail] != colour_of[head] for tail, head in pairs)
        has_graph = any(artist.get_gid() == "free-dots" for artist in ax.findobj())
        assert has_graph == (level.n_vertices <= 30)
    boxes = [ax.get_position() for ax in axes]
    assert boxes[0].x1 < boxes[1].x0
    assert boxes[2].y1 < boxes[0].y0


def test_levels_need_a_level_and_a_column(figure1):
    with pytest.raises(hn.errors.InvalidValueError, match="at least one level"):
        plot_levels(figure1, [])
    with pytest.raises(hn.errors.InvalidValueError, match="one column"):
        plot_levels(figure1, columns=0)
    with pytest.raises(hn.errors.InvalidValueError, match="2 levels need as many axes, got 1"):
        plot_levels(figure1, [0, 1], axes=[Figure().add_subplot()])
    with pytest.raises(IndexError):
        plot_levels(figure1, [99])


@pytest.mark.parametrize("width", full_but([3.0, 12.0], [3.0, 7.0, 12.0]))
def test_titles_of_levels_do_not_collide(figure1, width):
    axes = plot_levels(figure1, columns=3, width_in=width)
    figure = axes[0].figure.figure
    figure.draw_without_rendering()
    boxes = [box for ax in axes for box in (ax.title.get_window_extent(), ax.get_window_extent())]
    for first, second in itertools.combinations(boxes, 2):
        assert Bbox.intersection(first.padded(-1), second.padded(-1)) is None
    assert all(box.y1 <= figure.bbox.y1 + 1 for box in boxes)


def test_levels_are_drawn_on_axes_given(figure1):
    axes = Figure(figsize=(9, 4)).subplots(1, 2).tolist()
    assert plot_levels(figure1, [2, -1], axes=axes) == tuple(axes)
    assert tuple(axes[0].figure.get_size_inches()) == (9, 4)


def test_a_search_is_drawn_where_it_was_and_only_its_corridor_is_tinted(figure1):
    grid = figure1.grid
    corridor = np.zeros(grid.shape, dtype=np.bool_)
    corridor[2:9, 2:12] = True
    search = Search(states=[(0.5, 0.5), (0.9, 0.7)], edges=[(0.5, 0.5, 0.9, 0.7)])
    planner = hn.HybridPlanner(hn.TopologicalMap(figure1), preset="grid-astar")
    path = planner.plan((0.5, 0.5), (0.9, 0.7)).path
    ax = plot_search(grid, search, corridor=corridor, path=path)
    assert points(ax, "states") == {(0.5, 0.5), (0.9, 0.7)}
    np.testing.assert_allclose(found(ax, "motions").get_segments(), [[[0.5, 0.5], [0.9, 0.7]]])
    np.testing.assert_allclose(found(ax, "path").get_xydata(), path.points)
    image = np.asarray(ax.images[0].get_array())[..., :3]
    outside = image[~corridor & (grid.classes == hn.CellClass.FREE)]
    assert not (outside == image[3, 3]).all(axis=1).any()
    assert (image[corridor & (grid.classes == hn.CellClass.FREE)] == image[3, 3]).all()
    assert {"states drawn", "motions of the trees", "path", "corridor"} <= set(labels(ax))


@pytest.mark.parametrize("given", [np.int64, np.uint8, list])
def test_a_corridor_of_numbers_tints_the_cells_that_a_mask_tints(figure1, given):
    corridor = np.zeros(figure1.grid.shape, dtype=np.bool_)
    corridor[2:9, 2:12] = True
    numbers = corridor.astype(int).tolist() if given is list else corridor.astype(given)
    drawn, tinted = (
        np.asarray(plot_search(figure1.grid, None, corridor=mask).images[0].get_array())
        for mask in (corridor, numbers)
    )
    np.testing.assert_array_equal(tinted, drawn)


def test_a_search_that_looked_at_nothing_and_a_corridor_of_another_map(figure1):
    ax = plot_search(figure1.grid, None)
    assert "0 states" in ax.get_title()
    assert labels(ax) == ["occupied"]
    with pytest.raises(hn.errors.InvalidValueError, match="corridor has"):
        plot_search(figure1.grid, None, corridor=np.zeros((3, 4), dtype=np.bool_))


CELLS = np.zeros((9, 14), dtype=np.float32)
CELLS[3:6, 4:9] = 1.0


def turned() -> OccupancyGrid:
    """One block in a room, on a map with yaw."""
    frame = Frame(resolution_m=0.5, origin_m=(12.3, -7.1), yaw_rad=0.6)
    return OccupancyGrid(CELLS, frame=frame, robot_radius_m=0, name="turned")


def drawn_as(ax: Axes, gid: str) -> Any:
    (found,) = ax.findobj(lambda artist: artist.get_gid() == gid)
    return found


def test_the_polygons_of_the_mesh_cover_the_free_cells_where_they_are() -> None:
    grid = turned()
    ax = plot_mesh(grid)
    polygons = drawn_as(ax, "polygons")
    rings = [shapely.Polygon(np.asarray(path.vertices)) for path in polygons.get_paths()]
    mesh = build_mesh(grid.classes == CellClass.FREE)
    assert len(rings) == mesh.n_polygons
    area_m2 = float((grid.classes == CellClass.FREE).sum()) * 0.25
    assert shapely.union_all(rings).area == pytest.approx(area_m2)
    centres = shapely.points(grid.frame.points_of(np.argwhere(grid.classes == CellClass.FREE)))
    assert shapely.contains_xy(shapely.union_all(rings), *shapely.get_coordinates(centres).T).all()
    corners = drawn_as(ax, "corners")
    block = grid.frame.points_of_grid([[3, 4], [3, 9], [6, 4], [6, 9]])
    offsets = np.asarray(corners.get_offsets())
    assert {tuple(point) for point in offsets.round(6)} == {tuple(p) for p in block.round(6)}
    sides = drawn_as(ax, "sides")
    assert len(sides.get_segments()) == (mesh.twins >= 0).sum() // 2
    assert ax.get_title() == f"turned  ·  {mesh.n_polygons} polygons  ·  4 convex corners"


def test_a_map_without_a_free_cell_has_a_picture() -> None:
    ax = plot_mesh(occupancy_grid(np.zeros((3, 5), np.uint8)))
    assert "0 polygons" in ax.get_title()


def test_a_mesh_of_another_map_is_refused() -> None:
    mesh = build_mesh(np.ones((3, 4), np.bool_))
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"\(3, 4\) cells, the grid has \(9, 14\)"
    ):
        plot_mesh(turned(), mesh)
