"""Labels that hide nothing else.

Names of places and rooms, numbers at doors, and the markers of start and goal.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from matplotlib import patheffects
from matplotlib.text import Text
from numpy.typing import ArrayLike
from scipy import ndimage

from hybridnav._base.trig import lengths_along
from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.maps import NO_ROOM, OccupancyGrid, RoomLabels
from hybridnav.maps.clearance import clearance_cells
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas
from hybridnav.viz.layout import text_width

_SHAPES = {"start": ("o", 6.5), "goal": ("D", 6.0)}
_ANCHORS = np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]])
_OUTSIDE, _OVERLAP = 1000.0, 100.0  # penalties; covering all of the path costs 10

_MOST_ALONG = 100_000
"""Points along one line beside which labels are laid: a wrong path may be longer than any map."""


class LabelPlacer:
    """Places labels on a canvas so that none hides another.

    Boxes are the lower left and the upper right corner, `(x, y)` in metres, float64 (2, 2).
    """

    def __init__(self, canvas: Canvas) -> None:
        self.canvas = canvas
        self.taken: list[FloatArray] = []
        """Boxes of all labels, and of what they must not hide."""

    def keep_free(self, points: Iterable[ArrayLike], reach: float) -> None:
        """Place nothing nearer to points than a reach in points of the page."""
        half = np.full(2, reach)
        self.taken += [self.box(np.asarray(point), half) for point in points]

    def box(self, centre: FloatArray, half_points: FloatArray) -> FloatArray:
        """Return the box round a centre with half sizes in points of the page."""
        half = half_points / self.canvas.sizes.points_per_metre
        return np.stack([centre - half, centre + half])

    def is_in_view(self, box: FloatArray) -> bool:
        """Return whether a box lies in the picture."""
        view = self.canvas.view
        return not ((box[0] < view.low).any() or (box[1] > view.high).any())

    def n_hidden(self, box: FloatArray) -> int:
        """Return the number of boxes that a box would hide."""
        if not self.taken:
            return 0
        taken = np.stack(self.taken)
        return int(((taken[:, 0] < box[1]) & (taken[:, 1] > box[0])).all(axis=1).sum())

    def boxes_beside(
        self, point: FloatArray, half_points: FloatArray, reaches: Sequence[float]
    ) -> list[FloatArray]:
        """Return boxes on all sides of a point, at each of some distances in points of the page."""
        shifts = np.concatenate([_ANCHORS * (half_points + reach) for reach in reaches])
        centres = point + shifts / self.canvas.sizes.points_per_metre
        return [self.box(centre, half_points) for centre in centres]

    def write(self, words: str, box: FloatArray, gid: str, *, halo: float, **font: Any) -> None:
        """Write words in a box, which is taken from now on.

        `words`: the words; nothing in them is mathematics; `gid`: id of the text in the picture;
        `halo`: width of the rim round the letters, in points; `font`: properties of a matplotlib
        text.
        """
        x, y = box.mean(axis=0).tolist()
        look: dict[str, Any] = {"ha": "center", "va": "center", "parse_math": False, "gid": gid}
        text = Text(x, y, words, path_effects=[_halo(halo)], zorder=9, **look, **font)
        self.canvas.ax.add_artist(text)
        self.taken.append(box)


@dataclass(frozen=True, eq=False)
class Marker:
    """An end of a plan."""

    name: str
    point: FloatArray


def draw_markers(
    canvas: Canvas,
    markers: Sequence[Marker],
    lines: Sequence[FloatArray],
    *,
    labels: LabelPlacer | None = None,
) -> None:
    """Draw start and goal, with labels that hide as little as possible of other labels and paths.

    A marker outside the view is drawn at its rim, with its coordinates.
    """
    view, sizes = canvas.view, canvas.sizes
    labels = LabelPlacer(canvas) if labels is None else labels
    points = [np.clip(marker.point, view.low, view.high) for marker in markers]
    labels.keep_free(points, 4.5 * sizes.line)
    along = _along(lines, 0.3 * sizes.font / sizes.points_per_metre)
    for marker, point in zip(markers, points, strict=True):
        shape, diameter = _SHAPES[marker.name]
        canvas.add_line(
            point[None],
            linestyle="none",
            marker=shape,
            markersize=diameter * sizes.line,
            markerfacecolor=style.FREE,
            markeredgecolor=style.PATH,
            markeredgewidth=2.0 * sizes.line,
            clip_on=False,
            path_effects=[_halo(4.0 * sizes.line)],
            zorder=8,
            gid=marker.name,
        )
        words = marker.name
        if (point != marker.point).any():
            words += " ({:g}, {:g})".format(*marker.point)
        half = np.array([text_width(words, sizes.font, "bold") / 2, 0.6 * sizes.font])
        boxes = labels.boxes_beside(point, half, [6.5 * sizes.line])
        box = boxes[int(np.argmin([_cost(labels, box, along) for box in boxes]))]
        font = {"fontsize": sizes.font, "fontweight": "bold", "color": style.INK}
        labels.write(words, box, f"{marker.name}-label", halo=0.3 * sizes.font, **font)


def _along(lines: Sequence[FloatArray], spacing_m: float) -> FloatArray:
    """Return points along lines, a spacing apart, but not more than a line may have.

    A straight path has points at its bends alone, and a label between two of them would hide it.
    """
    places = [np.empty((0, 2))]
    for line in lines:
        where = lengths_along(line)[: len(line)]
        if len(line):
            count = 2 + int(min(where[-1] / spacing_m, _MOST_ALONG))
            at = np.linspace(0.0, where[-1], count)
            places.append(np.stack([np.interp(at, where, part) for part in line.T], axis=1))
    return np.concatenate(places)


def _cost(labels: LabelPlacer, box: FloatArray, along: FloatArray) -> float:
    """Return how much a label in a box would leave the picture, or hide of labels and of points
    along paths."""
    covered = ((along >= box[0]) & (along <= box[1])).all(axis=1)
    share = np.count_nonzero(covered) / max(len(along), 1)
    outside = not labels.is_in_view(box)
    return _OUTSIDE * outside + _OVERLAP * labels.n_hidden(box) + 10 * share


def _halo(width: float) -> patheffects.withStroke:
    return patheffects.withStroke(linewidth=width, foreground=style.FREE)


# Names of rooms, and numbers at doors.


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
    """Writer of names and numbers that do not hide each other."""

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

        `always`: whether to write a number even if it hides another one, rather than leave it out.
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

        `first`: names that are written before the others, which follow from the largest room down;
        `lines`: points of lines, float64 (n, 2) each, `(x, y)` in metres. A name hides a line only
        if there is no spot beside it. Result: number of rooms without names: their names would
        reach into another room, over the rim of the picture or over other texts.
        """
        names = self._rooms.names
        areas = np.bincount(self._rooms.label_of.ravel() + 1, minlength=len(names) + 1)[1:]
        order = sorted(range(len(names)), key=lambda n: (names[n] not in first, -areas[n], n))
        boxes = ndimage.find_objects(self._rooms.label_of + 1, len(names))
        along = _along(lines, self._grid.resolution_m)
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
        along = _along([], self._grid.resolution_m)
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
        lead, look = np.stack([point, box.mean(axis=0)]), {"color": style.INK, "linewidth": 0.4}
        self.labels.canvas.add_line(lead, **look, zorder=8, gid=f"lead-{label}")
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
        labels = self._rooms.label_of[tuple(cells.T)]
        return bool(np.isin(labels, (label, NO_ROOM)).all())


def _depths(inside: BoolArray, window: tuple[slice, ...], grid: OccupancyGrid) -> list[FloatArray]:
    """Return the points farthest from a room's rim, in the room and in each part of its bounding
    box.

    The farthest point is first.
    """
    depth = clearance_cells(np.pad(~inside, 1, constant_values=True))[1:-1, 1:-1]
    rows, cols = np.indices((_PARTS, _PARTS)).reshape(2, -1)
    deepest = []
    for row, col in zip(rows.tolist(), cols.tolist(), strict=True):
        low = row * depth.shape[0] // _PARTS, col * depth.shape[1] // _PARTS
        part = depth[
            low[0] : (row + 1) * depth.shape[0] // _PARTS,
            low[1] : (col + 1) * depth.shape[1] // _PARTS,
        ]
        if part.size and part.max() > 0:
            at = np.add(np.unravel_index(int(part.argmax()), part.shape), low)
            deepest.append((-float(part.max()), tuple(at.tolist())))
    corner = tuple(span.start for span in window)
    return [grid.frame.points_of(np.add(at, corner)) for _, at in sorted(deepest)]
