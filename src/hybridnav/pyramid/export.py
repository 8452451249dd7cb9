"""Levels and their duals as networkx graphs: for views and files, never for a hot path.

All attributes are plain numbers, strings and lists, so that JSON preserves the
`networkx.node_link_data` of a graph.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.maps import CellClass

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    import networkx as nx

    from hybridnav._base.typing import ByteArray, IntArray, LongArray
    from hybridnav.maps import OccupancyGrid

Node = tuple[int, dict[str, Any]]


def multigraph(
    about: dict[str, Any],
    nodes: Iterable[Node],
    endpoints: IntArray | LongArray,
    **columns: list[Any],
) -> nx.MultiGraph[int]:
    """Return a multigraph with an edge for each arc, parallel arcs and self-loops included.

    Parameters
    ----------
    about
        Attributes of the graph.
    nodes
        Nodes with their attributes.
    endpoints
        int (n_arcs, 2), the nodes that each arc joins; the key of an edge is the index of its arc.
    columns
        Attributes of the edges, a value for each arc.
    """
    from networkx import MultiGraph  # noqa: PLC0415 - only who looks at graphs pays

    graph: nx.MultiGraph[int] = MultiGraph(**about)
    graph.add_nodes_from(nodes)
    for arc, (pair, *values) in enumerate(zip(endpoints.tolist(), *columns.values(), strict=True)):
        graph.add_edge(pair[0], pair[1], key=arc, **dict(zip(columns, values, strict=True)))
    return graph


def vertices_with_attributes(
    grid: OccupancyGrid, cells: LongArray, classes: ByteArray, areas: LongArray
) -> Iterator[Node]:
    """Yield each vertex with the attributes of its node in `Level.to_networkx`.

    Parameters
    ----------
    grid
        The map.
    cells
        int64 (n, 2), the surviving cells.
    classes
        uint8 (n,), their `CellClass`.
    areas
        int64 (n,), cells of the receptive fields.
    """
    columns = zip(
        cells.tolist(),
        grid.frame.points_of(cells).tolist(),
        classes.tolist(),
        (areas * np.float64(grid.cell_area_m2)).tolist(),
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
