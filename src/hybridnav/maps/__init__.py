"""Occupancy grids: probabilities, frame, clearance, islands, rooms on cells.

Names load on first use: how many cells a grid may have is known without numpy.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
