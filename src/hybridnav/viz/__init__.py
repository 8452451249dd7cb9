"""Pictures of maps, places, graphs and plans, and charts of methods.

Drawn on matplotlib figures without pyplot or display.
"""

from hybridnav.viz.building import plot_building
from hybridnav.viz.charts import method_styles, plot_losses, plot_speed
from hybridnav.viz.costs import plot_costs
from hybridnav.viz.graph_check import plot_graph_check, plot_route_graph
from hybridnav.viz.kernels import plot_kernels
from hybridnav.viz.levels import plot_levels
from hybridnav.viz.maps import plot_level, plot_map, plot_places
from hybridnav.viz.mesh import plot_mesh, plot_search
from hybridnav.viz.paper import plot_dual, plot_figure1
from hybridnav.viz.plan import plot_paths, plot_plan
from hybridnav.viz.replay import ReplayAnimation
from hybridnav.viz.room_map import plot_rooms
from hybridnav.viz.routes import plot_alternatives, plot_tour
from hybridnav.viz.save import save_figure
from hybridnav.viz.topology import plot_topology

__all__ = [
    "ReplayAnimation",
    "method_styles",
    "plot_alternatives",
    "plot_building",
    "plot_costs",
    "plot_dual",
    "plot_figure1",
    "plot_graph_check",
    "plot_kernels",
    "plot_level",
    "plot_levels",
    "plot_losses",
    "plot_map",
    "plot_mesh",
    "plot_paths",
    "plot_places",
    "plot_plan",
    "plot_rooms",
    "plot_route_graph",
    "plot_search",
    "plot_speed",
    "plot_topology",
    "plot_tour",
    "save_figure",
]
