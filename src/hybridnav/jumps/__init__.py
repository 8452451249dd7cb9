"""Exact octile paths: the jump-point graph of free cells, contracted or not, and its search."""

from hybridnav.jumps.build import JumpGraph, build_jump_graph, contract_graph
from hybridnav.jumps.search import JumpPath, JumpPaths, JumpSearch

__all__ = [
    "JumpGraph",
    "JumpPath",
    "JumpPaths",
    "JumpSearch",
    "build_jump_graph",
    "contract_graph",
]
