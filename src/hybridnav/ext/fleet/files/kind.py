"""Whether a file describes a building: a module that a plan on one map loads quickly."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from hybridnav._base.files import MODEL_SUFFIX
from hybridnav.errors import MapError

if TYPE_CHECKING:
    from hybridnav._base.typing import PathLike

_FLOORS = re.compile(r"^[\"']?floors[\"']?\s*:", re.MULTILINE)
_LOOKED_AT = 2**16
"""Bytes of a file that are searched for its floors."""


def is_building(path: PathLike) -> bool:
    """Return whether a file describes a building, by its content.

    Parameters
    ----------
    path
        A YAML file or a model.

    Returns
    -------
    bool
        False if there is no such file, or it cannot be read.

    Examples
    --------
    >>> from hybridnav.ext.fleet.files import is_building
    >>> is_building("maps/office/office.yaml")
    False
    """
    file = Path(path)
    suffix = file.suffix.lower()
    try:
        if not file.is_file():
            return False
    except OSError:  # a name that is too long
        return False
    if suffix == MODEL_SUFFIX:
        return _is_building_model(file)
    if suffix not in {".yaml", ".yml"}:
        return False
    try:
        with file.open("rb") as stream:
            text = stream.read(_LOOKED_AT).decode("utf-8-sig", errors="replace")
    except OSError:
        return False
    return _FLOORS.search(text) is not None


def _is_building_model(path: Path) -> bool:
    """Return whether a file is the model of a building; False for one that cannot be read."""
    from hybridnav.models.container import read_parts  # noqa: PLC0415 - on demand
    from hybridnav.models.structures import BUILDING  # noqa: PLC0415

    with suppress(MapError):
        filed = read_parts(path)
        return bool(filed) and filed[0].kind == BUILDING.kind
    return False
