"""A local page on which people click: the map, its places and rooms, routes and their certificates.

Names load on first use: the server needs the extra `view`, the saved page does not.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
