"""Exact any-angle paths: the convex mesh of free space, its intervals, the graph of its corners."""

from hybridnav.mesh.build import ConvexMesh, build_mesh
from hybridnav.mesh.corner_graph import CornerGraph, CornerHierarchy
from hybridnav.mesh.cut import DetourSearch, MeshPaths, renew_mesh, shortest_paths
from hybridnav.mesh.search import MeshPath, MeshSearch
from hybridnav.mesh.trace import SearchTrace, trace_search

__all__ = [
    "ConvexMesh",
    "CornerGraph",
    "CornerHierarchy",
    "DetourSearch",
    "MeshPath",
    "MeshPaths",
    "MeshSearch",
    "SearchTrace",
    "build_mesh",
    "renew_mesh",
    "shortest_paths",
    "trace_search",
]
