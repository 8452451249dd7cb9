"""Items round the map: title, scale bar, legend; and the height of a new figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.font_manager import FontProperties
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.textpath import text_to_path
from matplotlib.transforms import Bbox, ScaledTranslation, blended_transform_factory

from hybridnav.viz import style
from hybridnav.viz.canvas import MAX_HEIGHT, PAD_IN, Canvas

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.legend import Legend


Entry = tuple[Any, str]
"""A handle of a legend and its label."""

BAR_SHARE = 0.2
"""Greatest length of the scale bar, as a share of the view's width."""
LABELS = 3.4
"""Height of the labels in metres below a map, in font sizes."""
_HINTING = 1.06
"""Letters on whole pixels are so much wider than their outlines, at most."""
_NARROWER = (0.9, 0.8, 0.7, 0.6, 0.5)
"""Shares of the room that are tried for a title, to make its lines equally long."""
_HANDLE, _GAP, _BETWEEN = 2.2, 0.6, 1.6  # legend measures, in font sizes


def text_width(text: str, font: float, weight: str = "normal") -> float:
    """Return the width of one line of text in points."""
    properties = FontProperties(size=font, weight=weight)
    width, _, _ = text_to_path.get_text_width_height_descent(text, properties, ismath=False)
    return float(width)


def wrapped(parts: Sequence[str], font: float, room: float) -> str:
    """Return parts joined by dots, in as few and as equal lines as fit the room.

    The room is in points; parts that are too long are cut.
    """
    fitting = [_cut(part, font, room) for part in filter(None, parts)]
    lines = _filled(fitting, font, room)
    for share in _NARROWER:
        narrower = _filled(fitting, font, share * room)
        if len(narrower) > len(lines):
            break
        lines = narrower
    return "\n".join(lines)


def _filled(parts: Sequence[str], font: float, room: float) -> list[str]:
    """Return lines filled one after the other."""
    lines: list[str] = []
    for part in parts:
        longer = f"{lines[-1]}  ·  {part}" if lines else part
        if lines and text_width(longer, font) <= room:
            lines[-1] = longer
        else:
            lines.append(part)
    return lines


def _cut(text: str, font: float, room: float) -> str:
    text = " ".join(text.split())
    width = text_width(text, font)
    if width <= room:
        return text
    kept = int(len(text) * room / width)
    while kept > 1 and text_width(f"{text[:kept]}…", font) > room:
        kept -= 1
    return f"{text[:kept]}…"


def round_length(limit_m: float) -> float:
    """Return the largest of 1, 2, 5, 10, ... (and their tenths, ...) metres up to a limit."""
    power = 10.0 ** math.floor(math.log10(limit_m))
    fitting = (step * power for step in (1, 2, 5) if step * power <= limit_m)
    return max(fitting, default=power)  # log10 may round up past the limit


def add_title(canvas: Canvas, parts: Sequence[str]) -> None:
    """Put a title over the map, no wider than the room."""
    font = canvas.sizes.font
    canvas.ax.set_title(
        wrapped(parts, font, _room_over(canvas)),
        fontsize=font,
        pad=0.6 * font,
        linespacing=1.3,
        color=style.INK,
        parse_math=False,  # a map may have any name
    )


def add_scale_bar(canvas: Canvas) -> float:
    """Draw a scale bar below the left end of the map; return its width with its text in points."""
    ax, sizes = canvas.ax, canvas.sizes
    length = round_length(BAR_SHARE * float(canvas.view.size[0]))
    left = float(canvas.view.low[0])
    place = blended_transform_factory(ax.transData, ax.transAxes) + _shift(ax, 0, -sizes.font)
    bar = Line2D(
        [left, left + length],
        [0, 0],
        transform=place,
        color=style.INK,
        linewidth=2.2 * sizes.line,
        solid_capstyle="butt",
        clip_on=False,
        gid="scale-bar",
    )
    ax.add_line(bar)
    label = Text(
        left + length,
        0,
        f"{length:g} m",
        transform=place + _shift(ax, 0.5 * sizes.font, 0),
        fontsize=sizes.font,
        verticalalignment="center_baseline",
        color=style.INK,
        gid="scale-bar-label",
    )
    ax.add_artist(label)
    label.set_clip_on(False)
    text = text_width(label.get_text(), sizes.font)
    return length * sizes.points_per_metre + 0.5 * sizes.font + text


