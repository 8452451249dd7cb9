"""A worst case drawn: the map round two paths as a small PNG, the paths over it as SVG."""

from __future__ import annotations

import base64
import io
import math
from typing import TYPE_CHECKING

import numpy as np
import shapely
from PIL import Image

from hybridnav.grid import CellClass
from hybridnav.harness.svg import coordinate, drawing, element, round_step, text

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray, FloatArray

PICTURE_PX = 480
"""Pixels of the longer side of a map's PNG, at most."""

Box = tuple[int, int, int, int]
"""First row, row after the last, first column, column after the last."""

_DRAWN = 320.0
"""Drawing units of the longer side: fewer than pixels, so that the picture is sharp in print."""
_NARROWEST = 150.0
"""Drawing units that the scale bar and its label need."""
_MARGIN = 0.08
_LEAST_MARGIN_CELLS = 4
_LEAST_ASPECT = 0.45
_THINNED = 0.35
"""Drawing units by which a drawn line may leave the path: less than a pixel of the screen."""
_COARSE_PX = 160
"""Below this many pixels the cells are drawn with sharp edges; above, shrinking with them would
drop walls."""

_RANK = np.zeros(256, np.uint8)
_RANK[CellClass.FREE], _RANK[CellClass.OCCUPIED] = 1, 2
_PALETTE = (176, 180, 186, 255, 255, 255, 44, 48, 54)
"""Unexplored, free, occupied: grey, white, nearly black, in that order of rank."""

PICTURE_CSS = (
    "svg .casing{stroke:#fff;stroke-width:5;fill:none;stroke-linejoin:round}"
    "svg .path{stroke:#d55e00;stroke-width:3;fill:none;stroke-linejoin:round}"
    "svg .optimum{stroke:#0072b2;stroke-width:2;fill:none;stroke-dasharray:5 3}"
    "svg .end{fill:#d55e00;stroke:#fff;stroke-width:1.5}"
    "svg .sharp{image-rendering:pixelated}"
    "svg .bar{stroke:var(--ink);stroke-width:2;fill:none}"
)


def draw_case(
    classes: ByteArray,
    path: FloatArray,
    optimum: FloatArray | None,
    *,
    resolution_m: float,
    title: str,
) -> str:
    """The part of a map round a path and the shortest one, y up, both drawn, with a scale bar.

    Parameters
    ----------
    classes
        uint8 (rows, cols) `CellClass`, row 0 at the lowest y.
    path, optimum
        float64 (n, 2), (row, col) from start to goal, centres of cells at whole numbers; they may
        be empty.
    resolution_m
        Side of a cell in metres.
    title
        The drawing's name for a reader who cannot see it.

    Returns
    -------
    str
        An `svg` element that holds its picture.
    """
    lines = [line for line in (path, optimum) if line is not None and len(line)]
    box = crop_box(classes.shape, lines)
    low, high, left, right = box
    factor = max(1, math.ceil(max(high - low, right - left) / PICTURE_PX))
    pixels = downsampled(classes[low:high, left:right], factor)
    unit = _DRAWN / (factor * max(pixels.shape))
    height, width = (unit * factor * side for side in pixels.shape)
    drawn = {
        "href": png_uri(pixels[::-1]),
        "width": width,
        "height": height,
        "preserveAspectRatio": "none",
    }
    if max(pixels.shape) < _COARSE_PX:
        drawn["class_"] = "sharp"
    # The top of the picture is the top of its last row of pixels, which may overhang the crop.
    top = low + factor * pixels.shape[0]
    placed = [_placed(line, top, left, unit) for line in (path, optimum) if line is not None]
    bar = _scale_bar(max(width, _NARROWEST), width, height, unit / resolution_m)
    outline = f"M.5 .5h{width - 1:.1f}v{height - 1:.1f}h{1 - width:.1f}z"
    return drawing(
        max(width, _NARROWEST),
        height + 22,
        title,
        element("image", **drawn),
        element("path", class_="axis", d=outline),
        *_routes(placed),
        bar,
    )


