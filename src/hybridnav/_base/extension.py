"""What other packages add: commands, formats, kinds of methods, by entry points.

The layers of this package look up by name what stands above them. The wing, `hybridnav.ext`, is
registered like a package of others, in `pyproject.toml`:

* `hybridnav.commands`: a function, or a `typer.Typer`, by the name of the command;
* `hybridnav.formats`: a function that reads a map, by its suffix, such as `.hnm`, with the
  parameters of `load_map`; or a module that recognises and reads files of a kind;
* `hybridnav.methods`: a class of routes or of methods of the harness;
* `hybridnav.pictures`: `html`, which draws a value for a notebook.
"""

import sys
from functools import cache
from pathlib import Path
from pkgutil import resolve_name
from typing import Any

from hybridnav.errors import InvalidValueError


def extensions(group: str) -> dict[str, str]:
    """Return what is registered in `hybridnav.GROUP`, as `module:name` by name; it is not loaded.

    `importlib.metadata` takes a tenth of a plan's time for it. It is asked where the files of
    installed packages lie in no folder, as in an archive.
    """
    if (entries := registered().get(f"[hybridnav.{group}]")) is not None:
        return entries
    from importlib.metadata import entry_points  # noqa: PLC0415

    return {one.name: one.value for one in entry_points(group=f"hybridnav.{group}")}


@cache
def registered() -> dict[str, dict[str, str]]:
    """Return what installed packages register in the groups of this one, by their titles."""
    groups: dict[str, dict[str, str]] = {}
    for folder in map(Path, sys.path):
        for file in folder.glob("*-info/entry_points.txt") if folder.is_dir() else ():
            title = ""
            for line in file.read_text("utf-8").splitlines():
                name, equals, of = map(str.strip, line.partition("="))
                title = name if name.startswith("[") else title
                if equals and title.startswith("[hybridnav.") and not name.startswith("#"):
                    value = of.partition("[")[0].replace(" ", "")
                    groups.setdefault(title, {}).setdefault(name, value)
    return groups


@cache
def extension(group: str, name: str) -> Any:
    """Load what is registered under a name in `hybridnav.GROUP`.

    Raises `InvalidValueError` when nothing is: this package was not installed whole.
    """
    target = extensions(group).get(name)
    if target is None:
        raise InvalidValueError(
            f"nothing is registered as {name} in hybridnav.{group}: install hybridnav again"
        )
    return resolve_name(target)


def in_html(value: object) -> str | None:
    """Return what a notebook shows of a value, None where no pictures are registered."""
    target = extensions("pictures").get("html")
    return None if target is None else str(resolve_name(target)(value))
