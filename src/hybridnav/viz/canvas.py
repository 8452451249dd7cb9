"""Axes in the map frame, with the image of the cells in view, and the files of figures."""

from __future__ import annotations

import base64
import io
import json
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import Affine2D, Bbox
from PIL import Image

from hybridnav._base.files import replace_file
from hybridnav._base.trig import hypots
from hybridnav._base.typing import AnyArray, ByteArray, FloatArray, PathLike
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.viz import style
from hybridnav.viz.style import Sizes

MAX_IMAGE_SIDE = 6000
"""Cells per side beyond which an image is averaged first, more than any page resolves."""
MAX_HEIGHT = 1.1
"""Greatest height of the map in a new figure, in figure widths."""
PAD_IN = 0.04
ARROW_IN = 0.07
"""Length of arrows in inches, on a picture of the full width."""
_MOST_IN = 500
"""Widest figure in inches: matplotlib draws up to 65,536 pixels, a hundred to the inch."""


def new_figure(width_in: float, height: float) -> Figure:
    """Return a new figure.

    `width_in`: width in inches; `height`: height in widths. Raises `InvalidValueError` when the
    width is not positive, or above 500 inches.
    """
    if not 0 < width_in <= _MOST_IN:
        raise InvalidValueError(
            f"width must be a positive number of inches, at most {_MOST_IN}, got {width_in}"
        )
    return Figure(figsize=(width_in, height * width_in))


@dataclass(frozen=True)
class View:
    """The rectangle of the map frame that a picture shows, in metres."""

    low: FloatArray
    high: FloatArray

    @property
    def size(self) -> FloatArray:
        """Width and height."""
        return self.high - self.low

    def holding(self, points: FloatArray, margin: float) -> View:
        """Return the view grown to contain points, except those farther off than its own size."""
        reach = self.size.max()
        near = ((points > self.low - reach) & (points < self.high + reach)).all(axis=1)
        inside = points[near]
        return View(
            np.minimum(self.low, inside.min(axis=0, initial=np.inf) - margin),
            np.maximum(self.high, inside.max(axis=0, initial=-np.inf) + margin),
        )


def known_view(grid: OccupancyGrid) -> View:
    """Return the bounding box in the map frame of the cells that are not unexplored, with a
    margin."""
    known = grid.measured != CellClass.UNEXPLORED
    if not known.any():
        known = np.ones(grid.shape, dtype=np.bool_)
    rows = np.flatnonzero(known.any(axis=1))
    first = known[rows].argmax(axis=1)
    end = grid.shape[1] - known[rows, ::-1].argmax(axis=1)
    # With yaw, the box round the corners of all rows is tighter than the box round all cells.
    corners = [(rows + up, cols) for up in (0, 1) for cols in (first, end)]
    points = grid.frame.points_of_grid(np.concatenate([np.stack(c, axis=1) for c in corners]))
    low, high = points.min(axis=0), points.max(axis=0)
    margin = max(0.015 * (high - low).max(), grid.resolution_m)
    map_corners = np.array([[0, 0], [0, 1], [1, 0], [1, 1]]) * grid.shape
    whole = grid.frame.points_of_grid(map_corners)
    return View(
        np.maximum(low - margin, whole.min(axis=0)), np.minimum(high + margin, whole.max(axis=0))
    )


