from .building import (
    Building as Building,
    BuildingPlan as BuildingPlan,
    Floor as Floor,
    Link as Link,
    LinkEnd as LinkEnd,
)
from .config import Preset as Preset, load_preset as load_preset, preset_names as preset_names
from .costs import CostLayer as CostLayer
from .errors import (
    CacheWarning as CacheWarning,
    HybridNavError as HybridNavError,
    InvalidValueError as InvalidValueError,
    MapError as MapError,
    MapNotFoundError as MapNotFoundError,
    MapWarning as MapWarning,
    ModelError as ModelError,
    OmplError as OmplError,
    PlanError as PlanError,
    PresetError as PresetError,
    PresetNotFoundError as PresetNotFoundError,
    RoomsError as RoomsError,
    RoomsNotFoundError as RoomsNotFoundError,
    UnsuitableMapError as UnsuitableMapError,
)
from .grid import (
    CellClass as CellClass,
    DroppedIslands as DroppedIslands,
    Frame as Frame,
    OccupancyGrid as OccupancyGrid,
    RoomLabels as RoomLabels,
    drop_islands as drop_islands,
)
from .graphs import (
    GraphCheck as GraphCheck,
    RouteGraph as RouteGraph,
    WaypointGraph as WaypointGraph,
    build_route_graph as build_route_graph,
    check_graph as check_graph,
    judge_route_graph as judge_route_graph,
    keep_right as keep_right,
    merge_bends as merge_bends,
)
from .io import (
    Anchor as Anchor,
    BagLog as BagLog,
    CarmenLog as CarmenLog,
    Model as Model,
    building_graph as building_graph,
    example_map as example_map,
    export_lif as export_lif,
    export_nav2 as export_nav2,
    export_osm as export_osm,
    export_path as export_path,
    export_places as export_places,
    export_rmf as export_rmf,
    export_rooms as export_rooms,
    floor_graph as floor_graph,
    load as load,
    load_bag_map as load_bag_map,
    load_blocked as load_blocked,
    load_building as load_building,
    load_building_graph as load_building_graph,
    load_graph as load_graph,
    load_keepout_mask as load_keepout_mask,
    load_map as load_map,
    load_rooms as load_rooms,
    load_speed_mask as load_speed_mask,
    save as save,
    save_bag as save_bag,
    save_rooms as save_rooms,
    write_movingai_map as write_movingai_map,
    write_ros_map as write_ros_map,
)
from .planner import (
    Alternative as Alternative,
    Alternatives as Alternatives,
    Blocked as Blocked,
    HybridPlanner as HybridPlanner,
    Tour as Tour,
    plan_alternatives as plan_alternatives,
    plan_tour as plan_tour,
)
from .pyramid import DualGraphPyramid as DualGraphPyramid, Level as Level, LevelArc as LevelArc
from .result import (
    Path as Path,
    PlanBatch as PlanBatch,
    PlanResult as PlanResult,
    PlanStatus as PlanStatus,
    Route as Route,
)
from .topology import (
    Door as Door,
    Rooms as Rooms,
    TopologicalMap as TopologicalMap,
    find_rooms as find_rooms,
)

__version__: str
__all__: list[str]
