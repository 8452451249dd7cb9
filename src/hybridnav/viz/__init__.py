"""Pictures of maps, places, graphs and plans, on matplotlib figures without pyplot or display."""

from hybridnav.viz.dual import plot_dual
from hybridnav.viz.kernels import plot_kernels
from hybridnav.viz.levels import plot_levels
from hybridnav.viz.maps import plot_level, plot_map, plot_places
from hybridnav.viz.mesh import plot_mesh
from hybridnav.viz.paper import plot_figure1
from hybridnav.viz.plan import plot_plan
from hybridnav.viz.rooms import plot_rooms
from hybridnav.viz.save import save_figure
from hybridnav.viz.search import plot_search
from hybridnav.viz.topology import plot_topology
from hybridnav.viz.ways import plot_alternatives, plot_tour

__all__ = [
    "plot_alternatives",
    "plot_dual",
    "plot_figure1",
    "plot_kernels",
    "plot_level",
    "plot_levels",
    "plot_map",
    "plot_mesh",
    "plot_places",
    "plot_plan",
    "plot_rooms",
    "plot_search",
    "plot_topology",
    "plot_tour",
    "save_figure",
]
