"""Markers of start and goal with labels, placed where they hide least."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import patheffects
from matplotlib.lines import Line2D
from matplotlib.text import Text

from hybridnav.viz import style
from hybridnav.viz.layout import text_width

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import FloatArray
    from hybridnav.viz.canvas import Canvas
    from hybridnav.viz.style import Sizes

_SHAPES = {"start": ("o", 6.5), "goal": ("D", 6.0)}
_SIDES = np.array([[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]])
_OUTSIDE, _OVERLAP = 1000.0, 100.0  # penalties; covering all of the path costs 10


@dataclass(frozen=True, eq=False)
class Marker:
    """An end of a plan."""

    name: str
    point: FloatArray


def draw_markers(
    canvas: Canvas,
    markers: Sequence[Marker],
    path: FloatArray,
    *,
    avoid: Sequence[FloatArray] = (),
) -> None:
    """Draw start and goal, with labels that avoid boxes.

    A marker outside the view is drawn at its rim, with its coordinates.
    """
    ax, view, sizes = canvas.ax, canvas.view, canvas.sizes
    points = [np.clip(marker.point, view.low, view.high) for marker in markers]
    boxes = [_box_round(point, np.full(2, 4.5 * sizes.line), sizes) for point in points]
    boxes += avoid
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
        label = marker.name
        if (point != marker.point).any():
            label += " ({:g}, {:g})".format(*marker.point)
        centre, box = _place_label(canvas, label, point, boxes, path)
        boxes.append(box)
        text = Text(
            float(centre[0]),
            float(centre[1]),
            label,
            fontsize=sizes.font,
            fontweight="bold",
            color=style.INK,
            horizontalalignment="center",
            verticalalignment="center",
            path_effects=[_halo(0.3 * sizes.font)],
            zorder=9,
        )
        text.set_gid(f"{marker.name}-label")
        ax.add_artist(text)


def _place_label(
    canvas: Canvas,
    label: str,
    point: FloatArray,
    boxes: Sequence[FloatArray],
    path: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the centre and box of a label on the side of its marker where it hides least."""
    view, sizes = canvas.view, canvas.sizes
    half = np.array([text_width(label, sizes.font, "bold") / 2, 0.6 * sizes.font])
    reach = 6.5 * sizes.line
    centres = point + _SIDES * (half + reach) / sizes.points_per_metre
    costs = []
    for centre in centres:
        low, high = _box_round(centre, half, sizes)
        outside = bool((low < view.low).any() or (high > view.high).any())
        hidden = sum(bool(((low < box[1]) & (high > box[0])).all()) for box in boxes)
        covered = np.count_nonzero(((path >= low) & (path <= high)).all(axis=1)) / max(len(path), 1)
        costs.append(_OUTSIDE * outside + _OVERLAP * hidden + 10 * covered)
    centre = centres[np.argmin(costs)]
    return centre, _box_round(centre, half, sizes)


def _box_round(centre: FloatArray, half_points: FloatArray, sizes: Sizes) -> FloatArray:
    """Return the lower left and upper right corner, in metres, of a box with half sizes in
    points."""
    half = half_points / sizes.points_per_metre
    return np.stack([centre - half, centre + half])


def _halo(width: float) -> patheffects.withStroke:
    return patheffects.withStroke(linewidth=width, foreground=style.FREE)
