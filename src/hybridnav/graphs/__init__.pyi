from .bundle import export_bundle as export_bundle
from .check import GraphCheck as GraphCheck, check_graph as check_graph
from .gather import (
    BUILDING_KINDS as BUILDING_KINDS,
    Example as Example,
    Finding as Finding,
    KINDS as KINDS,
    SEVERITIES as SEVERITIES,
)
from .judge import (
    Excess as Excess,
    GraphReport as GraphReport,
    judge_route_graph as judge_route_graph,
)
from .lane_graph import build_lane_graph as build_lane_graph
from .lanes import keep_right as keep_right
from .one_way import one_way_rules as one_way_rules
from .plot import plot_graph_check as plot_graph_check, plot_route_graph as plot_route_graph
from .route_messages import (
    first_broken_edge as first_broken_edge,
    graph_changes as graph_changes,
    route_messages as route_messages,
)
from .waypoint_graph import RouteGraph as RouteGraph, WaypointGraph as WaypointGraph
from .files import export_nav2 as export_nav2

__all__: list[str]
