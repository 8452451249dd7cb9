"""Map files in: ROS maps and MovingAI benchmarks."""

from hybridnav.io.maps import load_map
from hybridnav.io.movingai import Scenario, load_movingai_map, read_scenarios
from hybridnav.io.ros import load_ros_map

__all__ = ["Scenario", "load_map", "load_movingai_map", "load_ros_map", "read_scenarios"]
