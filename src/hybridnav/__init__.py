"""Robot routes on two maps: an occupancy grid and the topological map grown out of it.

Names load on first use: `import hybridnav` itself imports neither numba nor matplotlib. Errors are
in `hybridnav.errors`; what stands beside the mission is in `hybridnav.ext`.
"""

import logging
from importlib import import_module

import lazy_loader

from hybridnav._version import __version__ as __version__
from hybridnav.errors import renamed

_named, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

logging.getLogger(__name__).addHandler(logging.NullHandler())

_HOMES = ("graphs", "ext.fleet", "ext.live")


def __getattr__(name: str) -> object:
    """Return a name of this package; those of earlier versions come with a warning."""
    try:
        return _named(name)
    except AttributeError:
        if name.startswith("_"):
            raise
    homes = ("errors", *_HOMES) if name[0].isupper() else _HOMES
    for home in homes:
        module = import_module(f"{__name__}.{home}")
        if name in getattr(module, "__all__", dir(module)):
            renamed(f"hybridnav.{name}", f"hybridnav.{home}.{name}")
            return getattr(module, name)
    raise AttributeError(f"module {__name__} has no attribute {name}")
