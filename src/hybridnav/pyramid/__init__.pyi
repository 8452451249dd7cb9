from .dual import DualGraph as DualGraph, FaceKind as FaceKind
from .level import Level as Level, LevelArc as LevelArc
from .pyramid import DualGraphPyramid as DualGraphPyramid
from .record import Linkage as Linkage
from .resistance import Resistance as Resistance

__all__: list[str]
