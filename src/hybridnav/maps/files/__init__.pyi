from .formats import load_map as load_map
from .movingai import (
    Scenario as Scenario,
    load_movingai_map as load_movingai_map,
    load_scenarios as load_scenarios,
    write_movingai_map as write_movingai_map,
)
from .ros import (
    example_map as example_map,
    load_ros_map as load_ros_map,
    write_ros_map as write_ros_map,
)
from .sdf import ShapeWorld as ShapeWorld, load_shapes as load_shapes

__all__: list[str]
