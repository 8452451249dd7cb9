from .build import (
    ConvexMesh as ConvexMesh,
    CornerGraph as CornerGraph,
    CornerHierarchy as CornerHierarchy,
    build_mesh as build_mesh,
)
from .cut import DetourSearch as DetourSearch, renew_mesh as renew_mesh
from .search import MeshPath as MeshPath, MeshSearch as MeshSearch
from .trace import (
    MeshPaths as MeshPaths,
    SearchTrace as SearchTrace,
    shortest_paths as shortest_paths,
    trace_search as trace_search,
)

__all__: list[str]
