"""Exact octile paths: the jump-point graph of free cells, its hierarchy and the search on them."""

from hybridnav.jumps.build import JumpGraph, JumpHierarchy, build_jump_graph, contract_graph
from hybridnav.jumps.search import JumpPath, JumpPaths, JumpSearch

__all__ = [
    "JumpGraph",
    "JumpHierarchy",
    "JumpPath",
    "JumpPaths",
    "JumpSearch",
    "build_jump_graph",
    "contract_graph",
]
