"""Options that several subjects have, and what is refused."""

from pathlib import Path
from typing import Any

Option = tuple[tuple[str, ...], dict[str, Any]]


class Refused(Exception):  # noqa: N818 - the command line is at fault, not the code
    """What was asked for cannot be run; the text says why."""


def option(*names: str, **settings: Any) -> Option:
    """Return what `ArgumentParser.add_argument` takes, for the list `OPTIONS` of a subject."""
    return names, settings


DATA = option("--data", type=Path, metavar="FOLDER", help="reference data, else HYBRIDNAV_DATA")
NEEDED_DATA = option(*DATA[0], **DATA[1])
"""The same for a subject that cannot do without."""
SEED = option("--seed", type=int, default=0)
MAPS = option("--map", action="append", default=[], metavar="GLOB")
