"""The topological map: places and boundaries, rooms and doors.

Names load on first use: few maps have rooms, and to find them takes scipy.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
