"""Files in and out: maps, rooms, closed areas, masks, logs, bags, graphs, buildings, models.

Names load on first use: rooms need scipy, models and closed areas numba, a map file neither.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
