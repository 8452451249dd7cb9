"""Reasons: why there is no path, what to open, and proofs that anyone can check."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
