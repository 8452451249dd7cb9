from .mapper import Mapper as Mapper
from .sensors import LaserModel as LaserModel
from .scans import LaserScan as LaserScan
from .sensors import SimulatedLaser as SimulatedLaser
from .scans import ScanSequence as ScanSequence

__all__: list[str]
