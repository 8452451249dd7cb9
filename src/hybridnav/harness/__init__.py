"""The harness: consistency, loss and efficiency of topological and metric layers, measured.

S. Thrun: Learning metric-topological maps for indoor mobile robot navigation, 1998.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
