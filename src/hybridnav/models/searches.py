"""Prepared meshes and graphs of planners as parts of a model, and back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import BaseModel, ConfigDict

from hybridnav._base.typing import IntArray, LongArray
from hybridnav.models.container import FiledPart, Part
from hybridnav.models.parts import values_of
from hybridnav.models.structures import (
    CORNER_EDGES,
    CORNER_GRAPH,
    CORNER_HIERARCHY,
    JUMP_GRAPH,
    MESH,
    refusal,
)
from hybridnav.planning import PlannerSettings
from hybridnav.search import mesh as meshes
from hybridnav.search import octile as jumps

if TYPE_CHECKING:  # a plan of one preset loads no other
    from hybridnav.search.mesh import ConvexMesh, CornerGraph, CornerHierarchy, MeshSearch
    from hybridnav.search.octile import JumpSearch

_FRAME = 2
"""Rows and columns of the frame of blocked cells round a jump-point graph."""
_SIDES = 3
"""Least number of sides of a polygon."""


class _Values(BaseModel):
    model_config = ConfigDict(defer_build=True, extra="ignore", frozen=True)


class _MeshValues(_Values):
    is_prepared: bool
    expanded: int


class _JumpValues(_Values):
    origin: tuple[int, int]
    shape: tuple[int, int]


def made_for(settings: PlannerSettings) -> dict[str, Any]:
    """Return the settings, beside the grid, that determine the preparations of a planner."""
    return {"made_for": {"allow_unexplored": settings.allow_unexplored}}


def search_parts(prepared: Any, key: dict[str, Any]) -> list[Part]:
    """Return the parts for the preparations of a planner.

    `prepared`: `HybridPlanner.prepared`; `key`: of `made_for`.
    """
    if isinstance(prepared, meshes.MeshSearch):
        return _mesh_parts(prepared, key)
    return _jump_parts(prepared, key)


def search_of(
    filed: Sequence[FiledPart], method: str, key: dict[str, Any], known: dict[str, int]
) -> object | None:
    """Read the preparations for a planner of some settings; return None if the model has none.

    `filed`: all parts of the model; `method`: the setting `planner.method`; `key`: of `made_for`;
    `known`: sizes of the map. Raises `ModelError` when a part is not as it was written.
    """
    fitting = {part.kind: part for part in filed if part.values.get("made_for") == key["made_for"]}
    if method == "shortest" and MESH.kind in fitting:
        return _mesh_of(fitting, known)
    if method == "octile" and JUMP_GRAPH.kind in fitting:
        return _jumps_of(fitting, known)
    return None


def _mesh_parts(search: MeshSearch, key: dict[str, Any]) -> list[Part]:
    # Another thread may be building: that the graph is there is read before the graph.
    is_prepared, mesh, graph = search.is_prepared, search.mesh, search.graph
    sizes = {
        "corners": len(mesh.corners),
        "polygons": mesh.n_polygons,
        "slots": len(mesh.begins),
        "blocks": len(mesh.block_head),
    }
    values = key | {"is_prepared": is_prepared, "expanded": search.expanded}
    parts = [MESH.part(mesh, sizes, values)]
    if search.edges is None or graph is None:
        return parts
    sizes = {"corners": len(mesh.corners), "edges": len(search.edges[1])}
    if isinstance(graph, meshes.CornerGraph):
        sizes["landmarks"] = graph.landmark_distances.shape[1]
        return [*parts, CORNER_GRAPH.part(graph, sizes, key)]
    edges = dict(zip(("first", "heads"), search.edges, strict=True))
    of_arcs = {"corners": len(mesh.corners), "arcs": len(graph.arcs)}
    return [
        *parts,
        CORNER_EDGES.part(edges, sizes, key),
        CORNER_HIERARCHY.part(graph, of_arcs, key),
    ]


def _mesh_of(fitting: dict[str, FiledPart], known: dict[str, int]) -> MeshSearch:
    values = values_of(_MeshValues, fitting[MESH.kind])
    mesh = meshes.ConvexMesh(**MESH.read(fitting[MESH.kind], known))
    _check_mesh(fitting[MESH.kind], mesh)
    search = meshes.MeshSearch(mesh)
    search.expanded = values.expanded
    if values.is_prepared:
        search.adopt(*_corners_of(fitting, known, len(search.mesh.corners)))
    return search


def _check_mesh(filed: FiledPart, mesh: ConvexMesh) -> None:
    """Refuse sides that do not belong together, and blocks that form no tree: searches walk from
    side to side, and up the tree."""
    twins, finishes = mesh.twins, mesh.finishes
    slots = np.flatnonzero(twins >= 0)
    behind = twins[slots]
    size = np.diff(mesh.first)
    if (mesh.polygon_of != np.repeat(np.arange(mesh.n_polygons), size)).any() or (
        size < _SIDES
    ).any():
        raise refusal(filed, "polygon_of and first name other polygons")
    is_joined = (twins[behind] == slots) & (mesh.begins[behind] == finishes[slots])
    if not (is_joined & (finishes[behind] == mesh.begins[slots])).all():
        raise refusal(filed, "twins are not each other's, or do not run the other way")
    deep = np.flatnonzero(mesh.block_up >= 0)
    above = mesh.block_head[mesh.block_up[deep]]
    is_tree = (mesh.depth[above] == mesh.depth[deep] - 1).all()
    if not is_tree or (mesh.depth[mesh.block_up < 0] != 0).any():
        raise refusal(filed, "depth is not that of a tree of blocks")


def _corners_of(
    fitting: dict[str, FiledPart], known: dict[str, int], n_corners: int
) -> tuple[tuple[LongArray, IntArray] | None, CornerGraph | CornerHierarchy | None]:
    for structure in (CORNER_GRAPH, CORNER_EDGES, CORNER_HIERARCHY):
        if structure.kind in fitting:
            _check_same(fitting[structure.kind], "corners", n_corners)
    if CORNER_GRAPH.kind in fitting:
        graph = meshes.CornerGraph(**CORNER_GRAPH.read(fitting[CORNER_GRAPH.kind], known))
        _check_edges(fitting[CORNER_GRAPH.kind], graph.first, graph.heads)
        return (graph.first, graph.heads), graph
    if CORNER_HIERARCHY.kind not in fitting:
        return None, None
    filed = fitting[CORNER_HIERARCHY.kind]
    if CORNER_EDGES.kind not in fitting:
        raise refusal(filed, f"the {CORNER_EDGES.kind} are missing")
    edges = CORNER_EDGES.read(fitting[CORNER_EDGES.kind], known)
    arrays = CORNER_HIERARCHY.read(filed, known)
    _check_edges(fitting[CORNER_EDGES.kind], edges["first"], edges["heads"])
    _check_arcs(filed, arrays)
    return (edges["first"], edges["heads"]), meshes.CornerHierarchy(**arrays)


def _check_edges(filed: FiledPart, first: LongArray, heads: IntArray) -> None:
    """Refuse edges without their reverse."""
    from hybridnav.search.contraction import have_reverses  # noqa: PLC0415 - loads numba

    if not have_reverses(first[::2], heads):
        raise refusal(filed, "an edge has no reverse")


def _jump_parts(search: JumpSearch, key: dict[str, Any]) -> list[Part]:
    graph = search.graph
    sizes = {
        "words": len(graph.index),
        "free": len(graph.ahead),
        "corners": graph.n_corners,
        "arcs": len(graph.arcs),
        "middles": len(graph.middles),
    }
    values = key | {"origin": list(graph.origin), "shape": list(graph.shape)}
    return [JUMP_GRAPH.part(graph, sizes, values)]


def _jumps_of(fitting: dict[str, FiledPart], known: dict[str, int]) -> JumpSearch:
    filed = fitting[JUMP_GRAPH.kind]
    values = values_of(_JumpValues, filed)
    sizes, (height, width) = filed.part.sizes, values.shape
    arrays = JUMP_GRAPH.read(filed, known)
    row, col = values.origin
    inside = -1 <= row <= known["rows"] + 1 - height and -1 <= col <= known["cols"] + 1 - width
    words = -(height * width // -64)
    if not inside or min(height, width) < _FRAME or words != sizes["words"]:
        raise refusal(filed, f"a frame at {values.origin} of {values.shape}")
    if sizes["middles"] not in {0, sizes["arcs"]}:
        raise refusal(filed, f"{sizes['middles']} middles for {sizes['arcs']} arcs")
    _check_index(filed, arrays["index"])
    _check_arcs(filed, arrays)
    return jumps.JumpSearch(jumps.JumpGraph(values.origin, values.shape, **arrays))


def _check_arcs(filed: FiledPart, arrays: dict[str, Any]) -> None:
    """Refuse arcs to corners, and references to arcs, that do not exist.

    Refuse also shortcuts that do not cost what their two arcs cost: as each of these costs less,
    unpacking ends.
    """
    from hybridnav._base.moves import FAR  # noqa: PLC0415 - loads numba
    from hybridnav.search.contraction import HEAD_SHIFT  # noqa: PLC0415 - loads numba

    heads, middles = arrays["arcs"][:, 1] >> HEAD_SHIFT, arrays["middles"]
    shortcuts = np.flatnonzero(middles >= 0)
    past = middles[shortcuts]
    room = np.diff(arrays["first"])[past >> 32]
    if (heads >= filed.part.sizes["corners"]).any():
        raise refusal(filed, "arcs lead to corners that do not exist")
    if ((past >> 16 & 0xFFFF) >= room).any() or ((past & 0xFFFF) >= room).any():
        raise refusal(filed, "middles name arcs that do not exist")
    costs, begin = arrays["arcs"][:, 0], arrays["first"][past >> 32]
    parts = costs[begin + (past >> 16 & 0xFFFF)] + costs[begin + (past & 0xFFFF)]
    if not ((costs > 0) & (costs < FAR)).all() or (costs[shortcuts] != parts).any():
        raise refusal(filed, "arcs cost nothing, or other than the two that they stand for")


def _check_index(filed: FiledPart, index: LongArray) -> None:
    """Refuse an index of cells whose counts differ from its bits."""
    counts = np.bitwise_count(index[:, :2].view(np.uint64)).astype(np.int64)
    before = np.zeros((len(index) + 1, 2), dtype=np.int64)
    np.cumsum(counts, axis=0, out=before[1:])
    sizes = filed.part.sizes
    stated = (index[:, 2] == (before[:-1, 0] << 32 | before[:-1, 1])).all()
    if not stated or before[-1].tolist() != [sizes["free"], sizes["corners"]]:
        raise refusal(filed, "index holds other counts than its bits")


def _check_same(filed: FiledPart, name: str, wanted: int) -> None:
    """Refuse a part that belongs to another mesh or graph."""
    if filed.part.sizes.get(name) != wanted:
        raise refusal(filed, f"{name} is {filed.part.sizes.get(name)}, expected {wanted}")
