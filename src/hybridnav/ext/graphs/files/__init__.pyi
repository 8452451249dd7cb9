from .osm_xml import Anchor as Anchor
from .indoorgml import (
    IndoorModel as IndoorModel,
    export_indoorgml as export_indoorgml,
    load_indoorgml as load_indoorgml,
)
from .lif import export_lif as export_lif
from .load import load_graph as load_graph
from .nav2 import export_nav2 as export_nav2
from .osm_write import export_osm as export_osm
from .rmf_write import export_rmf as export_rmf

__all__: list[str]
