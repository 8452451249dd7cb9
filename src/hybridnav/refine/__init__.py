"""From corridors to paths: grid search inside them, and the any-angle finish.

Names load on first use: few plans are shortened, and fewer have motions to check.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
