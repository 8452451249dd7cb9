"""The topological map: places, the boundaries between them, and the local map of each place in a
frame of its own (the source paper's section 2). Public: `Obstacle` and `Component`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn, Protocol, TypeGuard

import numpy as np

from hybridnav._base.copies import copies_alike, frozen
from hybridnav._base.typing import ByteArray, FloatArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, Frame, OccupancyGrid, RoomLabels
from hybridnav.pyramid import DualGraphPyramid, Level
from hybridnav.pyramid.record import Linkage, Patch

if TYPE_CHECKING:
    import networkx as nx

    from hybridnav.rooms.level import Rooms
    from hybridnav.topology.inclusion import Enclosed, Inclusion

Pose = tuple[float, float, float]
"""`(x, y, yaw)` of one frame in another, in metres and radians."""


def local_grid(level: Level, vertex: int) -> OccupancyGrid:
    """Return the map of one field in a frame with its origin at the surviving cell.

    Cells that belong to no field are kept as far as they can decide on the classes of its own.
    """
    grid, side_m = level.grid, level.grid.resolution_m
    reach = math.ceil(grid.robot_radius_m / side_m)
    low_row, low_col, high_row, high_col = level.boxes[vertex].tolist()
    kept = _window(grid.shape, (low_row, low_col, high_row, high_col), 1 + reach)
    # Obstacles so far away decide on the cells near the rim of what is kept.
    window = _window(grid.shape, (low_row, low_col, high_row, high_col), 1 + 2 * reach)
    field_of = level.field_of[window]
    obstacle = grid.measured[window] == CellClass.OCCUPIED
    near = np.zeros(grid.shape, dtype=np.bool_)
    near[kept] = True
    own = (field_of == vertex) | obstacle | (near[window] & (field_of < 0))
    row, col = level.cells[vertex].tolist()
    first_row, first_col = window[0].start, window[1].start
    origin_m = ((first_col - col - 0.5) * side_m, (first_row - row - 0.5) * side_m)
    return replace(
        grid,
        probability=np.where(own, grid.probability[window], np.float32(np.nan)),
        frame=Frame(side_m, origin_m),
        name=f"{grid.name}, place {vertex}",
        least_island_m2=0.0,
    )


def _window(
    shape: tuple[int, int], box: tuple[int, int, int, int], margin: int
) -> tuple[slice, slice]:
    """Return the rows and columns of a box of cells with a margin, cut to the grid."""
    rows, cols = shape
    return (
        slice(max(box[0] - margin, 0), min(box[2] + 1 + margin, rows)),
        slice(max(box[1] - margin, 0), min(box[3] + 1 + margin, cols)),
    )


def local_pose(level: Level, vertex: int) -> Pose:
    """Return the pose of a field's own frame in the map frame."""
    x, y = level.grid.frame.points_of(level.cells[vertex]).tolist()
    return x, y, level.grid.frame.yaw_rad


def transform_of(level: Level, arc: int) -> Pose:
    """Return the pose of the frame of an arc's second field in that of the first."""
    one, other = level.cells[level.arcs[arc]]
    x, y = ((other - one)[::-1] * level.grid.resolution_m).tolist()
    return x, y, 0.0


class Version(Protocol):
    """One version of a pyramid that follows its map, as `hybridnav.ext.live.OnlinePyramid`."""

    @property
    def grid(self) -> OccupancyGrid:
        """The map of this version."""

    @property
    def merge_distance_m(self) -> float:
        """See `DualGraphPyramid`."""

    @property
    def linkage(self) -> Linkage:
        """See `DualGraphPyramid`."""

    @property
    def seed(self) -> int:
        """See `DualGraphPyramid`."""

    @property
    def pyramid(self) -> DualGraphPyramid:
        """The version as a pyramid with all levels; it takes far longer than an update."""

    def patched(self, before: Any, cells: LongArray) -> Patch | None:
        """Return what differs between the records of `pyramid` and that of another version, by
        which some cells changed, int64 (n, 2); None where they cannot be compared."""


def is_version(thing: object) -> TypeGuard[Version]:
    """Return whether something is a version; nothing of it is read, as `isinstance` would do."""
    return hasattr(type(thing), "patched")


@dataclass(frozen=True)
class Obstacle:
    """An 8-connected set of occupied cells, by its index in `pyramid.islands`; 0 is the rim."""

    index: int


@dataclass(frozen=True)
class Component:
    """A 4-connected set of cells that are not occupied, by its index in `pyramid.islands`."""

    index: int


