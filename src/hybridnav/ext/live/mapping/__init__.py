"""Occupancy grids from scans of lasers, with poses given.

Names load on first use: scans and models need no numba.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
