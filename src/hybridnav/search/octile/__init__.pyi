from .jumps import (
    JumpGraph as JumpGraph,
    build_jump_graph as build_jump_graph,
    contract_graph as contract_graph,
)
from .jumps import JumpPath as JumpPath, JumpPaths as JumpPaths, JumpSearch as JumpSearch

__all__: list[str]
