from .build import (
    ConvexMesh as ConvexMesh,
    CornerGraph as CornerGraph,
    CornerHierarchy as CornerHierarchy,
    build_mesh as build_mesh,
)
from .cut import (
    DetourSearch as DetourSearch,
    MeshPaths as MeshPaths,
    renew_mesh as renew_mesh,
    shortest_paths as shortest_paths,
)
from .hubs import HubLabels as HubLabels
from .search import MeshPath as MeshPath, MeshSearch as MeshSearch
from .trace import SearchTrace as SearchTrace, trace_search as trace_search

__all__: list[str]
