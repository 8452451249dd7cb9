"""`hybridnav build`: from a map file to a model; and models that `--keep` leaves behind."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

import hybridnav as hn
from hybridnav._base.extension import extension
from hybridnav._base.files import printable
from hybridnav.cli.common import UsageError, answer, complain, progress_bar, stage, timings
from hybridnav.cli.options import MapOrBuildingArgument, OutOption, PresetOption, RoomsOption
from hybridnav.cli.reading import (
    MapOptions,
    check_model,
    check_room_to_be,
    grow_topology,
    is_model_file,
    load_model,
    overridden,
    with_map,
)
from hybridnav.errors import ModelError

FindRoomsOption = Annotated[
    bool, typer.Option("--find-rooms", help="Find rooms, and keep them in the model.")
]
CompressOption = Annotated[
    bool, typer.Option("--compress", help="Write a small file, which loads more slowly.")
]


@with_map(
    before="compress",
    without=("preset",),
    over_floors=lambda: extension("formats", "building").build_over_floors,
)
def build(
    map_file: MapOrBuildingArgument,
    out: OutOption[Path],
    preset: PresetOption[list[str] | None] = None,
    rooms_file: RoomsOption = None,
    find_rooms: FindRoomsOption = False,
    compress: CompressOption = False,
    *,
    reading: MapOptions,
) -> None:
    """Prepare MAP for planning, and write it to a model (.hnm), which other commands take as MAP.

    --preset says what to prepare; it may be given several times, the first is the model's own.
    Rooms of --rooms are kept in the model. MAP may be a building; `hybridnav plan` takes its model.
    """
    if rooms_file is not None and find_rooms:
        raise UsageError("--find-rooms is for maps without a file of rooms, --rooms names one")
    check_model(out)
    settings = [reading.settings(map_file, preset=name) for name in preset or (None,)]
    seconds: dict[str, float] = {}
    model = load_model(map_file, settings[0], seconds, reading)
    if preset is None:  # all that a model was built for
        settings += [
            overridden(model.fitted(other), reading.overrides, reading.robot_radius_m, reading.seed)
            for other in model.presets[1:]
        ]
    for each in settings:
        check_room_to_be(model.grid, allow_unexplored=each.planner.allow_unexplored)
    topology = grow_topology(
        model, settings[0], seconds, rooms_file=rooms_file, find_rooms=find_rooms
    )
    began = time.perf_counter()
    planners = [model.planner(each, topology=topology) for each in settings]
    for each, planner in zip(settings, planners, strict=True):
        with progress_bar(f"preparing {each.name}") as advance:
            planner.prepare(progress=advance)
        planner.close()
    seconds["prepare"] = round(time.perf_counter() - began, 6)
    with stage(f"writing {out}", seconds, "write"):
        hn.save(planners, out, compress=compress)
    answer(_summary(out, topology, settings, seconds))


def _summary(
    out: Path, topology: hn.TopologicalMap, presets: list[hn.Preset], seconds: dict[str, float]
) -> str:
    grid, size, rooms = topology.grid, out.stat().st_size, topology.pyramid.rooms
    rows, cols = grid.shape
    per_cell = f"{size / (rows * cols):.1f} bytes a cell"
    cells = f"{cols} x {rows} cells of {grid.resolution_m:g} m"
    held = [f"{topology.n_places:,} places"]
    held += [] if rooms is None else [f"{len(rooms.names):,} rooms"]
    held.append(f"what {', '.join(each.name for each in presets)} plans on")
    lines = [
        f"model      {printable(out)}, {size / 1e6:.2f} MB, {per_cell}",
        f"map        {printable(grid.name)}, {cells}, robot radius {grid.robot_radius_m:g} m",
        f"holds      {', '.join(held)}",
        f"seconds    {timings(seconds)}",
    ]
    return "\n".join(lines) + "\n"


# The options `--keep` and `--keep-in`.


KeepOption = Annotated[
    bool,
    typer.Option(
        "--keep",
        help="Keep what is prepared in the user's cache folder, and use it if it is there.",
    ),
]
KeepInOption = Annotated[
    Path | None,
    typer.Option("--keep-in", metavar="DIR", help="Keep it in this folder instead."),
]


@dataclass(frozen=True)
class Source:
    """A map or a model, and the folder of the models prepared on it."""

    map_file: Path
    settings: hn.Preset
    reading: MapOptions
    keeps: bool = False
    folder: Path | None = None
    """None for the user's cache folder."""

    def load(
        self,
        seconds: dict[str, float],
        *,
        rooms_file: Path | None = None,
        needs_rooms: bool = False,
    ) -> tuple[hn.Model, str | None]:
        """Load the kept model, else the map.

        Parameters
        ----------
        seconds
            Takes the time of the stage.
        rooms_file
            Rooms that the query names, None for none or for those that are found.
        needs_rooms
            Whether it names any.

        Returns
        -------
        tuple
            The model, and the key under which to keep it: None where that was not asked for, or
            where it is there already.
        """
        key = self._key(rooms_file, needs_rooms=needs_rooms)
        if key is not None:
            # Loads numba, which help and wrong usage can do without.
            from hybridnav.planner.saved import kept  # noqa: PLC0415

            folder = self._folder()
            model = kept.find(key, folder)
            if model is not None:
                complain(f"using the model kept in {printable(kept.path_of(key, folder))}")
                return model, None
        model = load_model(self.map_file, self.settings, seconds, self.reading)
        # A map that changes meanwhile must not pass for the one before.
        same = key == self._key(rooms_file, needs_rooms=needs_rooms)
        return model, key if same else None

    def keep(self, planner: hn.HybridPlanner, key: str | None) -> None:
        """Keep the prepared structures of a planner, or report the failure in one line."""
        if key is None:
            return
        from hybridnav.planner.saved import kept  # noqa: PLC0415

        try:
            path = kept.keep(planner, key, self._folder())
        except ModelError as error:
            complain(str(error))
            return
        complain(f"kept a model of {path.stat().st_size / 1e6:.1f} MB in {printable(path)}")

    def _folder(self) -> Path:
        from hybridnav.planner.saved import kept  # noqa: PLC0415

        return kept.cache_folder() if self.folder is None else self.folder

    def _key(self, rooms_file: Path | None, *, needs_rooms: bool) -> str | None:
        if not (self.keeps or self.folder is not None) or is_model_file(self.map_file):
            return None
        from hybridnav.planner.saved import kept  # noqa: PLC0415

        names = ("free_threshold", "occupied_threshold", "least_island_m2")
        how = {name: getattr(self.reading, name) for name in names} | {"needs_rooms": needs_rooms}
        return kept.key_of(self.map_file, self.settings, how, rooms_file)
