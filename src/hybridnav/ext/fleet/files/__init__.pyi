from .graphs import building_graph as building_graph, floor_graph as floor_graph
from .graphs import load_building_graph as load_building_graph
from .kind import is_building as is_building
from .read import load_building as load_building

__all__: list[str]
