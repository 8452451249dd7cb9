"""Route graphs: nodes and straight edges in free space, for robots that follow a graph.

Names load on first use.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
