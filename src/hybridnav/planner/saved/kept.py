"""Models that are kept in a folder, and found again by the checksum of their sources."""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from hybridnav._base.files import MODEL_SUFFIX, printable
from hybridnav._version import __version__
from hybridnav.errors import InvalidValueError, MapError, ModelError
from hybridnav.maps import MAX_CELLS, OccupancyGrid
from hybridnav.maps.files import ros
from hybridnav.planner.saved import parts
from hybridnav.planner.saved.container import FORMAT, write_parts
from hybridnav.planner.saved.model import Model, is_model, open_model
from hybridnav.planner.saved.parts import plain
from hybridnav.planner.saved.structures import KEY
from hybridnav.topology import TopologicalMap
from hybridnav.topology.rooms.files import read as rooms_in

if TYPE_CHECKING:
    from hybridnav.planner import HybridPlanner, Preset


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
            digest.update(hashlib.sha256(path.read_bytes()).digest())
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


# Planners, maps and grids, written to files as models.


@runtime_checkable
class OfFloors(Protocol):
    """Several maps that are saved in one file, such as a building."""

    def model_parts(
        self, parts_of: Callable[[HybridPlanner], list[Part]], *, compress: bool
    ) -> list[Part]:
        """Return the parts of the file; `parts_of` returns those of a planner."""
        ...


if TYPE_CHECKING:
    from hybridnav._base.typing import PathLike
    from hybridnav.planner import HybridPlanner
    from hybridnav.planner.saved.container import Part

    Saved = (
        OccupancyGrid | TopologicalMap | HybridPlanner | Model | OfFloors | Iterable[HybridPlanner]
    )


def save(
    thing: Saved,
    path: PathLike,
    *,
    compress: bool = False,
) -> None:
    """Write a model: a map, or the maps of a building, with everything that was prepared on it.

    Parameters
    ----------
    thing
        A planner, with its grid, its topological map, and what it has prepared so far, but the
        lattice, which changes with the costs: call `HybridPlanner.prepare` first to include all.
        Or several planners on one topological map, such as those of several presets. Or only
        such a map, a grid or a `Model`. Or a `Building`, which `load_building` loads.
    path
        The file, which must end in `.hnm`. It is written whole or not at all; processes that have
        loaded the file it replaces keep the old one.
    compress
        Whether arrays are deflated: the file takes about a sixth of the space, and loads more
        slowly, into separate memory.

    Raises
    ------
    InvalidValueError
        When the path has another ending, this is nothing of that, or the planners are not on one
        topological map.
    ModelError
        When the file cannot be written.

    Examples
    --------
    >>> hn.save(hn.example_map("figure1"), "figure1.hnm")
    >>> hn.load("figure1.hnm").grid.shape
    (30, 40)
    """
    if not is_model(path):
        raise InvalidValueError(
            f"the name of a model must end in {MODEL_SUFFIX}, got {printable(path)}"
        )
    try:
        if isinstance(thing, OfFloors):
            # The maps are deflated, and what is known between links is little.
            write_parts(Path(path), thing.model_parts(parts_of, compress=compress), compress=False)
            return
        write_parts(Path(path), parts_of(thing), compress=compress)
    except OSError as error:
        raise ModelError(f"model {printable(path)}: cannot be written: {error.strerror}") from None


def parts_of(
    thing: OccupancyGrid | TopologicalMap | HybridPlanner | Model | Iterable[HybridPlanner],
) -> list[Part]:
    """Return the parts that `save` writes."""
    if isinstance(thing, Model):
        return thing.parts()
    if isinstance(thing, OccupancyGrid):
        return [parts.grid_part(thing)]
    if isinstance(thing, TopologicalMap):
        return _parts_of_map(thing)
    from hybridnav.planner import HybridPlanner  # noqa: PLC0415 - loads numba

    several = list(thing) if isinstance(thing, Iterable) else []
    planners = [thing] if isinstance(thing, HybridPlanner) else several
    if not planners or not all(isinstance(planner, HybridPlanner) for planner in planners):
        raise InvalidValueError(
            "a model is saved of a planner, several planners, a topological map or a grid, "
            f"got {thing!r:.80}"
        )
    topology = planners[0].topology
    if any(planner.topology is not topology for planner in planners):
        raise InvalidValueError(
            "planners are saved together when they are on one topological map, these are on several"
        )
    from hybridnav.planner.saved.searches import made_for, search_parts  # noqa: PLC0415

    found, keys = _parts_of_map(topology), []
    found += [parts.preset_part(planner.preset) for planner in planners]
    for planner in planners:
        settings, prepared = planner.preset.planner, planner.prepared
        key = made_for(settings)
        if prepared is not None and (settings.underlying.method, key) not in keys:
            keys.append((settings.underlying.method, key))
            found += search_parts(prepared, key)
    return found


def _parts_of_map(topology: TopologicalMap) -> list[Part]:
    pyramid = topology.pyramid
    rooms = [] if pyramid.rooms is None else [parts.rooms_part(pyramid.rooms)]
    return [parts.grid_part(topology.grid), *rooms, parts.pyramid_part(pyramid)]
