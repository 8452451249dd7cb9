"""Routes over the places and the rooms of the topological map, and their corridors.

Names load on first use: a preset plans on one of them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
