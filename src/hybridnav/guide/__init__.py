"""Guides people: tours, alternatives through other doors, and words for a path."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
