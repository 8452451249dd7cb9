"""Exact octile paths: the jump-point graph of free cells, contracted or not, and its search.

Names load on first use: one preset plans on them.
"""

from typing import TYPE_CHECKING

from hybridnav._lazy import on_first_use

if TYPE_CHECKING:
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

__getattr__ = on_first_use(
    __name__,
    {
        "JumpGraph": "build",
        "JumpPath": "search",
        "JumpPaths": "search",
        "JumpSearch": "search",
        "build_jump_graph": "build",
        "contract_graph": "build",
    },
)
