"""`hybridnav preset`: list, print and check presets."""

from __future__ import annotations

from typing import Annotated

import typer

from hybridnav.cli.common import answer, read_preset
from hybridnav.config import load_preset, preset_names

preset_app = typer.Typer(
    help="List, print and check presets.", no_args_is_help=True, rich_markup_mode=None
)

PresetArgument = Annotated[
    str, typer.Argument(metavar="NAME|FILE", help="A preset's name or its YAML file.")
]


@preset_app.command("list")
def list_presets() -> None:
    """List the presets that come with the package."""
    names = preset_names()
    width = max(map(len, names), default=0)
    answer("".join(f"{name:<{width}}  {load_preset(name).description}\n" for name in names))


@preset_app.command("show")
def show_preset(preset: PresetArgument) -> None:
    """Print a preset in full, every key present."""
    answer(read_preset(preset).to_yaml())


@preset_app.command("check")
def check_preset(preset: PresetArgument) -> None:
    """Check a preset; an error names the key."""
    answer(f"{read_preset(preset).name}: valid\n")
