"""A level and its dual as networkx graphs: for views and files, never for a hot path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import networkx as nx
import numpy as np

from hybridnav.grid import CellClass
from hybridnav.pyramid.dual import FaceKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav.pyramid.level import Level


def to_networkx(level: Level) -> nx.MultiGraph[int]:
    """Return a level as a multigraph, with its parallel arcs and self-loops.

    All attributes are plain numbers, strings and lists, so that JSON preserves
    `networkx.node_link_data` of the graph.

    Parameters
    ----------
    level
        Any level of a pyramid.

    Returns
    -------
    networkx.MultiGraph
        Nodes are the vertices, by index: `cell` [row, col] (the surviving cell), `position` [x, y]
        (its centre in metres, map frame), `class` ("free" or "unexplored"), `area_m2`. Edges are
        the arcs, their key the index of the arc: `max_distance_m`, `through_m`, `n_cracks` (cell
        sides of the boundary) and `base_pair` [[row, col], [row, col]], the two cells of the base
        edge that stands for the arc. The graph has the `name` of the map, the index of the `level`
        and `resolution_m`.
    """
    graph: nx.MultiGraph[int] = nx.MultiGraph(**_of_graph(level))
    graph.add_nodes_from(vertices_with_attributes(level))
    attributes = zip(
        level.arcs.tolist(),
        level.max_distance_m.tolist(),
        level.through_m.tolist(),
        level.base_pairs.tolist(),
        strict=True,
    )
    for arc, ((start, end), distance_m, through_m, pair) in enumerate(attributes):
        graph.add_edge(
            start,
            end,
            key=arc,
            max_distance_m=distance_m,
            through_m=through_m,
            n_cracks=len(level.boundary(arc)),
            base_pair=pair,
        )
    return graph


def dual_to_networkx(level: Level) -> nx.MultiGraph[int]:
    """Return the dual of a level as a multigraph: meeting points and holes, joined by boundaries.

    A vertex without an arc has no face here, although the plane round it is one; `n_isolated` of
    the graph counts these vertices, so that vertices - edges + faces = 2 components - `n_isolated`.

    Parameters
    ----------
    level
        Any level of a pyramid.

    Returns
    -------
    networkx.MultiGraph
        Nodes are the faces, by index in `level.dual`: `kind` ("ordinary", "protected" or
        "outside"). Edges are the dual edges, one for each arc and with its index as key: `length_m`
        and `n_cracks` of the boundary (for a self-loop, of the line of its dual edge through its
        own field), and `vertices` [u, v] on its two sides. The graph has the attributes of
        `to_networkx` and `n_isolated`.
    """
    isolated = level.n_vertices - len(np.unique(level.arcs))
    graph: nx.MultiGraph[int] = nx.MultiGraph(**_of_graph(level), n_isolated=isolated)
    dual = level.dual
    for face, kind in enumerate(dual.kinds.tolist()):
        graph.add_node(face, kind=FaceKind(kind).name.lower())
    for arc, (right, left) in enumerate(dual.edges.tolist()):
        n_cracks = len(level.boundary(arc))
        graph.add_edge(
            right,
            left,
            key=arc,
            length_m=n_cracks * level.grid.resolution_m,
            n_cracks=n_cracks,
            vertices=level.arcs[arc].tolist(),
        )
    return graph


def vertices_with_attributes(level: Level) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield each vertex with the attributes of its node in `to_networkx`."""
    grid = level.grid
    columns = zip(
        level.cells.tolist(),
        grid.frame.points_of(level.cells).tolist(),
        level.classes.tolist(),
        (level.areas * np.float64(grid.resolution_m**2)).tolist(),
        strict=True,
    )
    for vertex, (cell, position, cell_class, area_m2) in enumerate(columns):
        yield (
            vertex,
            {
                "cell": cell,
                "position": position,
                "class": CellClass(cell_class).name.lower(),
                "area_m2": area_m2,
            },
        )


def _of_graph(level: Level) -> dict[str, Any]:
    grid = level.grid
    return {"name": grid.name, "level": level.index, "resolution_m": grid.resolution_m}
