"""`MapOptions` and `FloorOptions`: how commands read one map, or a map or building.

Typer reads such a dataclass as it reads a function: the fields are the options of a command. Texts
of types it would look up where a subclass stands, so that types are no texts here. None compares or
prints them: what does would be made for nothing at each start.
"""

from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, get_type_hints

import hybridnav as hn
from hybridnav._base.extension import extension, extensions
from hybridnav._base.files import printable
from hybridnav.cli import options
from hybridnav.cli.common import UsageError, complain, stage
from hybridnav.cli.options import OneMap
from hybridnav.cli.reading import is_model_file, read_settings
from hybridnav.maps import DEFAULT_MAX_CELLS


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class MapOptions:
    """How a command reads its map, and the preset that it takes for it."""

    map_file: options.MapArgument[Path]
    presets: options.PresetOption[list[str] | None] = None
    overrides: options.SetOption = None
    robot_radius_m: options.RadiusOption = None
    seed: OneMap[options.SeedOption[int | None]] = None
    free_threshold: OneMap[options.FreeOption] = None
    occupied_threshold: OneMap[options.OccupiedOption] = None
    least_island_m2: OneMap[options.LeastIslandOption] = 0.0
    max_cells: options.MaxCellsOption = DEFAULT_MAX_CELLS

    PANELS: ClassVar[dict[str, tuple[str, ...]]]
    """Parts of the help after the arguments, and the fields in each; others are `Options`."""

    @property
    def preset(self) -> str | None:
        """The preset that is named, None for none."""
        if len(self.presets or ()) > 1:
            raise UsageError(f"--preset is taken once, got {len(self.presets or ())}: leave one")
        return self.presets[0] if self.presets else None

    def settings(
        self,
        preset: str | None = None,
        *,
        overrides: tuple[str, ...] = (),
        smooth: str | None = None,
    ) -> "hn.Preset":
        """Return the preset with the settings of the command line, which win over it.

        `preset`: the preset where the command line names none; `overrides`: settings that win over
        those of the command line; `smooth`: how to shorten the path; None as in the preset.
        """
        named = self.preset
        return read_settings(
            preset if named is None else named,
            [*overrides, *(self.overrides or ())],
            self.robot_radius_m,
            self.seed,
            smooth=smooth,
            map_file=self.map_file,
        )

    def load(self, settings: "hn.Preset", seconds: dict[str, float]) -> "hn.Model":
        """Load a model or a map, inflated as a preset states, without the islands that the user
        drops."""
        path = self.map_file
        with stage(f"reading {path}", seconds, "load"):
            whole = hn.load(
                path,
                robot_radius_m=settings.pyramid.robot_radius_m,
                free_threshold=self.free_threshold,
                occupied_threshold=self.occupied_threshold,
                max_cells=self.max_cells,
            )
            model = whole.remade(least_island_m2=self.least_island_m2 or None)
            grid = model.grid
        if is_model_file(path) and not model.is_filed:
            complain(f"{printable(path)} was made with other settings: of it the map alone is used")
        if model is whole:
            return model
        allowed = settings.planner.allow_unexplored
        before, after = (
            each.enterable(allow_unexplored=allowed).any() for each in (whole.grid, grid)
        )
        if before and not after:
            raise UsageError(
                f"--least-island {self.least_island_m2:g} leaves no free cell on "
                f"{printable(grid.name)}: give a smaller area"
            )
        return model


MapOptions.PANELS = {"Options": (), "Map": tuple(each.name for each in fields(MapOptions)[1:])}


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FloorOptions(MapOptions):
    """How a command reads its map, which may be a building."""

    map_file: options.MapOrBuildingArgument

    @cached_property
    def is_building(self) -> bool:
        """Whether the map is a building."""
        return is_building_file(self.map_file)


def is_building_file(path: Path) -> bool:
    """Return whether a file describes a building, and what reads buildings is installed."""
    reads = "building" in extensions("formats")
    return reads and bool(extension("formats", "building").is_building(path))


def check_options(parameters: list[Any], args: FloorOptions) -> None:
    """Refuse options of a building for one map, and of one map for a building.

    `parameters`: those of the command, as Typer has read them from the class of `args`.
    """
    this, other = ("a building", "one map") if args.is_building else ("one map", "a building")
    types = get_type_hints(type(args), include_extras=True)
    defaults = {each.name: each.default for each in fields(args)}
    for parameter in parameters:
        name = parameter.name
        is_other = name in types and other in types[name].__metadata__
        if is_other and getattr(args, name) != defaults[name]:
            option = max(parameter.opts, key=len)
            raise UsageError(f"{option} is for {other}, and this is {this}: leave it out")
