"""Maps in: ROS maps, MovingAI benchmarks, examples, rooms; and rooms out."""

from hybridnav.io.examples import example_map
from hybridnav.io.maps import load_map
from hybridnav.io.movingai import Scenario, load_movingai_map, read_scenarios
from hybridnav.io.rooms import load_rooms
from hybridnav.io.rooms_out import save_rooms
from hybridnav.io.ros import load_ros_map

__all__ = [
    "Scenario",
    "example_map",
    "load_map",
    "load_movingai_map",
    "load_rooms",
    "load_ros_map",
    "read_scenarios",
    "save_rooms",
]
