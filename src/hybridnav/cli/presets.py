"""`hybridnav preset`: list, print and check presets."""

from __future__ import annotations

import sys
from typing import Annotated

import typer

from hybridnav.config import load_preset, preset_names

preset_app = typer.Typer(help="List, print and check presets.", no_args_is_help=True)

PresetArgument = Annotated[
    str, typer.Argument(metavar="NAME|FILE", help="A preset's name or its YAML file.")
]


@preset_app.command("list")
def list_presets() -> None:
    """List the presets that come with the package."""
    for name in preset_names():
        sys.stdout.write(f"{name:<14} {load_preset(name).description}\n")


@preset_app.command("show")
def show_preset(preset: PresetArgument) -> None:
    """Print a preset in full, every key present."""
    sys.stdout.write(load_preset(preset).to_yaml())


@preset_app.command("check")
def check_preset(preset: PresetArgument) -> None:
    """Check a preset; an error names the key."""
    checked = load_preset(preset)
    sys.stdout.write(f"{checked.name}: valid\n")
