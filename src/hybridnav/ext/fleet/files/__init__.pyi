from .graphs import building_graph as building_graph, floor_graph as floor_graph
from .indoorgml import (
    IndoorModel as IndoorModel,
    export_indoorgml as export_indoorgml,
    load_indoorgml as load_indoorgml,
)
from .lif import export_lif as export_lif
from .load import load_building_graph as load_building_graph, load_graph as load_graph
from .osm_write import export_osm as export_osm
from .osm_xml import Anchor as Anchor
from .kind import is_building as is_building
from .read import load_building as load_building
from .rmf_write import export_rmf as export_rmf

__all__: list[str]
