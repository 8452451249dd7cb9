"""What one page shows and changes: a map, its planners, its rooms and their file. Public:
`Session`.
"""

from __future__ import annotations

import threading
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from hybridnav._base.threads import keep_last
from hybridnav._base.trig import dist
from hybridnav.closures import Blocked
from hybridnav.errors import HybridNavError, InvalidValueError
from hybridnav.ext.page.drawing import PagePlanning, level_graph, map_facts, room_facts
from hybridnav.ext.page.requests import changed, checked_change, in_grid, in_metres, rings_of
from hybridnav.ext.page.tiles import costs_layer, hex_colours, level_layer, map_layer, rooms_layer
from hybridnav.maps.names import natural_key
from hybridnav.planning.named import check_names
from hybridnav.rooms.choices import free_point, room_near

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav.closures import Journal
    from hybridnav.ext.page.kept import RoomsFile
    from hybridnav.ext.page.requests import At, Change, Edit, Save, Stand
    from hybridnav.ext.page.tiles import MapLayer
    from hybridnav.maps import RoomLabels
    from hybridnav.maps.costs import CostLayer
    from hybridnav.models import Model
    from hybridnav.planning import Preset
    from hybridnav.rooms import Rooms
    from hybridnav.topology import TopologicalMap

_MOST_LAYERS = 6
"""Layers that are kept, a byte for each cell."""


class ConflictError(HybridNavError):
    """Somebody else has changed what a request would change."""


