"""Robot routes on two maps: an occupancy grid and the topological map grown out of it.

Names load on first use: `import hybridnav` itself imports neither numba nor matplotlib.
"""

import logging

import lazy_loader

from hybridnav._version import __version__ as __version__

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

logging.getLogger(__name__).addHandler(logging.NullHandler())
