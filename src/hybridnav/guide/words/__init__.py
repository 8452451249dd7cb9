"""Sentences that describe a path to a person, apart from the geometry that they are made of.

`Instruction` holds what happens and where; a `Language` holds templates.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
