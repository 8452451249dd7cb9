"""Planners, maps and grids, written to files as models. Public: `save`."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Protocol, runtime_checkable

from hybridnav._base.files import MODEL_SUFFIX, printable
from hybridnav._base.typing import PathLike
from hybridnav.errors import InvalidValueError, ModelError
from hybridnav.maps import OccupancyGrid
from hybridnav.models import parts
from hybridnav.models.container import Part, write_parts
from hybridnav.models.model import Model, is_model
from hybridnav.planning import HybridPlanner
from hybridnav.topology import TopologicalMap


@runtime_checkable
class OfFloors(Protocol):
    """Several maps that are saved in one file, such as a building."""

    def model_parts(
        self, parts_of: Callable[[HybridPlanner], list[Part]], *, compress: bool
    ) -> list[Part]:
        """Return the parts of the file; `parts_of` returns those of a planner."""
        ...


Saved = OccupancyGrid | TopologicalMap | HybridPlanner | Model | OfFloors | Iterable[HybridPlanner]


def save(thing: Saved, path: PathLike, *, compress: bool = False) -> None:
    """Write a model: a map, or the maps of a building, with everything that was prepared on it.

    Parameters
    ----------
    thing
        A planner, with its grid, its topological map, and all prepared structures but the lattice,
        which changes with the costs: call `HybridPlanner.prepare` first to include all. Or several
        planners on one topological map, such as those of several presets. Or only such a map, a
        grid or a `Model`. Or a `Building`, which `load_building` loads.
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
    from hybridnav.models.searches import made_for, search_parts  # noqa: PLC0415

    filed, keys = _parts_of_map(topology), []
    filed += [parts.preset_part(planner.preset) for planner in planners]
    for planner in planners:
        settings, prepared = planner.preset.planner, planner.prepared
        key = made_for(settings)
        if prepared is not None and (settings.underlying.method, key) not in keys:
            keys.append((settings.underlying.method, key))
            filed += search_parts(prepared, key)
    return filed


def _parts_of_map(topology: TopologicalMap) -> list[Part]:
    pyramid = topology.pyramid
    rooms = [] if pyramid.rooms is None else [parts.rooms_part(pyramid.rooms)]
    return [parts.grid_part(topology.grid), *rooms, parts.pyramid_part(pyramid)]
