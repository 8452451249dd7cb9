"""What is closed for one query, and the cells that it takes away."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from shapely.geometry.base import BaseGeometry

from hybridnav._copies import copies_alike
from hybridnav.errors import InvalidValueError
from hybridnav.planner.areas import checked_area, in_cells, runs_near, shown
from hybridnav.planner.boundaries import cells_on_boundaries

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._typing import AnyArray, LongArray
    from hybridnav.topology import TopologicalMap


@copies_alike
@dataclass(frozen=True, eq=False)
class Blocked:
    """What is closed for one query: arcs, places, cells, and areas in metres.

    Cells, arcs and places are taken as they are. Areas are obstacles: the robot keeps its radius
    (`grid.robot_radius_m`) off them, as it does off occupied cells.

    Parameters
    ----------
    arcs
        Ids of arcs. No move crosses the boundary of a closed arc: of each two cells that face each
        other across it one is closed. Which ones is chosen to keep other arcs open (a second door
        between the same places), then to cost few free cells, closed or cut off from the rest of
        their place; only a cell that two doors share may close both. Moves past a point where four
        places meet lie on no boundary. A self-loop joins a place to itself and cannot be closed.
    places
        Ids of places; all the cells of their receptive fields are closed.
    cells
        `(row, col)`, shape (n, 2).
    polygons
        Each a shapely `Polygon`, `MultiPolygon`, `LineString` or `MultiLineString`, or the corners
        of a polygon as `(x, y)`, shape (n, 2); metres, map frame. Holes stay open, and so does what
        lies outside the map. A cell is closed when the inside of its square lies nearer than the
        robot's radius to the area, or, with a radius of 0, meets it. A line has no inside: with a
        radius of 0 a line along a side between two cells closes the one with the higher index (as
        `Frame.cells_of` does), so that no path passes a line wherever it is drawn.

    Raises
    ------
    InvalidValueError
        When ids are not integers, cells are not integers of shape (n, 2), or an area has fewer than
        three points, is not finite, intersects itself or is of another kind.
    """

    arcs: Sequence[int] = ()
    places: Sequence[int] = ()
    cells: ArrayLike = ()
    polygons: Sequence[BaseGeometry | ArrayLike] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "arcs", _checked_ids("arcs", self.arcs))
        object.__setattr__(self, "places", _checked_ids("places", self.places))
        object.__setattr__(self, "cells", _checked_cells(self.cells))
        if isinstance(self.polygons, BaseGeometry | str) or not hasattr(self.polygons, "__iter__"):
            raise InvalidValueError(
                f"polygons must be a sequence of areas, got {shown(self.polygons)}"
            )
        object.__setattr__(self, "polygons", tuple(map(checked_area, self.polygons)))

    def cells_of(self, topology: TopologicalMap) -> LongArray:
        """Find the cells that may not be entered; occupied ones may be among them.

        Parameters
        ----------
        topology
            The map that the ids belong to.

        Returns
        -------
        LongArray
            int64 (n,), flat cells `row * cols + col`, sorted, each once.

        Raises
        ------
        InvalidValueError
            When the map has no such arc, place or cell, an arc is a self-loop, or an area lies
            absurdly far off the map.
        """
        grid = topology.grid
        places = _found("place", self.places, topology.place_ids)
        arcs = _found("arc", self.arcs, topology.arc_ids)
        cells = _inside(np.asarray(self.cells), grid.shape)
        fields = [topology.level.receptive_field(place) for place in places.tolist()]
        flat = [rowcol[:, 0] * grid.shape[1] + rowcol[:, 1] for rowcol in (cells, *fields)]
        single = np.concatenate([*flat, *cells_on_boundaries(topology, arcs)])
        runs = [np.stack([single, single + 1], axis=1)]
        radius_cells = grid.robot_radius_m / grid.resolution_m
        for area in cast("Sequence[BaseGeometry]", self.polygons):
            parts = in_cells(area, grid.frame)
            runs += [runs_near(part, grid.shape, radius_cells) for part in parts]
        return _cells_in_runs(np.concatenate(runs))


def as_blocked(value: Blocked | BaseGeometry | Mapping[str, Any]) -> Blocked:
    """Read what is closed from any form that a caller may give it in.

    Parameters
    ----------
    value
        A `Blocked`, one shapely geometry, or a mapping from the names of its fields.

    Raises
    ------
    InvalidValueError
        When it is of another kind, has other names, or its content is not valid.
    """
    if isinstance(value, Blocked):
        return value
    if isinstance(value, BaseGeometry):
        return Blocked(polygons=(value,))
    names = tuple(Blocked.__dataclass_fields__)
    if not isinstance(value, Mapping):
        raise InvalidValueError(
            f"blocked must be a Blocked, a shapely geometry or a mapping, got {shown(value)}"
        )
    if unknown := [name for name in value if name not in names]:
        raise InvalidValueError(
            f"blocked takes {', '.join(names)}, got {', '.join(map(str, unknown)):.80}"
        )
    return Blocked(**value)


def _checked_ids(name: str, ids: Sequence[int]) -> tuple[int, ...]:
    try:
        array = np.asarray(list(ids))
    except (TypeError, ValueError):
        array = np.empty((0, 0))
    if array.shape == (0,):
        return ()
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise InvalidValueError(f"{name} must be a sequence of integer ids, got {shown(ids)}")
    return tuple(array.tolist())


def _checked_cells(cells: ArrayLike) -> AnyArray:
    try:
        array = np.array(cells)
    except ValueError:
        array = np.empty(())
    if array.size == 0 and array.ndim:
        array = np.empty((0, 2), dtype=np.int64)
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu":  # noqa: PLR2004
        raise InvalidValueError(
            f"cells must be integers (row, col) of shape (n, 2), got {shown(cells)}"
        )
    array.flags.writeable = False
    return array


def _found(what: str, ids: Sequence[int], known: LongArray) -> LongArray:
    """Dense indices of ids."""
    if not ids:
        return np.empty(0, dtype=np.int64)
    wanted = np.unique(ids)
    missing = wanted[~np.isin(wanted, known)]
    if len(missing):
        ids_are = f"ids are {known.min()} to {known.max()}" if len(known) else "it has none"
        raise InvalidValueError(f"there is no {what} {missing[0]} on this map, {ids_are}")
    return np.flatnonzero(np.isin(known, wanted))


def _inside(cells: AnyArray, shape: tuple[int, int]) -> LongArray:
    outside = ((cells < 0) | (cells >= np.array(shape))).any(axis=1)
    if outside.any():
        row, col = cells[np.argmax(outside)].tolist()
        raise InvalidValueError(
            f"cells must lie on the map of {shape[0]} x {shape[1]} cells, got ({row}, {col})"
        )
    return cells.astype(np.int64)


def _cells_in_runs(runs: LongArray) -> LongArray:
    """Union of runs, expanded; nothing larger than the answer is made."""
    if not len(runs):
        return np.empty(0, dtype=np.int64)
    start, stop = runs[np.argsort(runs[:, 0])].T
    stop = np.maximum.accumulate(stop)
    begins = np.concatenate([[True], start[1:] > stop[:-1]])
    start, stop = start[begins], stop[np.concatenate([begins[1:], [True]])]
    step: LongArray = np.ones(int((stop - start).sum()), dtype=np.int64)
    step[0] = start[0]
    step[np.cumsum(stop - start)[:-1]] = start[1:] - stop[:-1] + 1
    return np.cumsum(step, out=step)