@copies_alike
class TopologicalMap:
    """The place level of a pyramid, seen as places and arcs with lasting ids.

    Arrays are indexed by the dense indices of the level; results, files and arguments name
    `place_ids` and `arc_ids`.

    Parameters
    ----------
    pyramid
        The pyramid that holds the places: at its apex, or below its rooms. Or a version of a
        pyramid that follows its map, such as an `OnlinePyramid`.

    Examples
    --------
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> topology = hn.TopologicalMap(pyramid)
    >>> topology.n_places, topology.n_arcs
    (10, 15)
    >>> topology.place_at((5, 13))
    0
    """

    def __init__(self, pyramid: DualGraphPyramid | Version) -> None:
        self.source = pyramid

    @cached_property
    def pyramid(self) -> DualGraphPyramid:
        """The pyramid that holds the places; that of a version is made when it is read."""
        own = self.source
        return own if isinstance(own, DualGraphPyramid) else own.pyramid

    @cached_property
    def level(self) -> Level:
        """The level of the places."""
        return self.pyramid[self.pyramid.place_level]

    @cached_property
    def place_ids(self) -> LongArray:
        """int64 (n_places,), lasting ids of the places."""
        return frozen(np.arange(self.level.n_vertices, dtype=np.int64))

    @cached_property
    def arc_ids(self) -> LongArray:
        """int64 (n_arcs,), lasting ids of the arcs."""
        return frozen(np.arange(self.level.n_arcs, dtype=np.int64))

    def __repr__(self) -> str:
        return f"TopologicalMap(n_places={self.n_places}, n_arcs={self.n_arcs})"

    @property
    def grid(self) -> OccupancyGrid:
        """The grid of the map."""
        return self.source.grid

    @property
    def has_rooms(self) -> bool:
        """Whether the pyramid was built with rooms."""
        return getattr(self.source, "rooms", None) is not None

    @property
    def room_labels(self) -> RoomLabels | None:
        """The rooms that the pyramid was built with, None without; makes no version dense."""
        return self.pyramid.rooms if self.has_rooms else None

    @cached_property
    def rooms(self) -> Rooms:
        """The rooms above the places.

        Raises
        ------
        InvalidValueError
            When the pyramid was built without rooms.
        """
        from hybridnav.rooms.level import Rooms  # noqa: PLC0415 - most maps have none

        return Rooms(self.pyramid)

    @property
    def n_places(self) -> int:
        """Number of places, free and unexplored."""
        return self.level.n_vertices

    @property
    def n_arcs(self) -> int:
        """Number of arcs, self-loops included."""
        return self.level.n_arcs

    @property
    def arcs(self) -> IntArray:
        """int32 (n_arcs, 2), the places that each arc joins, as dense indices."""
        return self.level.arcs

    @property
    def classes(self) -> ByteArray:
        """uint8 (n_places,), `CellClass` of each place."""
        return self.level.classes

    @cached_property
    def positions(self) -> FloatArray:
        """float64 (n_places, 2), surviving cell of each place as (x, y) in metres, map frame."""
        return self.grid.frame.points_of(self.level.cells)

    @cached_property
    def areas_m2(self) -> FloatArray:
        """float64 (n_places,), area of each place in square metres."""
        return self.level.areas * np.float64(self.grid.cell_area_m2)

    def place_at(self, cell: tuple[int, int]) -> int:
        """Return the dense index of the place that holds a cell of the grid, -1 for an occupied
        cell."""
        return int(self.level.field_of[cell])

    def local_grid(self, place: int) -> OccupancyGrid:
        """Return the metric map of one place, in the frame of that place.

        The origin of that frame is the position of the place, the centre of its surviving cell; its
        axes are those of the grid. The map holds the cells of the place, and the obstacles round it
        as far as they decide on these; cells of other places are NaN. With the same thresholds and
        radius, cells have the same class in it as in the whole map.

        Parameters
        ----------
        place
            Dense index of the place.

        Raises
        ------
        InvalidValueError
            When there is no such place.

        Examples
        --------
        >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
        >>> local = hn.TopologicalMap(pyramid).local_grid(0)
        >>> local.shape, local.class_counts()["free"] + local.class_counts()["unexplored"] > 76
        ((19, 27), True)
        """
        self._check_places([place])
        return local_grid(self.level, place)

    def local_pose(self, place: int) -> Pose:
        """Return the pose of the frame of a place in the map frame, `(x, y, yaw)` in metres and
        radians.

        Parameters
        ----------
        place
            Dense index of the place.

        Raises
        ------
        InvalidValueError
            When there is no such place.
        """
        self._check_places([place])
        return local_pose(self.level, place)

    def transform(self, arc: int) -> Pose:
        """Return the pose of the frame of an arc's second place in the frame of the first.

        `(x, y, yaw)` in metres and radians: a point p of the second frame is R(yaw) p + (x, y) in
        the first one. The axes of all frames are parallel, so that yaw is 0. Along every cycle of
        arcs the transforms compose to the identity; that of a self-loop is the identity.

        Parameters
        ----------
        arc
            Dense index of the arc, which leads from `arcs[arc, 0]` to `arcs[arc, 1]`.

        Raises
        ------
        InvalidValueError
            When there is no such arc.

        Examples
        --------
        >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
        >>> hn.TopologicalMap(pyramid).transform(0)
        (0.8, -0.4, 0.0)
        """
        _check_index("arc", arc, self.n_arcs)
        return transform_of(self.level, arc)

    @cached_property
    def inclusion(self) -> Inclusion:
        """The nesting of places, obstacles and components."""
        from hybridnav.topology.inclusion import Inclusion  # noqa: PLC0415 - loads scipy.sparse

        return Inclusion(self.level, self.pyramid.islands)

    def encloses(self, place: int, *, least_area_m2: float = 0.0) -> Enclosed:
        """Find the contents of a place's self-loops, at any depth: all that it alone encloses.

        Parameters
        ----------
        place
            Dense index of the place.
        least_area_m2
            Obstacles of a smaller area, with all that they surround, are left out and counted.

        Returns
        -------
        Enclosed
            Places (unexplored islands are places too), obstacles, and walled-off components.

        Raises
        ------
        InvalidValueError
            When there is no such place.
        """
        self._check_places([place])
        if not least_area_m2 >= 0:
            raise InvalidValueError(
                f"least area must be a number of square metres >= 0, got {least_area_m2}"
            )
        cells = least_area_m2 / self.grid.cell_area_m2
        return self.inclusion.encloses(place, least_area_cells=cells)

    def enclosed_by(self, thing: int | Sequence[int] | Obstacle | Component) -> tuple[int, ...]:
        """Find the cycle of places that goes round a thing.

        Parameters
        ----------
        thing
            The dense index of a place, those of several connected places (an unexplored island),
            an `Obstacle` or a `Component`.

        Returns
        -------
        tuple of int
            Dense indices of the places, counter-clockwise, the smallest first; one place where a
            single one encloses the thing; none where it reaches the rim. Obstacles that a place
            touches, or that surround its component, count as part of it; a place that the tour
            round the thing meets twice occurs twice.

        Raises
        ------
        InvalidValueError
            When there is no such thing, or several places are not connected.
        """
        if isinstance(thing, Obstacle):
            _check_index("obstacle", thing.index, len(self.pyramid.islands.obstacle_cell))
            ring = self.inclusion.ring_round_obstacle(thing.index)
        elif isinstance(thing, Component):
            _check_index("component", thing.index, len(self.pyramid.islands.component_cell))
            ring = self.inclusion.ring_round_component(thing.index)
        else:
            places = [int(thing)] if isinstance(thing, (int, np.integer)) else list(thing)
            self._check_places(places)
            self._check_connected(places)
            ring = self.inclusion.ring_round_places(np.array(places, dtype=np.int64))
        return tuple(ring.tolist())

    def _check_places(self, places: Sequence[int]) -> None:
        if not places:
            raise InvalidValueError("expected at least one place, got none")
        for place in places:
            _check_index("place", place, self.n_places)

    def _check_connected(self, places: Sequence[int]) -> None:
        inside = np.zeros(self.n_places, dtype=np.bool_)
        inside[list(places)] = True
        import networkx as nx  # noqa: PLC0415 - on demand

        graph: nx.Graph[int] = nx.Graph(self.arcs[inside[self.arcs].all(axis=1)].tolist())
        graph.add_nodes_from(places)
        if not nx.is_connected(graph):
            raise InvalidValueError(f"places must be connected by arcs, got {places!s:.80}")

    def unexplored_islands(self) -> list[tuple[int, ...]]:
        """Return the sets of connected unexplored places that other places enclose, as dense
        indices."""
        import networkx as nx  # noqa: PLC0415 - on demand

        unexplored = self.classes == CellClass.UNEXPLORED
        kept = self.arcs[unexplored[self.arcs].all(axis=1)]
        graph: nx.Graph[int] = nx.Graph(kept.tolist())
        graph.add_nodes_from(np.flatnonzero(unexplored).tolist())
        islands = (tuple(sorted(group)) for group in nx.connected_components(graph))
        return sorted(island for island in islands if self.enclosed_by(island))

    def parallel_arcs(self) -> int:
        """Return the number of arcs beyond the first between the same two places: doors that a
        simple graph loses."""
        from hybridnav.pyramid.graphs import report_of  # noqa: PLC0415 - most maps are never asked

        return report_of(self.arcs, self.n_places).n_parallel_dropped


def _check_index(what: str, index: int, count: int) -> None:
    if not 0 <= index < count:
        raise InvalidValueError(f"{what} must be from 0 to {count - 1}, got {index}")


def no_places() -> NoReturn:
    """Refuse what needs places, on a grid without any or that changed after they were built."""
    raise InvalidValueError(
        "the planner has a grid alone, or the map changed after its places were built, and places, "
        "rooms and doors belong to them: call update with topology, the topological map of the "
        "grid now"
    )
