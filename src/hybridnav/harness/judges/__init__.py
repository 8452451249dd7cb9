"""The judges of paths, optima and losses.

What is legal and what is shortest they decide by code of their own. With the planners they share
the grid and its frame, the cells that a line passes, which name a path and judge none, and the
exact comparison of two products, which tests hold against fractions.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
