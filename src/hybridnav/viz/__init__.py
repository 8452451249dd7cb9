"""Pictures: maps, places, plans. Drawn on matplotlib figures without pyplot or a display."""

from hybridnav.viz.maps import plot_level, plot_map, plot_places
from hybridnav.viz.plan import plot_plan
from hybridnav.viz.save import save_figure

__all__ = ["plot_level", "plot_map", "plot_places", "plot_plan", "save_figure"]
