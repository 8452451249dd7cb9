from .batch import MeshPaths as MeshPaths, shortest_paths as shortest_paths
from .build import (
    ConvexMesh as ConvexMesh,
    CornerGraph as CornerGraph,
    CornerHierarchy as CornerHierarchy,
    build_mesh as build_mesh,
)
from .cut import renew_mesh as renew_mesh
from .detour import DetourSearch as DetourSearch
from .slits import cells_across as cells_across
from .search import MeshPath as MeshPath, MeshSearch as MeshSearch

__all__: list[str]
