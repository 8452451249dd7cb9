"""Exact octile paths: the jump-point graph of free cells, contracted or not, and its search.

Names load on first use: one preset plans on them.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
