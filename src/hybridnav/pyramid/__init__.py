"""The dual graph pyramid: selection of stars (MIES), contraction, simplification, levels.

Names load on first use: to look at a pyramid takes less than to build one.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
