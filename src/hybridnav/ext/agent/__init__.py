"""Tools for programs that talk: questions about a map over the Model Context Protocol, and HTTP.

Names load on first use: the protocol needs the extra `agent`.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
