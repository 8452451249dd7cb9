"""Files of graphs: Nav2, Open-RMF, OpenStreetMap, LIF, GraphML, YAML."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