def crop_box(shape: tuple[int, ...], lines: list[FloatArray]) -> Box:
    """The part of a map to show: a box round all lines with a margin, not too narrow."""
    rows, cols = shape
    if not lines:
        return 0, rows, 0, cols
    cells = np.concatenate(lines)
    low, left = np.floor(cells.min(axis=0)).astype(int).tolist()
    high, right = (np.ceil(cells.max(axis=0)).astype(int) + 1).tolist()
    longer = max(high - low, right - left)
    margin = max(_LEAST_MARGIN_CELLS, round(_MARGIN * longer))
    least = math.ceil(_LEAST_ASPECT * (longer + 2 * margin))
    return (
        *_stretched(low - margin, high + margin, least, rows),
        *_stretched(left - margin, right + margin, least, cols),
    )


def downsampled(classes: ByteArray, factor: int) -> ByteArray:
    """Blocks of `factor` x `factor` cells as pixels: 2 occupied, 1 free, 0 unexplored.

    The largest in a block wins, so no wall disappears; blocks at the far sides may be incomplete.
    """
    ranks = _RANK[classes]
    for axis in (0, 1):
        starts = np.arange(0, ranks.shape[axis], factor)
        ranks = np.maximum.reduceat(ranks, starts, axis=axis)
    return ranks


def png_uri(pixels: ByteArray) -> str:
    """Pixels of `downsampled`, row 0 on top, as a PNG in a data URI."""
    image = Image.fromarray(np.ascontiguousarray(pixels))
    image.putpalette(_PALETTE)
    held = io.BytesIO()
    image.save(held, format="PNG", optimize=True, bits=2)
    return "data:image/png;base64," + base64.b64encode(held.getvalue()).decode("ascii")


def _stretched(low: int, high: int, least: int, size: int) -> tuple[int, int]:
    more = max(0, least - (high - low))
    return max(0, low - more // 2), min(size, high + more - more // 2)


def _placed(line: FloatArray, top: int, left: int, unit: float) -> FloatArray:
    """Centres of cells in drawing units, y down."""
    centres = np.column_stack((line[:, 1] + 0.5 - left, top - line[:, 0] - 0.5))
    return centres.astype(np.float64) * unit


def _routes(placed: list[FloatArray]) -> list[str]:
    parts = []
    for points, style in zip(placed, ("path", "optimum"), strict=False):
        line = _polyline(points)
        if line and style == "path":
            parts.append(element("polyline", class_="casing", points=line))
        if line:
            parts.append(element("polyline", class_=style, points=line))
    ends = next((points for points in placed if len(points)), None)
    if ends is not None:
        (x, y), (goal_x, goal_y) = ends[0].tolist(), ends[-1].tolist()
        square = {"x": goal_x - 5, "y": goal_y - 5, "width": 10, "height": 10}
        goal = element("rect", element("title", "goal"), class_="end", **square)
        start = element("circle", element("title", "start"), class_="end", cx=x, cy=y, r=5.5)
        parts += [goal, start]
    return parts


def _polyline(points: FloatArray) -> str:
    if len(points) == 0 or (points == points[0]).all():
        return ""
    line = shapely.simplify(shapely.LineString(points), _THINNED, preserve_topology=False)
    # A path that returns to its start can be simplified to nothing.
    kept = shapely.get_coordinates(line) if not line.is_empty else points
    return " ".join(f"{coordinate(x)},{coordinate(y)}" for x, y in kept.tolist())


def _scale_bar(room: float, width: float, height: float, unit_per_m: float) -> str:
    """A bar of a round length, at most half as wide as the picture, and its length in metres."""
    longest = min(width, room) / 2 / unit_per_m
    step = round_step(longest)
    length = step if step <= longest else step / (2.5 if f"{step:e}"[0] == "5" else 2)
    y = height + 14
    d = f"M1 {coordinate(y - 4)}v8M1 {coordinate(y)}h{length * unit_per_m:.1f}v-4v8"
    return element("path", class_="bar", d=d) + text(
        length * unit_per_m + 8, y + 4, f"{length:.6g}\u00a0m"
    )
