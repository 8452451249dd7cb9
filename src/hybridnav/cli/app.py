"""The command line: thin commands over the library, results on stdout, all else on stderr."""

from __future__ import annotations

import inspect
import sys
import warnings
from collections.abc import Mapping
from dataclasses import is_dataclass
from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

import hybridnav as hn
from hybridnav._base.extension import extension, extensions
from hybridnav.cli.common import (
    EXIT_SOLVED,
    EXIT_UNREADABLE,
    EXIT_USAGE,
    answer,
    complain,
    exit_code,
)
from hybridnav.cli.help import HOME_OF, OPENING, VERSION, help_text, names
from hybridnav.cli.map_options import FloorOptions, check_options
from hybridnav.cli.warm import notice_of_compiling
from hybridnav.errors import HybridNavError

_WrongUsage: Any = typer.BadParameter.__base__
"""click's UsageError: Typer brings a click of its own or not, and names only this subclass."""


class _Commands(TyperGroup):
    """The commands; only the called one is loaded."""

    def list_commands(self, ctx: Any) -> list[str]:
        del ctx
        return names()

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        if cmd_name not in self.commands:
            home = _home(cmd_name)
            if home is not None:
                self.add_command(_command(cmd_name, home), cmd_name)
        return super().get_command(ctx, cmd_name)

    def get_help(self, ctx: Any) -> str:
        """Return the help of the program: Typer would load every command for it."""
        del ctx
        return help_text().rstrip()

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Refuse an unknown command before Typer loads what checks the options of a known one."""
        is_ours = not args or args[0].startswith("-") or args[0] in HOME_OF
        if not is_ours and args[0] not in extensions("commands"):
            for name in self.list_commands(ctx):  # one of them may have been meant
                self.get_command(ctx, name)
            self.resolve_command(ctx, args)
        return super().parse_args(ctx, args)


def _home(name: str) -> Any:
    """Return the function of a command, or its group of commands; None where there is none."""
    if name in HOME_OF:
        return getattr(import_module(f"hybridnav.cli.{HOME_OF[name]}"), name)
    return extension("commands", name) if name in extensions("commands") else None


class _Command(TyperCommand):
    """A command whose help has its options in panels, as `MapOptions.PANELS`."""

    panels: Mapping[str, tuple[str, ...]] = {}

    def format_options(self, ctx: Any, formatter: Any) -> None:
        records: dict[str, list[tuple[str, str]]] = {
            "Arguments": [],
            **{t: [] for t in self.panels},
        }
        panel_of = {name: title for title, names in self.panels.items() for name in names}
        for each in self.get_params(ctx):
            is_argument = each.param_type_name == "argument"
            title = "Arguments" if is_argument else panel_of.get(each.name, "Options")
            if record := each.get_help_record(ctx):
                records.setdefault(title, []).append(record)
        for title, rows in records.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


def _command(name: str, home: Any) -> Any:
    """Build a command, or a group of commands, as Typer does.

    The options of a function of one dataclass are its fields.
    """
    if isinstance(home, typer.Typer):
        return typer.main.get_command(home)
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    parameters = inspect.signature(home, eval_str=True).parameters.values()
    options: Any = next((p.annotation for p in parameters if is_dataclass(p.annotation)), None)
    alone.command(name, cls=_Command, help=inspect.getdoc(home))(options or home)
    command: Any = typer.main.get_command(alone)
    if options is not None:
        command.panels, read = getattr(options, "PANELS", {}), command.callback

        def call(**values: Any) -> Any:
            args = read(**values)
            if isinstance(args, FloorOptions):
                check_options(command.params, args)
            return home(args)

        command.callback = call
    return command


app = typer.Typer(
    cls=_Commands,
    name="hybridnav",
    help=OPENING,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,  # rich takes [m] for markup
)


def _print_version(wanted: bool) -> None:  # noqa: FBT001 - called by Typer
    if wanted:
        answer(f"hybridnav {hn.__version__}\n")
        raise typer.Exit


VersionOption = Annotated[
    bool,
    typer.Option("--version", callback=_print_version, is_eager=True, help=VERSION),
]


@app.callback()
def _options(version: VersionOption = False) -> None:
    """Parse the options before a command."""


def run(arguments: list[str]) -> int:
    """Run one command line and return its exit code; everything but results is a line on stderr.

    `arguments`: what follows the program's name. Result: 0 solved, 1 not solved, 2 wrong usage, 3
    unreadable input.
    """
    command = typer.main.get_command(app)
    with warnings.catch_warnings(), notice_of_compiling():
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


_GONE = {
    "--methods": "give --preset and --baseline, or in Python RunSettings(methods=)",
    "--nodes": "fewer nodes come of a larger --spacing",
    "--style": "leave it out, graphs are lanes",
}
"""Options of former versions, and what to do instead."""


def _explain(error: Any) -> None:
    message = error.format_message()
    if instead := _GONE.get(getattr(error, "option_name", "")):
        message = f"{error.option_name} is gone: {instead}"
    if "\n" in message:  # a command without arguments: its whole help
        sys.stderr.write(f"{message}\n")
        return
    path = error.ctx.command_path if error.ctx is not None else "hybridnav"
    complain(f"{message[:1].lower()}{message[1:].rstrip('.')}; see {path} --help")


def _show_warning(message: Warning | str, *_: object, **__: object) -> None:
    complain(f"warning: {message}")
