"""What holds for the polygons of every convex mesh."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from hybridnav.search.mesh import ConvexMesh, MeshSearch
from hybridnav.search.mesh.build import find_edges

KINDS = "intervals", "landmarks", "hierarchy"
"""What a search of a mesh may search."""


def search_of(mesh: ConvexMesh, kind: str) -> MeshSearch:
    """A search of intervals, or one that has prepared its graph of corners, contracted or not."""
    search = MeshSearch(mesh)
    if kind == "intervals":
        return search
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "hybridnav.search.mesh.build._MOST_LOOKED", 0 if kind == "landmarks" else 10**6
        )
        search.prepare()
    return search


def polygon(mesh: ConvexMesh, number: int) -> NDArray[Any]:
    """Corners of a polygon as (x, y), counter-clockwise."""
    slots = slice(mesh.first[number], mesh.first[number + 1])
    return mesh.corners[mesh.begins[slots]][:, ::-1].astype(np.int64)


def twice_the_area(mesh: ConvexMesh) -> int:
    """Twice the area of all polygons that belong to a component, each of them convex."""
    twice = 0
    for number in np.flatnonzero(mesh.component >= 0).tolist():
        points = polygon(mesh, number)
        ahead = np.roll(points, -1, axis=0) - points
        behind = points - np.roll(points, 1, axis=0)
        assert (behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0] >= 0).all()
        x, y = points.T
        twice += int((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
    return twice


def endpoints_of_sides(mesh: ConvexMesh) -> NDArray[Any]:
    """The corner at which each side ends."""
    endpoints = np.roll(mesh.begins, -1)
    endpoints[mesh.first[1:] - 1] = mesh.begins[mesh.first[:-1]]
    return endpoints


def assert_sides_agree(mesh: ConvexMesh) -> None:
    """Hold that twins are each other's, and run the other way."""
    crossable = np.flatnonzero(mesh.twins >= 0)
    assert (mesh.twins[mesh.twins[crossable]] == crossable).all()
    assert (mesh.begins[mesh.twins[crossable]] == endpoints_of_sides(mesh)[crossable]).all()
    assert (mesh.component[mesh.polygon_of[crossable]] >= 0).all()


def corners_in_use(mesh: ConvexMesh) -> set[tuple[int, ...]]:
    """Row, column and kind of each corner of the polygons that belong to a component; each point
    once."""
    used = np.unique(mesh.begins[mesh.component[mesh.polygon_of] >= 0])
    found = np.column_stack([mesh.corners[used], mesh.kinds[used]]).tolist()
    assert len({(row, col) for row, col, _ in found}) == len(found)
    return {tuple(corner) for corner in found}


def edges_between_corners(mesh: ConvexMesh) -> set[tuple[int, int]]:
    """The edges of the graph of corners, each of which has its reverse."""
    edges = find_edges(mesh.arrays)
    assert edges is not None
    first, heads = edges
    tails = np.repeat(np.arange(len(mesh.corners)), np.diff(first[::2]))
    found = set(zip(tails.tolist(), heads.tolist(), strict=True))
    assert len(found) == len(heads)
    assert found == {(head, tail) for tail, head in found}
    return found
