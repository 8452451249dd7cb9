"""Exact any-angle paths: the convex mesh of free space, its intervals, the graph of its corners."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
