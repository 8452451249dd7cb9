"""Labels that hide nothing else, and the markers of start and goal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import patheffects
from matplotlib.lines import Line2D
from matplotlib.text import Text

from hybridnav.viz import style
from hybridnav.viz.layout import text_width

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import ArrayLike

    from hybridnav._base.typing import FloatArray
    from hybridnav.viz.canvas import Canvas

_SHAPES = {"start": ("o", 6.5), "goal": ("D", 6.0)}
_ANCHORS = np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]])
_OUTSIDE, _OVERLAP = 1000.0, 100.0  # penalties; covering all of the path costs 10

_MOST_ALONG = 10_000
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

        Parameters
        ----------
        words
            The words; nothing in them is mathematics.
        box
            The box.
        gid
            Id of the text in the picture.
        halo
            Width of the rim round the letters, in points.
        **font
            Properties of a matplotlib text.
        """
        x, y = box.mean(axis=0).tolist()
        text = Text(
            x,
            y,
            words,
            horizontalalignment="center",
            verticalalignment="center",
            parse_math=False,
            path_effects=[_halo(halo)],
            zorder=9,
            **font,
        )
        text.set_gid(gid)
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
    ax, view, sizes = canvas.ax, canvas.view, canvas.sizes
    labels = LabelPlacer(canvas) if labels is None else labels
    points = [np.clip(marker.point, view.low, view.high) for marker in markers]
    labels.keep_free(points, 4.5 * sizes.line)
    along = _along(lines, 0.3 * sizes.font / sizes.points_per_metre)
    for marker, point in zip(markers, points, strict=True):
        shape, diameter = _SHAPES[marker.name]
        drawn = Line2D(
            *point[:, None],
            linestyle="none",
            marker=shape,
            markersize=diameter * sizes.line,
            markerfacecolor=style.FREE,
            markeredgecolor=style.PATH,
            markeredgewidth=2.0 * sizes.line,
            clip_on=False,
            path_effects=[_halo(4.0 * sizes.line)],
            zorder=8,
        )
        drawn.set_gid(marker.name)
        ax.add_line(drawn)
        words = marker.name
        if (point != marker.point).any():
            words += " ({:g}, {:g})".format(*marker.point)
        half = np.array([text_width(words, sizes.font, "bold") / 2, 0.6 * sizes.font])
        boxes = labels.boxes_beside(point, half, [6.5 * sizes.line])
        box = boxes[int(np.argmin([_cost(labels, box, along) for box in boxes]))]
        font = {"fontsize": sizes.font, "fontweight": "bold", "color": style.INK}
        labels.write(words, box, f"{marker.name}-label", halo=0.3 * sizes.font, **font)


def _along(lines: Sequence[FloatArray], spacing_m: float) -> FloatArray:
    """Return points along lines, a spacing apart, but not more than a line may have: a straight
    path has points at its bends alone, and a label between two of them would hide it."""
    found = [np.empty((0, 2))]
    for line in lines:
        where = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])[: len(line)]
        if len(line):
            count = 2 + int(min(where[-1] / spacing_m, _MOST_ALONG))
            at = np.linspace(0.0, where[-1], count)
            found.append(np.stack([np.interp(at, where, part) for part in line.T], axis=1))
    return np.concatenate(found)


def _cost(labels: LabelPlacer, box: FloatArray, along: FloatArray) -> float:
    """Return how much a label in a box would leave the picture, or hide of labels and of points
    along paths."""
    covered = ((along >= box[0]) & (along <= box[1])).all(axis=1)
    share = np.count_nonzero(covered) / max(len(along), 1)
    outside = not labels.is_in_view(box)
    return _OUTSIDE * outside + _OVERLAP * labels.n_hidden(box) + 10 * share


def _halo(width: float) -> patheffects.withStroke:
    return patheffects.withStroke(linewidth=width, foreground=style.FREE)
