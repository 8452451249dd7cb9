"""A simulated robot that explores a floor plan, planned on the pyramid of what it knows.

Names load on first use: they need numba.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
