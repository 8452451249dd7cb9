"""Labels of rooms: their names, and numbers at doors, where they hide nothing else."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Protocol

import numpy as np
from matplotlib.lines import Line2D
from scipy import ndimage

from hybridnav.maps import NO_ROOM
from hybridnav.viz import style
from hybridnav.viz.labels import LabelPlacer
from hybridnav.viz.layout import text_width

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from hybridnav._base.typing import BoolArray, FloatArray
    from hybridnav.maps import OccupancyGrid, RoomLabels
    from hybridnav.viz.canvas import Canvas

_NAME_SIZES = (0.75, 0.65, 0.55)
"""Font sizes that are tried for a name, as shares of the picture's font size."""
_LEAST_FONT = 4.0
"""Least legible font size, in points."""
_NUMBER_SIZE = 0.5
_LEADS = (4.0, 9.0, 16.0, 26.0)
"""Lengths of the line to a number beside its room that are tried, in points."""
_HALO = 1.5
_PARTS = 4
"""Parts per side of a room's bounding box, each with a spot for the name."""
_SAMPLES = 9
"""Points per side of a name's box that are looked up in the map."""


class NumberedDoor(Protocol):
    """A door with a number, of a map or of one that changes."""

    @property
    def number(self) -> int:
        """Its number."""
        ...

    @property
    def position(self) -> tuple[float, float]:
        """In metres of the map frame."""
        ...


class RoomWriter:
    """Writer of names and numbers, of which none hides another.

    Parameters
    ----------
    canvas
        The canvas to write on.
    grid
        The map.
    labels
        Its rooms.
    """

    def __init__(self, canvas: Canvas, grid: OccupancyGrid, labels: RoomLabels) -> None:
        self._sizes = canvas.sizes
        self._grid = grid
        self._rooms = labels
        self.labels = LabelPlacer(canvas)
        """The names and numbers."""
        self.unnamed: list[int] = []
        """Rooms whose names did not fit, the largest first."""

    def number_doors(self, doors: Sequence[NumberedDoor], *, always: bool = False) -> None:
        """Write the numbers of doors beside their dots.

        Parameters
        ----------
        doors
            The doors.
        always
            Whether to write a number even if it hides another one, rather than leave it out.
        """
        size = _NUMBER_SIZE * self._sizes.font
        font = {"fontsize": size, "fontweight": "bold", "color": style.PATH}
        for door in doors:
            number = str(door.number)
            half = np.array([text_width(number, size, "bold") / 2, 0.45 * size])
            reaches = 1.6 * self._sizes.line, 5.0
            boxes = self.labels.boxes_beside(np.asarray(door.position), half, reaches)
            hidden = [self.labels.n_hidden(box) for box in boxes]
            best = int(np.argmin(hidden))
            if always or not hidden[best]:
                self.labels.write(number, boxes[best], f"door-{number}", halo=_HALO, **font)

    def write_names(self, first: Collection[str] = (), *, lines: Sequence[FloatArray] = ()) -> int:
        """Write each name well inside its room, smaller if necessary.

        Parameters
        ----------
        first
            Names that are written before the others, which follow from the largest room down.
        lines
            Points of lines, float64 (n, 2) each, `(x, y)` in metres. A name hides a line only if
            there is no spot beside it.

        Returns
        -------
        int
            Number of rooms without names: their names would reach into another room, over the rim
            of the picture or over other texts.
        """
        names = self._rooms.names
        areas = np.bincount(self._rooms.label_of.ravel() + 1, minlength=len(names) + 1)[1:]
        order = sorted(range(len(names)), key=lambda n: (names[n] not in first, -areas[n], n))
        boxes = ndimage.find_objects(self._rooms.label_of + 1, len(names))
        along = _points_along(lines, self._grid.resolution_m)
        self.unnamed = [
            label
            for label in order
            if (window := boxes[label]) is not None
            and not self._wrote(names[label], label, window, along)
        ]
        return len(self.unnamed)

    def number_rooms(self) -> None:
        """Write the number of each room whose name did not fit: in the room, in small type if
        necessary, or else beside it, with a line to the room."""
        boxes = ndimage.find_objects(self._rooms.label_of + 1, len(self._rooms.names))
        along = _points_along([], self._grid.resolution_m)
        for label in self.unnamed:
            number, window = str(label + 1), boxes[label]
            assert window is not None  # noqa: S101 - it was looked at for its name
            if not self._wrote(number, label, window, along, gid="number"):
                self._point_out(number, label, window)

    def _point_out(self, number: str, label: int, window: tuple[slice, ...]) -> None:
        """Write a number where it hides least, with a line to its room."""
        point = _depths(self._rooms.label_of[window] == label, window, self._grid)[0]
        half = np.array([text_width(number, _LEAST_FONT) / 2, 0.55 * _LEAST_FONT])
        spots = self.labels.boxes_beside(point, half, _LEADS)
        hidden = [self.labels.n_hidden(at) + (not self.labels.is_in_view(at)) for at in spots]
        box = spots[int(np.argmin(hidden))]
        line = Line2D(
            *np.stack([point, box.mean(axis=0)], axis=1), color=style.INK, linewidth=0.4, zorder=8
        )
        line.set_gid(f"lead-{label}")
        self.labels.canvas.ax.add_line(line)
        font = {"fontsize": _LEAST_FONT, "color": style.INK}
        self.labels.write(number, box, f"number-{label}", halo=_HALO, **font)

    def _wrote(
        self,
        name: str,
        label: int,
        window: tuple[slice, ...],
        along: FloatArray,
        *,
        gid: str = "room",
    ) -> bool:
        """Write a name or a number in its room; return whether there is a spot for it."""
        points = _depths(self._rooms.label_of[window] == label, window, self._grid)
        spot: tuple[float, FloatArray] | None = None
        for size, point in itertools.product(_NAME_SIZES, points):
            font = max(size * self._sizes.font, _LEAST_FONT)
            half = np.array([text_width(name, font) / 2, 0.55 * font])
            box = self.labels.box(point, half)
            if self.labels.n_hidden(box) or not self._is_in_room(box, label):
                continue
            hides_line = bool(((along >= box[0]) & (along <= box[1])).all(axis=1).any())
            if spot is None or not hides_line:
                spot = font, box
            if not hides_line:
                break
        if spot is None:
            return False
        font, box = spot
        font_of = {"fontsize": font, "color": style.INK}
        self.labels.write(name, box, f"{gid}-{label}", halo=_HALO, **font_of)
        return True

    def _is_in_room(self, box: FloatArray, label: int) -> bool:
        """Return whether a box lies in the picture and covers no other room; walls may be
        covered."""
        if not self.labels.is_in_view(box):
            return False
        xy = np.meshgrid(*np.linspace(box[0], box[1], _SAMPLES).T)
        cells = self._grid.frame.cells_of(np.stack([axis.ravel() for axis in xy], axis=1))
        cells = cells[((cells >= 0) & (cells < self._grid.shape)).all(axis=1)]
        found = self._rooms.label_of[tuple(cells.T)]
        return bool(np.isin(found, (label, NO_ROOM)).all())


