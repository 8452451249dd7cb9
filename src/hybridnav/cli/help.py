"""The help of the program: it reads docstrings, and loads neither Typer nor the commands."""

from __future__ import annotations

import shutil
from importlib.util import find_spec
from pathlib import Path
from textwrap import fill, shorten

import hybridnav as hn
from hybridnav._base.extension import extension, extensions
from hybridnav.cli.common import answer

OPENING = "Robot routes planned on an occupancy grid and the topological map grown out of it."
VERSION, HELP = "Print the version and exit.", "Show this message and exit."
HOME_OF = {
    "plan": "plan",
    "closed": "closed",
    "verify": "show",
    "show": "show",
    "rooms": "rooms",
    "build": "build",
    "preset": "show",
    "evaluate": "evaluate",
    "compare": "evaluate",
    "judge": "judge",
}
"""The module of each command of this package; others are registered."""
_GROUPS = {
    "Plan": ("plan", "closed", "verify"),
    "Look": ("show", "rooms", "view"),
    "Prepare": ("map", "build", "preset"),
    "Measure": ("judge", "evaluate", "compare", "explore", "replay"),
    "Robots and fleets": ("export", "check", "serve"),
}
"""The groups of the help; those of other packages stand in one of their own."""


def names() -> list[str]:
    """Return the names of all commands."""
    return [*HOME_OF, *sorted(extensions("commands"))]


def help_text() -> str:
    """Return the help, as wide as Typer makes that of a command."""
    width = max(min(shutil.get_terminal_size().columns, 80) - 2, 50)
    opening = fill(OPENING, width, initial_indent="  ", subsequent_indent="  ")
    options = f"  --version  {VERSION}\n  --help     {HELP}"
    lines = ["Usage: hybridnav [OPTIONS] COMMAND [ARGS]...", opening]
    lines += [f"Options:\n{options}", "Commands:"]
    known = names()

    def row(name: str) -> str:
        summary = shorten(_summary_of(name), width - 8 - column, placeholder="...")
        return f"    {name:<{column}}  {summary}"

    column = max(map(len, known))
    grouped = {name for group in _GROUPS.values() for name in group}
    others = [name for name in known if name not in grouped]
    for title, group in (_GROUPS | {"Others": others}).items():
        rows = [row(name) for name in group if name in known]
        if rows:
            lines.append("\n".join([f"  {title}:", *rows]))
    return "\n\n".join(lines) + "\n"


def write_help() -> None:
    """Print the help."""
    answer(help_text())


def _summary_of(name: str) -> str:
    """Return the first sentence of a command's docstring, or of its help if it is a group."""
    registered = extensions("commands").get(name, "")
    module, _, known = (registered or f"hybridnav.cli.{HOME_OF.get(name)}:{name}").partition(":")
    if module.startswith("hybridnav."):
        file = Path(hn.__file__).parent.joinpath(*module.split(".")[1:]).with_suffix(".py")
    else:
        spec = find_spec(module)
        file = Path(spec.origin or "") if spec is not None else Path()
    text = file.read_text("utf-8") if file.is_file() else ""
    _, is_there, after = text.partition(f"\ndef {known}(")
    told = after.partition('"""')[2].partition('"""')[0]
    if not is_there:
        _, is_there, after = text.partition(f"\n{known} = typer.Typer(")
        told = after.partition('help="')[2].partition('"')[0].replace("\\n", "\n")
    if not is_there:
        home = extension("commands", name)
        told = (home.info.help if hasattr(home, "info") else home.__doc__) or ""
    first, stop, _ = " ".join(told.partition("\n\n")[0].split()).partition(". ")
    return first + stop.strip()
