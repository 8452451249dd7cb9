from .align import align_floors as align_floors, moved_floor as moved_floor
from .plan import BuildingAlternatives as BuildingAlternatives
from .building import Building as Building
from .floors import Floor as Floor
from .graph_check import (
    check_building_graph as check_building_graph,
    judge_building_graph as judge_building_graph,
)
from .graph_match import (
    BuildingGraphCheck as BuildingGraphCheck,
    BuildingGraphReport as BuildingGraphReport,
    RouteCounts as RouteCounts,
    MatchedGraph as MatchedGraph,
    MatchedLink as MatchedLink,
    match_graph as match_graph,
)
from .link_nodes import (
    BuildingGraph as BuildingGraph,
    DoorLine as DoorLine,
    FloorArea as FloorArea,
    FloorGraph as FloorGraph,
    join_links as join_links,
    to_networkx as to_networkx,
)
from .links import Ride as Ride, Link as Link, LinkEnd as LinkEnd, LinkKind as LinkKind
from .plan import BuildingPlan as BuildingPlan
from .plot import plot_building as plot_building
from .files import (
    Anchor as Anchor,
    IndoorModel as IndoorModel,
    building_graph as building_graph,
    export_indoorgml as export_indoorgml,
    export_lif as export_lif,
    export_osm as export_osm,
    export_rmf as export_rmf,
    floor_graph as floor_graph,
    load_building as load_building,
    load_building_graph as load_building_graph,
    load_graph as load_graph,
    load_indoorgml as load_indoorgml,
)

__all__: list[str]
