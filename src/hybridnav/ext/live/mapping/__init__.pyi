from .mapper import Mapper as Mapper
from .sensors import LaserModel as LaserModel, SonarModel as SonarModel
from .scans import LaserScan as LaserScan, SonarScan as SonarScan, sonar_ring as sonar_ring
from .sensors import SimulatedLaser as SimulatedLaser, SimulatedSonars as SimulatedSonars
from .scans import ScanSequence as ScanSequence

__all__: list[str]
