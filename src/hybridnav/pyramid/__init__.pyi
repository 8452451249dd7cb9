from .dual import DualGraph as DualGraph, FaceKind as FaceKind
from .arc import LevelArc as LevelArc
from .level import Level as Level
from .pyramid import DualGraphPyramid as DualGraphPyramid
from .record import Linkage as Linkage
from .resistance import Resistance as Resistance

__all__: list[str]
