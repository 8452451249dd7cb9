from .build import Portals as Portals, build_portals as build_portals
from .distances import Tables as Tables, build_tables as build_tables
from .options import PortalOptions as PortalOptions
from .prepare import BuiltPortals as BuiltPortals, prepare_portals as prepare_portals
from .search import PortalAnswers as PortalAnswers, PortalSearch as PortalSearch

__all__: list[str]
