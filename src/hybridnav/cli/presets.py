"""`hybridnav preset`: list, print and check presets."""

from __future__ import annotations

from typing import Annotated

import typer

import hybridnav as hn
from hybridnav.cli.common import answer
from hybridnav.cli.reading import read_preset

preset = typer.Typer(
    name="preset",
    help="List, print and check presets.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)

PresetArgument = Annotated[
    str, typer.Argument(metavar="NAME|FILE", help="A preset's name or its YAML file.")
]


@preset.command("list")
def list_presets() -> None:
    """List the presets that come with the package."""
    names = hn.preset_names()
    width = max(map(len, names), default=0)
    answer("".join(f"{name:<{width}}  {hn.load_preset(name).description}\n" for name in names))


@preset.command("show")
def show_preset(source: PresetArgument) -> None:
    """Print a preset in full, every key present."""
    answer(read_preset(source).to_yaml())


@preset.command("check")
def check_preset(source: PresetArgument) -> None:
    """Check a preset; an error names the key."""
    answer(f"{read_preset(source).name}: valid\n")
