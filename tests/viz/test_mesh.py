"""Pictures of the mesh and of its search: what is drawn is where it is on the map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings

import hybridnav as hn
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from hybridnav.search.mesh import build_mesh, trace_search
from hybridnav.viz import plot_mesh, plot_search
from tests.search.mesh.test_trace import seeds, traced
from tests.strategies import class_grids, examples, occupancy_grid

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CELLS = np.zeros((9, 14), dtype=np.float32)
CELLS[3:6, 4:9] = 1.0


def turned() -> OccupancyGrid:
    """One block in a room, on a map with yaw."""
    frame = Frame(resolution_m=0.5, origin_m=(12.3, -7.1), yaw_rad=0.6)
    return OccupancyGrid(CELLS, frame=frame, robot_radius_m=0, name="turned")


def drawn_as(ax: Axes, gid: str) -> Any:
    """The one artist of that name."""
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


def test_a_search_is_drawn_with_its_roots_and_its_path() -> None:
    grid = turned()
    mesh = build_mesh(grid.classes == CellClass.FREE)
    trace = trace_search(mesh, ((4, 1), (4, 12)), ((4.5, 1.5), (4.5, 12.5)))
    ax = plot_search(grid, trace)
    assert trace.path.positions is not None
    points = grid.frame.points_of_grid(trace.path.positions)
    np.testing.assert_allclose(drawn_as(ax, "path").get_xydata(), points)
    offsets = np.asarray(drawn_as(ax, "roots").get_offsets()).round(6)
    roots = {tuple(root) for root in grid.frame.points_of_grid(trace.roots).round(6)}
    assert {tuple(point) for point in offsets} == roots
    views = drawn_as(ax, "views")
    assert len(views.get_paths()) == len(trace.parents) > 2
    shades = views.get_facecolor()
    lightness = np.asarray(shades)[:, :3] @ [0.299, 0.587, 0.114]
    assert (np.diff(lightness) < 0).all()
    legend = ax.get_legend()
    assert legend is not None
    assert "shortest path" in [text.get_text() for text in legend.get_texts()]


@settings(max_examples=examples(40), deadline=None)
@given(class_grids(max_side=14), seeds)
def test_what_is_drawn_as_seen_lies_in_free_space(classes: Any, seed: int) -> None:
    trace = traced(classes, seed)
    free = np.argwhere(classes == CellClass.FREE).astype(float)
    space = shapely.union_all(shapely.box(*free.T, *(free + 1).T)).buffer(1e-6)
    views = drawn_as(plot_search(occupancy_grid(classes), trace), "views").get_paths()
    for path, root in zip(views, trace.roots, strict=True):
        view = np.asarray(path.vertices)[:, ::-1]
        ring = shapely.convex_hull(shapely.MultiPoint(view))
        assert space.contains(ring)
        whole = shapely.convex_hull(shapely.MultiPoint([root, *view]))
        assert space.contains(whole)


def test_a_search_without_intervals_is_drawn_as_its_ends() -> None:
    grid = occupancy_grid(np.ones((3, 5), np.uint8))
    mesh = build_mesh(grid.classes == CellClass.FREE)
    trace = trace_search(mesh, ((0, 0), (2, 4)), ((0.5, 0.5), (2.5, 4.5)))
    ax = plot_search(grid, trace)
    assert len(drawn_as(ax, "path").get_xydata()) == 2
    assert "0 intervals" in ax.get_title()


def test_a_map_without_a_free_cell_has_a_picture() -> None:
    ax = plot_mesh(occupancy_grid(np.zeros((3, 5), np.uint8)))
    assert "0 polygons" in ax.get_title()


def test_a_mesh_of_another_map_is_refused() -> None:
    mesh = build_mesh(np.ones((3, 4), np.bool_))
    with pytest.raises(hn.InvalidValueError, match=r"\(3, 4\) cells, the grid has \(9, 14\)"):
        plot_mesh(turned(), mesh)
    trace = trace_search(mesh, ((0, 0), (2, 3)), ((0.5, 0.5), (2.5, 3.5)))
    with pytest.raises(hn.InvalidValueError, match="build it from the grid's free cells"):
        plot_search(turned(), trace)
