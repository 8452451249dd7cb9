from . import (
    errors as errors,
    ext as ext,
    graphs as graphs,
    harness as harness,
    viz as viz,
)
from .guide import (
    Alternative as Alternative,
    Alternatives as Alternatives,
    Tour as Tour,
    plan_alternatives as plan_alternatives,
    plan_tour as plan_tour,
)
from .guide.words import words as words
from .harness.recorded import judge as judge
from .closures import (
    Blocked as Blocked,
    Journal as Journal,
    OneWay as OneWay,
    OutOfOrder as OutOfOrder,
    load_blocked as load_blocked,
)
from .maps import (
    CellClass as CellClass,
    DroppedIslands as DroppedIslands,
    Frame as Frame,
    OccupancyGrid as OccupancyGrid,
    OneWayRule as OneWayRule,
    RoomLabels as RoomLabels,
    RoomUse as RoomUse,
    drop_islands as drop_islands,
    grids_of_shapes as grids_of_shapes,
)
from .maps.costs import (
    CostLayer as CostLayer,
    load_keepout_mask as load_keepout_mask,
    load_speed_mask as load_speed_mask,
)
from .maps.files import (
    example_map as example_map,
    load_map as load_map,
    load_shapes as load_shapes,
    write_movingai_map as write_movingai_map,
    write_ros_map as write_ros_map,
)
from .models import (
    Model as Model,
    export_path as export_path,
    export_places as export_places,
    export_rooms as export_rooms,
    load as load,
    plan as plan,
    save as save,
)
from .planning import (
    HybridPlanner as HybridPlanner,
    Path as Path,
    PlanBatch as PlanBatch,
    PlanResult as PlanResult,
    PlanStatus as PlanStatus,
    Preset as Preset,
    Profile as Profile,
    load_preset as load_preset,
    preset_names as preset_names,
    under as under,
)
from .pyramid import DualGraphPyramid as DualGraphPyramid, Level as Level, LevelArc as LevelArc
from .topology import TopologicalMap as TopologicalMap
from .rooms import Door as Door, Rooms as Rooms, find_rooms as find_rooms
from .rooms.files import load_rooms as load_rooms, save_rooms as save_rooms

from .viz import plot as plot
from .harness import evaluate as evaluate
from .reasons import explain as explain, prove as prove
from .route import Route as Route

__version__: str
__all__: list[str]
