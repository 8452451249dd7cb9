"""Lines of little cost at any angle: a lattice of nodes in blocks of cells, and its search.

Names load on first use: plans by costs alone need them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
