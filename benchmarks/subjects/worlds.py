"""Write the maps of the project into a folder, as they are in `maps`."""

from argparse import Namespace
from pathlib import Path

from benchmarks.options import option
from benchmarks.worlds import figure1_world, office_world, write_world

OPTIONS = [option("folder", type=Path)]


def main(given: Namespace) -> None:
    """Write the maps."""
    for world in (office_world(), figure1_world()):
        write_world(world, given.folder / world.name, world.name)
