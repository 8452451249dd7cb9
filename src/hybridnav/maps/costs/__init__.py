"""Costs of cells: layers of factors by which a metre costs more, their sources, line integrals."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
