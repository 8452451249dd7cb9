"""Exact any-angle paths: the convex mesh of free space and the search of its intervals."""

from hybridnav.mesh.build import ConvexMesh, build_mesh
from hybridnav.mesh.cut import cut_mesh
from hybridnav.mesh.many import MeshPaths, shortest_paths
from hybridnav.mesh.search import MeshPath, MeshSearch
from hybridnav.mesh.trace import SearchTrace, trace_search

__all__ = [
    "ConvexMesh",
    "MeshPath",
    "MeshPaths",
    "MeshSearch",
    "SearchTrace",
    "build_mesh",
    "cut_mesh",
    "shortest_paths",
    "trace_search",
]
