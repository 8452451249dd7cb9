"""Models that are kept in a folder, and found again by the checksum of their sources."""

from __future__ import annotations

import hashlib
import json
import os
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hybridnav._files import MODEL_SUFFIX
from hybridnav._version import __version__
from hybridnav.errors import MapError, ModelError
from hybridnav.grid import MAX_CELLS
from hybridnav.io import rooms_in, ros
from hybridnav.io.models.container import FORMAT, write_parts
from hybridnav.io.models.model import open_model
from hybridnav.io.models.parts import plain
from hybridnav.io.models.saving import parts_of
from hybridnav.io.models.structures import KEY

if TYPE_CHECKING:
    from hybridnav.config import Preset
    from hybridnav.io.models.model import Model
    from hybridnav.planner import HybridPlanner

MOST_BYTES = 2_000_000_000
"""Most bytes of the models in a folder: the least recently used ones are removed."""
_ABANDONED_S = 3600.0
"""Age at which a half-written file counts as left by a killed program."""


def cache_folder() -> Path:
    """Return the folder of this user's caches: `hybridnav` in `XDG_CACHE_HOME`, or in `~/.cache`.

    Raises
    ------
    ModelError
        When the user has no home directory.
    """
    given = os.environ.get("XDG_CACHE_HOME", "")
    try:
        base = Path(given) if Path(given).is_absolute() else Path.home() / ".cache"
    except RuntimeError:
        raise ModelError(
            "there is no folder for caches: set XDG_CACHE_HOME, or name one with --keep-in"
        ) from None
    return base / "hybridnav"


def key_of(
    map_file: Path, preset: Preset, reading: dict[str, Any], rooms_file: Path | None = None
) -> str | None:
    """Return the checksum of everything that determines a model.

    These are the bytes of the files of map and rooms, the settings, the version of hybridnav and of
    the format.

    Parameters
    ----------
    map_file
        A ROS map or a MovingAI map.
    preset
        The preset, with the changes of the command line.
    reading
        Options of reading the map, such as thresholds, as plain values.
    rooms_file
        None for none.

    Returns
    -------
    str or None
        None if the image of a map, a map that has none, or the image of rooms does not exist, or is
        not a file.

    Raises
    ------
    MapError
        When a file that names others, the YAML of a map or of rooms, does not exist or does not
        state them.
    """
    is_ros = map_file.suffix.lower() in {".yaml", ".yml"}
    files = ros.files_of(map_file) if is_ros else [map_file]
    files += [] if rooms_file is None else rooms_in.files_of(rooms_file)
    settings = plain(preset.model_dump(mode="json"))
    made_with = [__version__, FORMAT, *map(str, [map_file.absolute(), *files]), settings, reading]
    digest = hashlib.sha256(json.dumps(made_with, sort_keys=True).encode())
    try:
        for path in files:
            if not path.is_file():
                return None
            with path.open("rb") as file:
                digest.update(hashlib.file_digest(file, "sha256").digest())
    except OSError:
        return None
    return digest.hexdigest()


def find(key: str, folder: Path) -> Model | None:
    """Open the model with a key; return None if there is none that is whole.

    All checksums are compared at once, so that the caller can build another model.

    Parameters
    ----------
    key
        Result of `key_of`.
    folder
        Folder of the models.
    """
    path = path_of(key, folder)
    if not path.is_file():
        return None
    try:
        model = open_model(path, max_cells=MAX_CELLS)
        model.parts()
    except MapError:
        return None
    if model.key != key:
        return None
    with suppress(OSError):
        os.utime(path)
    return model


def keep(planner: HybridPlanner, key: str, folder: Path) -> Path:
    """Keep the model of a planner under a key, and remove the least recently used models.

    Raises
    ------
    ModelError
        When the model cannot be written.
    """
    path = path_of(key, folder)
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        write_parts(path, [*parts_of(planner), KEY.part({}, {}, {"key": key})], compress=False)
    except OSError as error:
        raise ModelError(f"model {path}: cannot be kept: {error.strerror}") from None
    with suppress(OSError):
        _make_room(folder, path)
    return path


def path_of(key: str, folder: Path) -> Path:
    """Return the path of the model with a key."""
    return folder / f"{key}{MODEL_SUFFIX}"


def _make_room(folder: Path, newest: Path) -> None:
    """Remove the least recently used models, and the remains of killed programs."""
    for path in folder.glob(".hybridnav.*"):
        if time.time() - path.stat().st_mtime > _ABANDONED_S:
            path.unlink(missing_ok=True)
    size = 0
    models = sorted(folder.glob(f"*{MODEL_SUFFIX}"), key=lambda path: -path.stat().st_mtime)
    for path in models:
        size += path.stat().st_size
        if size > MOST_BYTES and path != newest:
            path.unlink(missing_ok=True)
