"""The command line: thin commands over the library, results on stdout, all else on stderr."""

from __future__ import annotations

import sys
import warnings
from typing import Annotated, Any

import typer

import hybridnav as hn
from hybridnav.cli.build import build
from hybridnav.cli.common import answer, complain
from hybridnav.cli.compiling import told_of_compiling
from hybridnav.cli.errors import EXIT_SOLVED, EXIT_UNREADABLE, EXIT_USAGE, exit_code
from hybridnav.cli.evaluate import compare, evaluate
from hybridnav.cli.plan import plan
from hybridnav.cli.presets import preset_app
from hybridnav.cli.rooms import rooms
from hybridnav.cli.show import show
from hybridnav.errors import HybridNavError

_WrongUsage: Any = typer.BadParameter.__base__
"""click's UsageError: Typer brings a click of its own or not, and names only this subclass."""

app = typer.Typer(
    name="hybridnav",
    help="Robot routes planned on an occupancy grid and the topological map grown out of it.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # rich takes [m] for markup
)


def _print_version(asked: bool) -> None:  # noqa: FBT001 - called by Typer
    if asked:
        answer(f"hybridnav {hn.__version__}\n")
        raise typer.Exit


VersionOption = Annotated[
    bool,
    typer.Option(
        "--version", callback=_print_version, is_eager=True, help="Print the version and exit."
    ),
]


@app.callback()
def _options(version: VersionOption = False) -> None:
    """Take what comes before a command."""


app.command()(plan)
app.command()(build)
app.command()(show)
app.command()(rooms)
app.command()(evaluate)
app.command()(compare)
app.add_typer(preset_app, name="preset")


def run(arguments: list[str]) -> int:
    """Run one command line and give its exit code; everything but results is a line on stderr.

    Parameters
    ----------
    arguments
        What follows the program's name.

    Returns
    -------
    int
        0 solved, 1 not solved, 2 wrong usage, 3 unreadable input.
    """
    command = typer.main.get_command(app)
    with warnings.catch_warnings(), told_of_compiling():
        warnings.showwarning = _show_warning
        try:
            code = command.main(arguments, prog_name="hybridnav", standalone_mode=False)
        except _WrongUsage as error:
            _explain(error)
            return EXIT_USAGE
        except HybridNavError as error:
            complain(str(error))
            return exit_code(error)
        except MemoryError:
            complain("out of memory: the map is too large for this machine")
            return EXIT_UNREADABLE
    return code if isinstance(code, int) else EXIT_SOLVED


def _explain(error: Any) -> None:
    message = error.format_message()
    if "\n" in message:  # a command without arguments: its whole help
        sys.stderr.write(f"{message}\n")
        return
    path = error.ctx.command_path if error.ctx is not None else "hybridnav"
    complain(f"{message[:1].lower()}{message[1:].rstrip('.')}; see {path} --help")


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    complain(f"warning: {message}")
