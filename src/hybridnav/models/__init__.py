"""Files of what was found: models of all that planners prepare on a map, and exported paths."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
