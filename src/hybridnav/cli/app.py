"""The command line: thin commands over the library, results on stdout, all else on stderr."""

from __future__ import annotations

import sys
import warnings

import typer

from hybridnav.cli.common import complain
from hybridnav.cli.errors import exit_code
from hybridnav.cli.plan import plan
from hybridnav.cli.presets import preset_app
from hybridnav.cli.show import show
from hybridnav.errors import HybridNavError

app = typer.Typer(
    name="hybridnav",
    help="Robot routes planned on an occupancy grid and the topological map grown out of it.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
app.command()(plan)
app.command()(show)
app.add_typer(preset_app, name="preset")


def main() -> None:
    """Run the command line and exit with its status.

    0: solved; 1: not solved; 2: usage; 3: unreadable input.
    """
    warnings.showwarning = _show_warning
    try:
        app()
    except HybridNavError as error:
        complain(str(error))
        sys.exit(exit_code(error))


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    complain(f"warning: {message}")
