"""What is closed: cells, areas, doors, rooms, places and arcs; files and the journal of it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
