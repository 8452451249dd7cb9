from .charts import (
    method_styles as method_styles,
    plot_losses as plot_losses,
    plot_speed as plot_speed,
)
from .maps import plot_costs as plot_costs
from .descent import plot_descent as plot_descent, save_descent as save_descent
from .levels import plot_kernels as plot_kernels
from .levels import plot_levels as plot_levels
from .maps import plot_level as plot_level, plot_map as plot_map, plot_places as plot_places
from .moving import (
    plot_proof as plot_proof,
    save_growth as save_growth,
    save_proof as save_proof,
    save_search as save_search,
)
from .paper import plot_dual as plot_dual, plot_figure1 as plot_figure1
from .plan import plot_paths as plot_paths, plot_plan as plot_plan
from .room_map import plot_rooms as plot_rooms, plot_rooms_beside as plot_rooms_beside
from .routes import plot as plot, plot_alternatives as plot_alternatives, plot_tour as plot_tour
from .canvas import save_figure as save_figure
from .search import plot_mesh as plot_mesh, plot_search as plot_search
from .topology import plot_topology as plot_topology

__all__: list[str]
