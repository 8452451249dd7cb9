"""The planner that the presets configure, and the closures for single queries.

Names load on first use: alternatives and what is closed load shapely.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
