"""A pyramid that follows its map: local updates, lasting identities of places, growth."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