class Session:
    """A map on a page: its pictures, plans and rooms. Threads may share it.

    Parameters
    ----------
    model
        The map or model.
    topology
        Its topological map, grown with rooms.
    settings
        The preset that the page begins with.
    costs
        Costs beside the presets, None for none.
    file
        The file of its rooms; None for rooms that cannot be saved.
    journal
        Things out of order on one map; None for none, and for a floor, whose building has them.

    Examples
    --------
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> hn.save(hn.TopologicalMap(pyramid), "figure1.hnm")
    >>> model = hn.load("figure1.hnm")
    >>> topology = model.grown(model.fitted(None).pyramid, hn.find_rooms(model.grid))
    >>> from hybridnav.ext.page import Session
    >>> Session(model, topology, model.fitted(None)).describe()["place_level"]
    6
    """

    def __init__(  # noqa: PLR0913 - the last three have defaults
        self,
        model: Model,
        topology: TopologicalMap,
        settings: Preset,
        *,
        costs: CostLayer | None = None,
        file: RoomsFile | None = None,
        journal: Journal | None = None,
    ) -> None:
        self._model, self._settings, self._costs = model, settings, costs
        self.journal = journal
        self.out_of_order = Blocked if journal is None else journal.closures
        """Returns what is closed for all queries, of a floor what its building closes there."""
        self.grid = topology.grid
        self._file = file
        self._lock = threading.RLock()
        self._layers: dict[str, MapLayer] = {}
        self._most: dict[str, float] = {}
        self._changes: list[tuple[dict[str, Any], RoomLabels]] = []
        """Changes that are not saved, each with the rooms before it."""
        self.version = 0
        self.notice = ""
        self.no_file = ""
        """What the page advises if there is no file."""
        self.caution: Callable[[Rooms], str] = lambda _: ""
        """Returns what to mind about rooms that have been saved, an empty text for nothing."""
        self._use(topology)
        self._restore()

    @property
    def rooms(self) -> RoomLabels:
        """The rooms of now."""
        return self.planning.topology.rooms.labels

    def _use(self, topology: TopologicalMap) -> None:
        self._facts: dict[str, Any] | None = None
        self.planning = PagePlanning(self._model, topology, self._settings, self._costs)
        self.planning.journal = self.journal
        for name in [name for name in self._layers if not name.startswith("costs-")]:
            del self._layers[name]

    def _restore(self) -> None:
        """Take the changes up that an earlier page made and did not save."""
        if self._file is None or not (kept := self._file.kept()):
            return
        rooms, lost = _numbered(self.planning.topology.rooms), 0
        for value in kept:
            try:
                after = changed(rooms, checked_change(value), self.grid)
            except (HybridNavError, AttributeError):
                lost += 1
                continue
            self._changes.append((value, rooms))
            rooms = after
        if self._changes:
            self._use(self._model.grown(self._settings.pyramid, rooms))
        self.notice = f"unsaved changes of rooms are back: {len(self._changes)}"
        if lost:
            self.notice += f"; {lost} do not fit the rooms any more and are left out"

    # --- pictures

    def describe(self) -> dict[str, Any]:
        """Return the facts that a page needs of the map before it draws anything."""
        grid, pyramid = self.grid, self.planning.topology.pyramid
        names = {pyramid.place_level: "places", pyramid.room_level: "rooms"}
        return map_facts(grid, self.layer("map").n_zooms) | {
            "ready": True,
            "levels": [
                {"vertices": size.vertices, "arcs": size.arcs, "name": names.get(at, "")}
                for at, size in enumerate(pyramid.stats.sizes)
            ],
            "place_level": pyramid.place_level,
            "presets": self.planning.presets,
            "preset": self._settings.name,
            "colours": {"light": hex_colours("light"), "dark": hex_colours("dark")},
            "can_save": self._file is not None,
            "file": "" if self._file is None else self._file.path.name,
            "no_file": self.no_file if self._file is None else "",
            "rooms": self.describe_rooms(),
        }

    def describe_rooms(self) -> dict[str, Any]:
        """Return the rooms, their doors, and the state of their file."""
        with self._lock:
            if self._facts is None:
                self._facts = room_facts(self.planning.topology.rooms)
            return self._facts | {
                "version": self.version,
                "unsaved": len(self._changes),
                "notice": self.notice,
            }

    def outlines(self) -> dict[str, Any]:
        """Return the corners of all rooms, in the order of their names."""
        with self._lock:
            rings = rings_of(self.rooms, self.grid)
            names = self.rooms.names
            ordered = sorted(range(len(names)), key=lambda at: natural_key(names[at]))
            return {"version": self.version, "rings": [rings[at] for at in ordered]}

    def layer(self, name: str) -> MapLayer:
        """Return a layer: `map`, `rooms`, `level-3`, or `costs-` and a preset.

        Raises
        ------
        InvalidValueError
            When there is none of this name.
        """
        with self._lock:
            if name not in self._layers:
                keep_last(self._layers, name, self._drawn(name), _MOST_LAYERS)
            return self._layers[name]

    def _drawn(self, name: str) -> MapLayer:
        kind, _, which = name.partition("-")
        if name == "map":
            return map_layer(self.grid)
        if name == "rooms":
            return rooms_layer(self.rooms, self.grid)
        if kind == "level":
            return level_layer(self._level(which))
        costs = self.planning.planner(which).costs if kind == "costs" else None
        if costs is None:
            raise InvalidValueError(f"there is no layer {name!r:.80}")
        layer, self._most[which] = costs_layer(self.grid, costs)
        return layer

    def _level(self, text: str) -> Any:
        pyramid = self.planning.topology.pyramid
        if not (text.isascii() and text.isdigit() and len(text) < 4 and int(text) < len(pyramid)):  # noqa: PLR2004
            raise InvalidValueError(f"levels are from 0 to {len(pyramid) - 1}, got {text!r:.80}")
        return pyramid[int(text)]

    def graph(self, text: str) -> dict[str, Any]:
        """Return positions and arcs of a level."""
        return level_graph(self._level(text))

    def costs(self, preset: str) -> dict[str, Any]:
        """Return the greatest factor of the costs of a preset; None for a preset without."""
        if self.planning.planner(preset).costs is None:
            return {"most": None}
        self.layer(f"costs-{preset}")
        return {"most": round(self._most[preset], 3)}

    # --- rooms

    def room_at(self, asked: At) -> dict[str, str | None]:
        """Return the room of a point in grid units, None for no room."""
        return {"room": self.rooms.at(in_metres(asked.point, self.grid), self.grid)}

    def stand(self, asked: Stand) -> dict[str, Any]:
        """Return where a robot may stand in a room, nearest to a point, and how far that is away.

        Raises
        ------
        InvalidValueError
            When no room or point has the name, or the robot does not fit in.
        """
        rooms, name, point = self.planning.topology.rooms, asked.name, asked.point
        if (name is None) == (point is None):
            raise InvalidValueError("a name or a point, one of them: neither or both were given")
        if name is not None:
            check_names(self.planning.topology, [name])
            wanted = rooms.point_of(name)
            room = name if name in rooms.names else rooms.at(wanted)
        else:
            assert point is not None  # noqa: S101 - see above
            wanted = in_metres(point, self.grid)
            room = name = room_near(rooms, wanted)
        at = wanted if room is None else free_point(rooms, room, wanted)
        return {
            "name": name,
            "point": in_grid(at, self.grid),
            "away_m": round(dist(at, wanted), 2),
        }

    def edit(self, edit: Edit) -> dict[str, Any]:
        """Change the rooms, and keep the change in the journal.

        Raises
        ------
        ConflictError
            When the rooms have changed since the version that the page shows.
        InvalidValueError
            When the change is not possible.
        """
        change: Change = checked_change(edit.change)
        with self._lock:
            self._check_version(edit.version)
            before = self.rooms
            after = changed(_numbered(self.planning.topology.rooms), change, self.grid)
            self._use(self._model.grown(self._settings.pyramid, after))
            self._changes.append((edit.change, before))
            return self._kept()

    def undo(self, version: int) -> dict[str, Any]:
        """Take the last change back that is not saved.

        Raises
        ------
        ConflictError
            As by `edit`.
        InvalidValueError
            When there is none.
        """
        with self._lock:
            self._check_version(version)
            if not self._changes:
                raise InvalidValueError(
                    "there is no change to take back since the rooms were saved"
                )
            _, before = self._changes.pop()
            self._use(self._model.grown(self._settings.pyramid, before))
            return self._kept()

    def save(self, asked: Save) -> dict[str, Any]:
        """Write the rooms to their file.

        Raises
        ------
        ConflictError
            When the page shows an older version, or somebody else has changed the file.
        InvalidValueError
            When the rooms have no file.
        RoomsError
            When the file cannot be written; the rooms stay on the page.
        """
        with self._lock:
            self._check_version(asked.version)
            if self._file is None:
                raise InvalidValueError("these rooms have no file: start the page with a map")
            if self._file.is_changed(since_told=asked.replace):
                raise ConflictError(
                    f"{self._file.path.name} was changed by another program since it was read: "
                    "save again to write over it"
                )
            self._file.save(self.rooms, self.grid)
            self._changes.clear()
            caution = self.caution(self.planning.topology.rooms)
            self.notice = f"saved to {self._file.path.name}" + (f"; {caution}" if caution else "")
            return self.describe_rooms()

    def _check_version(self, version: int) -> None:
        if version != self.version:
            raise ConflictError("the rooms were changed on another page: look, and try again")

    def _kept(self) -> dict[str, Any]:
        self.version += 1
        self.notice = ""
        if self._file is not None:
            problem = self._file.keep([change for change, _ in self._changes])
            if problem is not None:
                self.notice = f"not kept for a restart ({problem}): save the rooms elsewhere"
        return self.describe_rooms()


def _numbered(rooms: Rooms) -> RoomLabels:
    """Return rooms that know the numbers of all their doors: those that a change leaves keep
    them."""
    labels = rooms.labels
    doors = {door.number: door.position for door in rooms.doors if not door.is_gap}
    return replace(labels, doors={**labels.doors, **doors})
