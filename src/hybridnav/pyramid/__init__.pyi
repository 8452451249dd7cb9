from .arc import LevelArc as LevelArc
from .certainty import Certainty as Certainty
from .combinatorial_map import CombinatorialMap as CombinatorialMap
from .dual import DualGraph as DualGraph, FaceKind as FaceKind
from .level import Level as Level
from .pyramid import DualGraphPyramid as DualGraphPyramid
from .record import Linkage as Linkage

__all__: list[str]