@dataclass(frozen=True, eq=False)
class Canvas:
    """Axes that show a view of the map frame, with the sizes of lines on them."""

    ax: Axes
    view: View
    sizes: Sizes
    is_new: bool
    """Whether the axes were made here, so that their figure may be resized."""

    @classmethod
    def opened(cls, ax: Axes | None, width_in: float, view: View) -> Canvas:
        """Return the given axes, or new ones in a new figure of some width, set to a view."""
        is_new = ax is None
        if ax is None:
            ax = new_figure(width_in, MAX_HEIGHT).add_axes((0.0, 0.0, 1.0, 1.0))
        _show(ax, view)
        room = _room_in(ax)
        sizes = Sizes.fitting(float(room[0]), float((72 * room / view.size).min()))
        return cls(ax, view, sizes, is_new)

    @property
    def room(self) -> float:
        """Width of the figure in points, for the items round the map."""
        return 72 * (float(_room_in(self.ax)[0]) - 2 * PAD_IN)

    @property
    def map_width(self) -> float:
        """Width of the map in points."""
        return float(self.view.size[0]) * self.sizes.points_per_metre

    def add_line(self, points: FloatArray, **look: Any) -> Line2D:
        """Draw one line, or marks, at points `(x, y)` in metres; `look` is that of a `Line2D`."""
        line = Line2D(*points.T, **look)
        self.ax.add_line(line)
        return line

    def add_dots(self, at: FloatArray, diameter: float, **look: Any) -> None:
        """Draw dots at points `(x, y)` in metres, of a diameter in points of the page; `look` is
        that of a scatter."""
        self.ax.scatter(at[:, 0], at[:, 1], s=diameter**2, **look)

    def add_lines(self, lines: Iterable[FloatArray], **look: Any) -> None:
        """Draw lines of points `(x, y)` in metres; `look` is that of a `LineCollection`."""
        self.ax.add_collection(LineCollection(list(lines), **look), autolim=False)

    def add_arrows(self, middles: FloatArray, steps: FloatArray, **look: Any) -> None:
        """Draw arrows of one length round points `(x, y)` in metres, along steps; `look` is that of
        a quiver."""
        length_in = ARROW_IN * self.sizes.line
        along = steps / np.maximum(hypots(*steps.T), 1e-9)[:, None] * length_in
        shape: dict[str, Any] = {"headwidth": 6, "headlength": 8, "headaxislength": 8}
        shape |= {"minlength": 0, "units": "inches", "scale_units": "inches", "scale": 1.0}
        shape |= {"angles": "xy", "pivot": "mid", "width": length_in / 8}
        self.ax.quiver(*middles.T, *along.T, **shape, **look)


def _show(ax: Axes, view: View) -> None:
    ax.set_xlim(view.low[0], view.high[0])
    ax.set_ylim(view.low[1], view.high[1])
    ax.set_aspect("equal", adjustable="box")


def _room_in(ax: Axes) -> FloatArray:
    """Return the width and height in inches of the axes in their figure."""
    place, figure = ax.get_position(original=True), ax.figure
    return (
        np.array([place.width * figure.bbox.width, place.height * figure.bbox.height]) / figure.dpi
    )


def draw_cells(canvas: Canvas, grid: OccupancyGrid, field_of: AnyArray, colours: ByteArray) -> None:
    """Draw the cells inside a view, turned into the map frame.

    `colours[field_of]` is the colour of a cell; occupied and blocked cells have their own colours.
    """
    window, block = _window(canvas.view, grid)
    image = _image(grid.measured[window], grid.classes[window], field_of[window], colours, block)
    _draw_image(canvas, grid, image, gid="cells")


def draw_classes(canvas: Canvas, grid: OccupancyGrid) -> None:
    """Draw the cells inside a view by their classes."""
    draw_cells(canvas, grid, grid.classes, style.class_rgb())


def draw_shades(canvas: Canvas, grid: OccupancyGrid, shades: ByteArray, *, gid: str) -> None:
    """Draw RGBA of each cell, uint8 (rows, cols, 4), over the cells that were drawn before."""
    window, block = _window(canvas.view, grid)
    _draw_image(canvas, grid, shades[window][::block, ::block], gid=gid)


