"""Write the maps of the project into a folder: `python -m benchmarks.worlds maps`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from benchmarks.worlds import figure1_world, office_world, write_world

if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str]) -> int:
    """Write the maps of the project into the folder that is the only argument."""
    if len(arguments) != 1:
        sys.stderr.write("usage: python -m benchmarks.worlds FOLDER\n")
        return 2
    for world in (office_world(), figure1_world()):
        write_world(world, Path(arguments[0]) / world.name, world.name)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
