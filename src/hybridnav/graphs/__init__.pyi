from .build import build_route_graph as build_route_graph
from .check import GraphCheck as GraphCheck, check_graph as check_graph
from .findings import (
    BUILDING_KINDS as BUILDING_KINDS,
    KINDS as KINDS,
    SEVERITIES as SEVERITIES,
    Example as Example,
    Finding as Finding,
)
from .space import (
    Excess as Excess,
    GraphReport as GraphReport,
    judge_route_graph as judge_route_graph,
)
from .facts import keep_right as keep_right
from .metadata import merge_bends as merge_bends
from .waypoint_graph import RouteGraph as RouteGraph
from .route_messages import route_messages as route_messages
from .waypoint_graph import WaypointGraph as WaypointGraph

__all__: list[str]
