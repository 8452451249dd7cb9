"""Receptive fields as polygons and boundaries as lines, in the map frame (shapely)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

from hybridnav.pyramid import _outline_kernels

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import LongArray
    from hybridnav.pyramid.level import Level

    Geometries = NDArray[np.object_]


def field_polygons(level: Level, *, noded: bool = False) -> Geometries:
    """Return the receptive field of every vertex as a polygon.

    Parameters
    ----------
    level
        The level of a pyramid.
    noded
        Whether to keep, on straight sides, the points where three or more fields (or two fields and
        a cell that is no vertex) meet. Polygons with them share all their points with their
        neighbours, so that unions and other overlays of them are exact on a map with any yaw;
        without them an outline has only its turns.

    Returns
    -------
    Geometries
        object (n_vertices,) of `shapely.Polygon`, `(x, y)` in metres, map frame. Valid; the outer
        ring is counter-clockwise, holes are clockwise; rings touch each other at points at most.
        The union of the closed squares of the cells of each field.
    """
    grid = level.grid
    starts, fields, sizes = _outline_kernels.find_rings(level.field_of, noded)
    order = np.argsort(fields, kind="stable")
    ring_offsets = _offsets(sizes[order])
    corners = _outline_kernels.ring_corners(level.field_of, starts[order], ring_offsets, noded)
    rings_of = np.bincount(fields, minlength=level.n_vertices)
    return shapely.from_ragged_array(
        shapely.GeometryType.POLYGON,
        grid.frame.points_of_grid(corners),
        (ring_offsets, _offsets(rings_of)),
    )


def boundary_lines(level: Level) -> Geometries:
    """Return the boundary of every arc as a line along the sides between its cell pairs.

    Parameters
    ----------
    level
        The level of a pyramid.

    Returns
    -------
    Geometries
        object (n_arcs,) of `shapely.LineString`, `(x, y)` in metres, map frame, without points on
        straight stretches. A line leads from the face `level.dual.edges[arc, 0]` to the face
        `level.dual.edges[arc, 1]` and has the field of `level.arcs[arc, 0]` on its left; where both
        are one face it may be closed. The line of a self-loop lies inside its field. Its ends lie
        on the outline, at a cell that is no vertex, or on another line that leads to that face.
    """
    field_of = level.field_of
    loops = level.is_self_loop
    edges, arc = level.boundary_table
    of_loop = loops[arc]
    members = edges[of_loop]
    bounds = _offsets(np.bincount(arc[of_loop], minlength=level.n_arcs))
    offsets, corners = _outline_kernels.boundary_corners(
        field_of, level.base_edges, members, bounds
    )
    return shapely.from_ragged_array(
        shapely.GeometryType.LINESTRING, level.grid.frame.points_of_grid(corners), (offsets,)
    )


def _offsets(sizes: LongArray) -> LongArray:
    """Return the start of each of consecutive runs, and the end of the last one."""
    offsets: LongArray = np.zeros(len(sizes) + 1, dtype=np.int64)
    np.cumsum(sizes, out=offsets[1:])
    return offsets