def _points_along(lines: Sequence[FloatArray], spacing_m: float) -> FloatArray:
    """Return the points of lines, with more points between distant ones; float64 (n, 2)."""
    parts = [np.empty((0, 2))]
    for line in lines:
        lengths_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        at = np.linspace(0.0, lengths_m[-1], int(lengths_m[-1] / spacing_m) + 2)
        parts.append(np.stack([np.interp(at, lengths_m, axis) for axis in line.T], axis=1))
    return np.concatenate(parts)


def _depths(inside: BoolArray, window: tuple[slice, ...], grid: OccupancyGrid) -> list[FloatArray]:
    """Return the points farthest from a room's rim, in the room and in each part of its bounding
    box.

    The farthest point is first.
    """
    depth = ndimage.distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1]
    rows, cols = np.indices((_PARTS, _PARTS)).reshape(2, -1)
    found = []
    for row, col in zip(rows.tolist(), cols.tolist(), strict=True):
        low = row * depth.shape[0] // _PARTS, col * depth.shape[1] // _PARTS
        part = depth[
            low[0] : (row + 1) * depth.shape[0] // _PARTS,
            low[1] : (col + 1) * depth.shape[1] // _PARTS,
        ]
        if part.size and part.max() > 0:
            at = np.add(np.unravel_index(int(part.argmax()), part.shape), low)
            found.append((-float(part.max()), tuple(at.tolist())))
    corner = tuple(span.start for span in window)
    return [grid.frame.points_of(np.add(at, corner)) for _, at in sorted(found)]
