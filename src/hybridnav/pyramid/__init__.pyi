from .graphs import (
    CombinatorialMap as CombinatorialMap,
    DualGraph as DualGraph,
    FaceKind as FaceKind,
)
from .level import Level as Level, LevelArc as LevelArc
from .pyramid import DualGraphPyramid as DualGraphPyramid
from .record import Linkage as Linkage

__all__: list[str]
