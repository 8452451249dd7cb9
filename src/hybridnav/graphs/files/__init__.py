"""Files of graphs: Nav2, node-link JSON, GraphML, YAML; `ext.fleet.files` has the others."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
