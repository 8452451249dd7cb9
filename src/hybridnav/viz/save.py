"""Writer of pictures, with equal bytes for equal pictures."""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.transforms import Bbox

from hybridnav._base.files import replace_file
from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hybridnav._base.typing import PathLike

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
    data = picture_bytes(picture, suffix, dpi=dpi)
    try:
        replace_file(file, data)
    except OSError as error:
        raise InvalidValueError(f"cannot write '{file}': {error.strerror or error}") from None


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
