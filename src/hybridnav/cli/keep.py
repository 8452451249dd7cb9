"""The options `--keep` and `--keep-in`: models that a command leaves for the next one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from hybridnav._base.files import printable
from hybridnav.cli.common import complain
from hybridnav.cli.reading import is_model_file, load_model
from hybridnav.errors import ModelError

if TYPE_CHECKING:
    import hybridnav as hn
    from hybridnav.cli.reading import MapOptions

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
