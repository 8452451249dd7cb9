from .anchors import Anchor as Anchor
from .bags import BagLog as BagLog, load_bag_map as load_bag_map
from .bags import save_bag as save_bag
from .building_files import load_building_graph as load_building_graph
from .blocked import load_blocked as load_blocked
from .building_files import is_building as is_building
from .buildings import load_building as load_building
from .scan_log import CarmenLog as CarmenLog
from .ros import example_map as example_map
from .features_out import (
    export_path as export_path,
    export_places as export_places,
    export_rooms as export_rooms,
)
from .floor_graphs import building_graph as building_graph, floor_graph as floor_graph
from .graph_files import load_graph as load_graph
from .lif_in import export_lif as export_lif
from .maps import load as load, load_map as load_map
from .models import Model as Model, save as save
from .cost_specs import load_keepout_mask as load_keepout_mask, load_speed_mask as load_speed_mask
from .size import (
    Scenario as Scenario,
    load_movingai_map as load_movingai_map,
    read_scenarios as read_scenarios,
)
from .ros_out import write_movingai_map as write_movingai_map
from .nav2 import export_nav2 as export_nav2
from .rooms_in import load_rooms as load_rooms
from .rooms_out import save_rooms as save_rooms
from .osm_out import export_osm as export_osm
from .rmf_out import export_rmf as export_rmf
from .ros import load_ros_map as load_ros_map
from .ros_out import write_ros_map as write_ros_map

__all__: list[str]
