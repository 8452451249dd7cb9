"""Models: a map with everything that planners have prepared on it, in one file. Public: `load`."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from hybridnav._base.files import MODEL_SUFFIX, printable
from hybridnav._base.typing import PathLike
from hybridnav.errors import ModelError
from hybridnav.maps import DEFAULT_MAX_CELLS, OccupancyGrid, RoomLabels
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.files import load_map
from hybridnav.maps.files.limits import check_max_cells
from hybridnav.models import parts, structures
from hybridnav.models.container import FiledPart, Part, read_parts
from hybridnav.planning import HybridPlanner, Preset, PyramidSettings, load_preset
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.topology import TopologicalMap


class Model:
    """A map, and everything that planners have prepared on it; made by `load`.

    The contents of a file are mapped into memory and read on first use, when the checksum of each
    array is compared.

    Parameters
    ----------
    grid
        The map; None if the parts contain it.
    filed
        The parts of a file.
    max_cells
        Most cells of the map.

    Raises
    ------
    ModelError
        When the parts are not those of one map.
    MapError
        When the map has more cells.

    Examples
    --------
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> hn.save(hn.TopologicalMap(pyramid), "figure1.hnm")
    >>> hn.load("figure1.hnm")
    Model(grid, pyramid)
    """

    def __init__(
        self,
        grid: OccupancyGrid | None,
        filed: Sequence[FiledPart] = (),
        max_cells: int = DEFAULT_MAX_CELLS,
    ) -> None:
        self._grid, self._filed = grid, tuple(filed)
        self._sizes: dict[str, int] = {}
        self._read: dict[str, Any] = {}
        self._reading = threading.RLock()
        if filed:
            self._sizes = parts.sizes_of(
                self._of_kind(structures.GRID.kind)[0], max_cells=max_cells
            )

    def __repr__(self) -> str:
        kinds = ", ".join(dict.fromkeys(part.kind for part in self._filed))
        return f"Model({kinds or 'grid'})"

    @property
    def is_filed(self) -> bool:
        """Whether the model was read from a model file, not from a map."""
        return bool(self._filed)

    @property
    def grid(self) -> OccupancyGrid:
        """The map."""
        return self._once("grid", self._read_grid)

    @property
    def presets(self) -> tuple[Preset, ...]:
        """Presets of the planners that the model was saved with; none for a loaded map."""
        return tuple(map(parts.preset_of, self._of_kind(structures.PRESET.kind)))

    @property
    def rooms(self) -> RoomLabels | None:
        """The rooms that its places were grown with, None without rooms."""
        return self._once("rooms", self._read_rooms)

    @property
    def topology(self) -> TopologicalMap:
        """The topological map: the saved one, else one grown by the first preset, or by
        `shortest`."""
        return self._once("topology", self._read_topology)

    def _once(self, name: str, read: Callable[[], Any]) -> Any:
        """Return an object that is read once for all threads: planners must share one grid."""
        if name not in self._read:
            with self._reading:
                if name not in self._read:
                    self._read[name] = read()
        return self._read[name]

    def _read_grid(self) -> OccupancyGrid:
        if self._grid is not None:
            return self._grid
        return parts.grid_of(self._of_kind(structures.GRID.kind)[0], self._sizes)

    def _read_rooms(self) -> RoomLabels | None:
        filed = self._of_kind(structures.ROOMS.kind)
        return parts.rooms_of(filed[0], self._sizes) if filed else None

    def _read_topology(self) -> TopologicalMap:
        filed = self._of_kind(structures.PYRAMID.kind)
        if filed:
            pyramid = parts.pyramid_of(filed[0], self._sizes, self.grid, self.rooms)
            return TopologicalMap(pyramid)
        return self._grown(self.fitted(None).pyramid, self.rooms)

    def planner(
        self,
        preset: PathLike | Preset | None = None,
        *,
        topology: TopologicalMap | None = None,
        costs: CostLayer | None = None,
    ) -> HybridPlanner:
        """Make a planner, with everything that the model holds for its preset.

        The rest is built when it is needed.

        Parameters
        ----------
        preset
            Name of a preset, path to a preset file, or a `Preset`; None for the first of `presets`,
            or `shortest` where there is none.
        topology
            A topological map of `grid`; None for that of the model.
        costs
            As in `HybridPlanner`.

        Returns
        -------
        HybridPlanner
            A planner with exactly the answers of the saved planner.

        Raises
        ------
        ModelError
            When the contents of the file have changed since it was written.
        PresetError
            When the preset does not exist or is not valid.
        InvalidValueError
            When the map does not suit the preset.
        """
        # Compiles kernels, which a grid alone does not need.
        from hybridnav.models.searches import made_for, search_of  # noqa: PLC0415

        preset = self._own_preset if preset is None else load_preset(preset)
        topology = self.topology if topology is None else topology
        prepared = None
        if topology.grid is self.grid:
            key = made_for(preset.planner)
            prepared = search_of(self._filed, preset.planner.underlying.method, key, self._sizes)
        return HybridPlanner(topology, preset=preset, prepared=prepared, costs=costs)

    def grown(self, settings: PyramidSettings, rooms: RoomLabels | None) -> TopologicalMap:
        """Return the topological map of some settings and rooms.

        It is that of the model if these are its own, else a new one.

        Parameters
        ----------
        settings
            Section `pyramid` of a preset.
        rooms
            `rooms`, other ones, or None for none.
        """
        filed = self._of_kind(structures.PYRAMID.kind)
        own = parts.pyramid_settings(filed[0]) if filed else {}
        if rooms is self.rooms and own.items() <= settings.model_dump().items() and filed:
            return self.topology
        return self._grown(settings, rooms)

    def fitted(self, preset: Preset | None) -> Preset:
        """Return a preset whose section `pyramid` states how the model was made, if it was.

        Parameters
        ----------
        preset
            None for the first of `presets`, or `shortest` where there is none.
        """
        preset = self._own_preset if preset is None else preset
        made = {}
        if self._filed:
            values = parts.grid_settings(self._of_kind(structures.GRID.kind)[0])
            made["robot_radius_m"] = values["robot_radius_m"]
        elif self._grid is not None:
            made["robot_radius_m"] = self._grid.robot_radius_m
        for filed in self._of_kind(structures.PYRAMID.kind):
            made |= parts.pyramid_settings(filed)
        pyramid = preset.pyramid.model_copy(update=made)
        return preset.model_copy(update={"pyramid": pyramid})

    def remade(
        self,
        *,
        robot_radius_m: float | None = None,
        free_threshold: float | None = None,
        occupied_threshold: float | None = None,
        least_island_m2: float | None = None,
    ) -> Model:
        """Return the model itself if its grid has these settings, else a new model of the same map.

        A new model has nothing prepared.

        Parameters
        ----------
        robot_radius_m, free_threshold, occupied_threshold, least_island_m2
            As in `OccupancyGrid`; None for that of the model.

        Raises
        ------
        InvalidValueError
            When one is out of range.
        """
        wanted: dict[str, Any] = {
            "robot_radius_m": robot_radius_m,
            "free_threshold": free_threshold,
            "occupied_threshold": occupied_threshold,
            "least_island_m2": least_island_m2,
        }
        given = {name: value for name, value in wanted.items() if value is not None}
        if all(getattr(self.grid, name) == value for name, value in given.items()):
            return self
        if robot_radius_m is not None:
            given["radius_is_default"] = False
        return Model(replace(self.grid, **given))

    def parts(self) -> list[Part]:
        """Return all parts of the model, as written to a file; every checksum is compared."""
        if self._filed:
            return [filed.read() for filed in self._filed]
        return [parts.grid_part(self.grid)]

    @property
    def _own_preset(self) -> Preset:
        return self.presets[0] if self.presets else load_preset("shortest")

    def _of_kind(self, kind: str) -> list[FiledPart]:
        return [filed for filed in self._filed if filed.kind == kind]

    def _grown(self, settings: PyramidSettings, rooms: RoomLabels | None) -> TopologicalMap:
        pyramid = DualGraphPyramid.build(
            self.grid,
            merge_distance_m=settings.merge_distance_m,
            linkage=settings.linkage,
            seed=settings.seed,
            rooms=rooms,
        )
        return TopologicalMap(pyramid)


def load(
    path: PathLike,
    *,
    robot_radius_m: float | None = None,
    free_threshold: float | None = None,
    occupied_threshold: float | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> Model:
    """Load a model, or a map without one.

    Parameters
    ----------
    path
        A model (.hnm), or a map as in `load_map`, which makes a model with nothing prepared.
    robot_radius_m, free_threshold, occupied_threshold, max_cells
        As in `load_map`. If the grid of a model was made with other values, the grid is made again
        and nothing else of the model is used.

    Raises
    ------
    MapNotFoundError
        When the file does not exist.
    ModelError
        When a model file is no model, not whole, altered, or of another version.
    MapError
        When a map cannot be read, or has more than `max_cells`.
    InvalidValueError
        When the radius, a threshold or the limit is out of range.

    Examples
    --------
    >>> hn.save(hn.example_map("figure1"), "figure1.hnm")
    >>> hn.load("figure1.hnm").grid.name
    'figure1'
    """
    if is_model(path):
        return open_model(path, max_cells=max_cells).remade(
            robot_radius_m=robot_radius_m,
            free_threshold=free_threshold,
            occupied_threshold=occupied_threshold,
        )
    grid = load_map(
        path,
        robot_radius_m=robot_radius_m,
        free_threshold=free_threshold,
        occupied_threshold=occupied_threshold,
        max_cells=max_cells,
    )
    return Model(grid)


def load_grid(path: PathLike, **reading: Any) -> OccupancyGrid:
    """Load the map of a model; parameters as in `load`."""
    return load(path, **reading).grid


def is_model(path: PathLike) -> bool:
    """Return whether a path names a model, that is, ends in `.hnm`."""
    return Path(path).suffix.lower() == MODEL_SUFFIX


def open_model(path: PathLike, *, max_cells: int = DEFAULT_MAX_CELLS) -> Model:
    """Open a model; see `load`."""
    check_max_cells(max_cells)
    filed = read_parts(path)
    if filed and filed[0].kind == structures.BUILDING.kind:
        raise ModelError(
            f"model {printable(path)}: it is that of a building, expected one of a map: load it "
            "with load_building"
        )
    return model_of(filed, f"model {printable(path)}", max_cells)


def model_of(filed: Sequence[FiledPart], where: str, max_cells: int) -> Model:
    """Return the model of the parts of a file.

    Raises `ModelError` when they are not those of one map.
    """
    for part in filed:
        if part.kind in structures.GONE:
            raise structures.refusal(part, "no planner uses portals any more")
        if part.kind not in structures.KINDS:
            raise structures.refusal(part, "no such part is known: a newer hybridnav has made it")
    # Meshes and graphs occur once for each kind of planner that they were made for.
    made = [
        (part.kind, part.values.get("made_for"))
        for part in filed
        if part.kind != structures.PRESET.kind
    ]
    for kind, key in [*made, (structures.GRID.kind, None)]:
        if made.count((kind, key)) != 1:
            raise ModelError(
                f"{where}: {made.count((kind, key))} parts {kind}, expected one: "
                "build the model anew"
            )
    return Model(None, filed, max_cells)
