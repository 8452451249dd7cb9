"""Names of a package that load the module of their home on first use."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


def on_first_use(package: str, home_of: Mapping[str, str]) -> Callable[[str], Any]:
    """Return what a package calls `__getattr__`.

    Parameters
    ----------
    package
        Full name of the package.
    home_of
        The module within it of each name.
    """

    def load(name: str) -> Any:
        if name not in home_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        return getattr(import_module(f"{package}.{home_of[name]}"), name)

    return load
