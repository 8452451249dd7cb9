"""Portals: shortest paths of cells over the borders of fields, by stored distances.

Names load on first use: one preset plans on them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
