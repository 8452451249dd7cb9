"""Constants of the reference with the text below them, also where another module imports them."""  # noqa: INP001 - no package

from __future__ import annotations

import inspect
import sys
from typing import TYPE_CHECKING, Any

from sphinx.pycode import ModuleAnalyzer
from sphinx.util import logging

if TYPE_CHECKING:
    from sphinx.application import Sphinx

_LOGGER = logging.getLogger(__name__)


def own_text(name: str, value: object) -> list[str]:
    """Return the text below the definition of a constant; empty if there is none.

    A name that a package exports is defined in one of the modules that are loaded. autodoc looks
    in the package alone, and shows the text of the value's class where it finds none.
    """
    _, _, attribute = name.rpartition(".")
    for module in [one for key, one in sys.modules.items() if key.split(".")[0] == "hybridnav"]:
        if vars(module).get(attribute) is value and inspect.getsourcefile(module):
            texts = ModuleAnalyzer.for_module(module.__name__).find_attr_docs()
            if ("", attribute) in texts:
                return texts["", attribute]
    return []


def show_own_text(
    _app: Sphinx, what: str, name: str, value: object, _options: object, lines: list[str]
) -> None:
    """Replace what is shown of a constant; a constant without a text is a warning."""
    if what == "data":
        lines[:] = own_text(name, value)
        if not lines:
            _LOGGER.warning("the constant %s has no text below its definition", name)
    elif any("Alias for field number" in line for line in lines):
        _LOGGER.warning("the field %s has no text below its definition", name)


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the handler, before that of numpydoc."""
    app.connect("autodoc-process-docstring", show_own_text, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
