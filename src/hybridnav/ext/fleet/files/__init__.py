"""Files of buildings, and of graphs: Open-RMF, OpenStreetMap, LIF, IndoorGML; `load_graph`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
