"""What other packages add: commands, formats, kinds of methods, by entry points.

The layers of this package look up by name what stands above them. The wing, `hybridnav.ext`, is
registered like a package of others, in `pyproject.toml`:

* `hybridnav.commands`: a function, or a `typer.Typer`, by the name of the command;
* `hybridnav.formats`: a function that reads a map, by its suffix, such as `.hnm`, with the
  parameters of `load_map`; or a module that recognises and reads files of a kind;
* `hybridnav.methods`: a class of routes or of methods of the harness;
* `hybridnav.pictures`: `html`, which draws a value for a notebook.
"""

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from hybridnav.errors import InvalidValueError


@cache
def extensions(group: str) -> dict[str, EntryPoint]:
    """Return what is registered in `hybridnav.GROUP`, by name; nothing of it is loaded."""
    return {one.name: one for one in entry_points(group=f"hybridnav.{group}")}


@cache
def extension(group: str, name: str) -> Any:
    """Load what is registered under a name in `hybridnav.GROUP`.

    Raises `InvalidValueError` when nothing is: this package was not installed whole.
    """
    found = extensions(group).get(name)
    if found is None:
        raise InvalidValueError(
            f"nothing is registered as {name} in hybridnav.{group}: install hybridnav again"
        )
    return found.load()


def in_html(value: object) -> str | None:
    """Return what a notebook shows of a value, None where no pictures are registered."""
    found = extensions("pictures").get("html")
    return None if found is None else str(found.load()(value))