def _window(view: View, grid: OccupancyGrid) -> tuple[tuple[slice, slice], int]:
    """Return the cells inside a view, and how many of them a side of a pixel stands for."""
    (left, bottom), (right, top) = view.low, view.high
    cells = grid.frame.cells_of([[left, bottom], [left, top], [right, bottom], [right, top]])
    low = np.maximum(cells.min(axis=0), 0)
    high = np.minimum(cells.max(axis=0) + 1, grid.shape)
    window = np.s_[int(low[0]) : int(high[0]), int(low[1]) : int(high[1])]
    return window, -(-int((high - low).max()) // MAX_IMAGE_SIDE)


def _draw_image(canvas: Canvas, grid: OccupancyGrid, image: ByteArray, *, gid: str) -> None:
    """Draw the pixels of the cells inside the view, turned into the map frame."""
    ax, view = canvas.ax, canvas.view
    (rows, cols), block = _window(view, grid)
    low = np.array([rows.start, cols.start])
    end = low + block * np.array(image.shape[:2])
    (up_x, up_y), (along_x, along_y) = grid.frame.axes_m.tolist()
    to_map = Affine2D.from_values(along_x, along_y, up_x, up_y, *grid.frame.origin_m)
    ax.imshow(
        image,
        origin="lower",
        extent=(float(low[1]), float(end[1]), float(low[0]), float(end[0])),
        transform=to_map + ax.transData,
        # Average if the page is coarser than the map: thin walls must not vanish.
        interpolation="antialiased",
        zorder=0,
        gid=gid,
    )
    _show(ax, view)  # imshow set the limits to those of an image without yaw


def _image(
    measured: ByteArray, classes: ByteArray, field_of: AnyArray, colours: ByteArray, block: int
) -> ByteArray:
    """Return RGB of each cell, averaged over square blocks of cells."""
    strips = []
    occupied, blocked = style.rgb(style.OCCUPIED, style.BLOCKED)
    for row in range(0, measured.shape[0], 64 * block):
        strip = np.s_[row : row + 64 * block]
        image = colours[field_of[strip]]
        image[classes[strip] == CellClass.OCCUPIED] = blocked
        image[measured[strip] == CellClass.OCCUPIED] = occupied
        strips.append(_averaged(image, block) if block > 1 else image)
    return np.concatenate(strips)


def _averaged(image: ByteArray, block: int) -> ByteArray:
    rows, cols, _ = image.shape
    padded = np.pad(image, ((0, -rows % block), (0, -cols % block), (0, 0)), mode="edge")
    blocks = padded.reshape(padded.shape[0] // block, block, -1, block, 3)
    return blocks.mean(axis=(1, 3), dtype=np.float32).astype(np.uint8)


# Files of figures: equal bytes for equal pictures.


_METADATA: dict[str, dict[str, Any]] = {
    ".pdf": {"CreationDate": None},
    ".png": {"Software": None},
    ".svg": dict.fromkeys(("Creator", "Date", "Format", "Type")),
}
_MAX_PIXELS = 30_000


def save_figure(picture: Axes | Figure, path: PathLike, *, dpi: float = 200) -> None:
    """Write a picture to a file.

    The picture has the size of its figure in inches, and grows if an item reaches beyond it, so
    that nothing is cut off.

    Parameters
    ----------
    picture
        Axes, whose whole figure is written, or a figure.
    path
        Target file; the suffix determines the format: `.pdf`, `.png` or `.svg`. An existing file is
        replaced.
    dpi
        Pixels per inch; in PDF and SVG, those of the image of the cells alone.

    Raises
    ------
    InvalidValueError
        When the suffix is unknown, the file cannot be written or the dpi are out of range.

    Examples
    --------
    >>> from hybridnav.viz import plot_map, save_figure
    >>> save_figure(plot_map(hn.example_map("figure1")), "figure1.png")
    """
    file = Path(path)
    suffix = file.suffix.lower()
    if suffix not in _METADATA:
        kinds = ", ".join(_METADATA)
        raise InvalidValueError(f"a picture's file name must end in {kinds}, got '{file}'")
    _write(file, picture_bytes(picture, suffix, dpi=dpi))


def _write(file: Path, data: bytes) -> None:
    try:
        replace_file(file, data)
    except OSError as error:
        raise InvalidValueError(f"cannot write '{file}': {error.strerror or error}") from None


def png_uri(data: bytes) -> str:
    """Return the bytes of a PNG as an address that a page holds."""
    return f"data:image/png;base64,{base64.b64encode(data).decode()}"


def picture_bytes(picture: Axes | Figure, suffix: str, *, dpi: float) -> bytes:
    """Return what `save_figure` writes."""
    figure = picture if isinstance(picture, Figure) else picture.figure.figure
    limit = _MAX_PIXELS / max(figure.get_size_inches())
    if not (math.isfinite(dpi) and 0 < dpi <= limit):
        raise InvalidValueError(f"dpi must be above 0 and at most {limit:.0f} here, got {dpi}")
    data = io.BytesIO()
    with mpl.rc_context():
        mpl.rcParams["svg.hashsalt"] = "hybridnav"
        mpl.rcParams["pdf.fonttype"] = 42  # journals refuse Type 3 fonts
        figure.draw_without_rendering()  # lays out, so that the box below is final
        box = Bbox.union([figure.bbox_inches, figure.get_tightbbox()])
        figure.savefig(
            data, format=suffix[1:], dpi=dpi, bbox_inches=box, metadata=_METADATA[suffix]
        )
    return data.getvalue()


_FRAME_DPI = 100


def checked_animation(path: PathLike) -> Path:
    """Return the file of an animation.

    Raises `InvalidValueError` when its name ends in neither `.gif` nor `.html`.
    """
    file = Path(path)
    if file.suffix.lower() not in {".gif", ".html"}:
        raise InvalidValueError(
            f"an animation's file name must end in .gif or .html, got '{file}': name it so"
        )
    return file


def save_frames(figures: Iterable[Figure], milliseconds: list[int], file: Path) -> None:
    """Write figures of one size as an animation, each for some time; an existing file is replaced.

    Raises `InvalidValueError` when the file cannot be written.
    """
    images = list(map(_pixels, figures))
    if file.suffix.lower() == ".html":
        return _write(file, _page(images, milliseconds))
    stream, (first, *others) = io.BytesIO(), images
    look: dict[str, Any] = {"append_images": others, "duration": milliseconds, "loop": 0}
    first.save(stream, "GIF", save_all=True, optimize=True, **look)
    return _write(file, stream.getvalue())


def _page(images: list[Image.Image], milliseconds: list[int]) -> bytes:
    """Return a page with a slider over the images, which asks nobody for anything; a notebook shows
    it as `IPython.display.HTML(filename=...)`."""
    frames = []
    for image in images:
        stream = io.BytesIO()
        image.save(stream, "PNG", optimize=True)
        frames.append(png_uri(stream.getvalue()))
    values = {"frames": frames, "milliseconds": milliseconds}
    return _PAGE.replace("VALUES", json.dumps(values)).encode()


_PAGE = """<!doctype html><meta charset="utf-8"><title>hybridnav</title>
<figure class="hybridnav-frames" style="margin:0;max-width:60em;font:1em sans-serif">
<img alt="frame" style="width:100%;background:#fff"><figcaption style="display:flex;gap:.5em">
<button type="button" aria-label="play or stop">&#9654;</button>
<input type="range" min="0" value="0" aria-label="frame" style="flex:1"><output></output>
</figcaption><script type="application/json">VALUES</script></figure><script>
for (const figure of document.querySelectorAll(".hybridnav-frames:not([data-ready])")) {
  const [image, play, range, out, values] =
    ["img", "button", "input", "output", "script"].map((name) => figure.querySelector(name));
  const { frames, milliseconds } = JSON.parse(values.textContent);
  let timer = 0;
  const show = (k) => {
    range.value = k; image.src = frames[k]; out.value = `${+k + 1} of ${frames.length}`;
  };
  const run = () => {
    timer = setTimeout(() => { show((+range.value + 1) % frames.length); run(); },
      milliseconds[range.value]);
  };
  play.onclick = () => { timer ? (clearTimeout(timer), (timer = 0)) : run(); };
  range.max = frames.length - 1;
  range.oninput = () => { clearTimeout(timer); timer = 0; show(range.value); };
  figure.dataset.ready = true; show(0);
}
</script>
"""


def _pixels(figure: Figure) -> Image.Image:
    """Return a figure as an image of as few colours as a GIF has."""
    figure.set_dpi(_FRAME_DPI)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # type: ignore[no-untyped-call]
    pixels = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
    image = Image.fromarray(pixels[..., :3].copy())
    return image.quantize(method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
