"""Refinement by OMPL's sampling-based planners, in a process of its own.

I. Sucan, M. Moll, L. Kavraki: The Open Motion Planning Library, 2012. Only the worker process
imports `ompl`; this package works without it up to the first query.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