def add_legend(canvas: Canvas, entries: Sequence[Entry], *, bar: float, below: float) -> Legend:
    """Put a legend below the map, beside the scale bar if that takes at most one more row.

    `canvas`: the axes, with the sizes of lines; `entries`: handles and labels; `bar`: width of the
    scale bar in points, 0 without one; `below`: points below the axes at which items other than the
    scale bar end.
    """
    font = canvas.sizes.font
    widths = [_HINTING * text_width(label, font) for _, label in entries]
    columns = _columns(widths, font, _room_over(canvas))
    beside = _columns(widths, font, canvas.map_width - bar - 2 * font)
    rows, rows_beside = (-(-len(entries) // max(n, 1)) for n in (columns, beside))
    is_beside = bar > 0 and beside > 0 and rows_beside <= rows + 1
    if bar and not is_beside:
        below += 1.8 * font
    return canvas.ax.legend(
        [handle for handle, _ in entries],
        [label for _, label in entries],
        loc="upper right" if is_beside else "upper center",
        bbox_to_anchor=(1.0 if is_beside else 0.5, 0.0),
        bbox_transform=canvas.ax.transAxes + _shift(canvas.ax, 0, -below - 0.35 * font),
        ncols=max(beside if is_beside else columns, 1),
        fontsize=font,
        frameon=False,
        borderpad=0,
        borderaxespad=0,
        handlelength=_HANDLE,
        handletextpad=_GAP,
        columnspacing=_BETWEEN,
        labelspacing=0.45,
        labelcolor=style.INK,
        handler_map={tuple: HandlerTuple(ndivide=None, pad=0)},
    )


def _columns(widths: Sequence[float], font: float, room: float) -> int:
    """Return the number of columns of a legend that fit the room with full rows; 0 for none."""
    best = 0
    for columns in range(1, len(widths) + 1):
        rows = -(-len(widths) // columns)
        # matplotlib fills columns top down, the first ones with one more entry.
        split = np.array_split(np.asarray(widths), columns)
        each = [column.max() + (_HANDLE + _GAP) * font for column in split]
        if sum(each) + (columns - 1) * _BETWEEN * font > room:
            continue
        if best == 0 or rows < -(-len(widths) // best):
            best = columns
    return best


def label_axes(canvas: Canvas) -> None:
    """Leave a thin frame round the map, with ticks and labels in metres."""
    ax, font = canvas.ax, canvas.sizes.font
    ax.tick_params(labelsize=font, width=0.6, length=0.35 * font, color=style.ARC)
    ax.set_xlabel("x in metres", fontsize=font, labelpad=0.3 * font)
    ax.set_ylabel("y in metres", fontsize=font, labelpad=0.3 * font)
    for spine in ax.spines.values():
        spine.set(linewidth=0.6, color=style.ARC)


def frame_axes(canvas: Canvas) -> None:
    """Leave a thin frame round the map, without ticks."""
    canvas.ax.set(xticks=[], yticks=[])
    for spine in canvas.ax.spines.values():
        spine.set(linewidth=0.6, color=style.ARC)


def finish(
    canvas: Canvas, entries: Sequence[Entry], words: Sequence[str], *, framed: bool = False
) -> Axes:
    """Add title, scale bar and legend, and a thin frame or none, and return the axes."""
    if not framed:
        canvas.ax.set_axis_off()
    add_title(canvas, words)
    if framed:
        frame_axes(canvas)
    bar = add_scale_bar(canvas)
    legend = add_legend(canvas, entries, bar=bar, below=0.35 * canvas.sizes.font)
    fit_height(canvas, legend)
    return canvas.ax


def finish_with_axes(canvas: Canvas, entries: Sequence[Entry], words: Sequence[str]) -> None:
    """Add the title, axes in metres and legend."""
    label_axes(canvas)
    add_title(canvas, words)
    fit_height(canvas, add_legend(canvas, entries, bar=0, below=LABELS * canvas.sizes.font))


def fit_height(canvas: Canvas, legend: Legend) -> None:
    """Set the height of a new figure to that of the map and the items round it."""
    if not canvas.is_new:
        return
    ax, view, figure = canvas.ax, canvas.view, canvas.ax.figure.figure
    width = float(figure.get_size_inches()[0])
    ax.apply_aspect()
    box = ax.get_window_extent()
    around = ax.get_tightbbox() or box
    lowest = min(around.y0, legend.get_window_extent().y0)
    outside = np.array([*_ticks(ax), box.y0 - lowest, around.y1 - box.y1])
    left, right, bottom, top = outside.clip(0) / figure.dpi + PAD_IN
    map_width = width - left - right
    map_height = min(map_width * view.size[1] / view.size[0], MAX_HEIGHT * width)
    height = map_height + bottom + top
    figure.set_size_inches(width, height)
    place = Bbox.from_bounds(left / width, bottom / height, map_width / width, map_height / height)
    ax.set_position(place)


def _room_over(canvas: Canvas) -> float:
    """Return the width in points of the room over or under the middle of the map.

    `fit_height` moves the map of a new figure aside, so that its ticks have room.
    """
    if not canvas.is_new:
        return canvas.room
    left, right = _ticks(canvas.ax)
    return canvas.room - 72 * abs(left - right) / canvas.ax.figure.dpi


def _ticks(ax: Axes) -> tuple[float, float]:
    """Return the widths of ticks with labels left and right of the map, in pixels.

    Only they take room from the map: a title may be wider.
    """
    if not ax.axison:
        return 0.0, 0.0
    ax.apply_aspect()
    box = ax.get_window_extent()
    ticks = [t for axis in (ax.xaxis, ax.yaxis) if (t := axis.get_tightbbox()) is not None]
    left = max((box.x0 - tick.x0 for tick in ticks), default=0.0)
    right = max((tick.x1 - box.x1 for tick in ticks), default=0.0)
    return max(left, 0.0), max(right, 0.0)


def _shift(ax: Axes, right: float, up: float) -> ScaledTranslation:
    """Return a translation on the page, in points."""
    return ScaledTranslation(right / 72, up / 72, ax.figure.dpi_scale_trans)
