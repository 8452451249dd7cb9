"""Charts of methods: what their paths lose, and how long their queries take. Public: `plot_losses`
and `plot_speed`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.markers import MarkerStyle
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator
from matplotlib.transforms import Affine2D

from hybridnav.errors import InvalidValueError
from hybridnav.maps.cells import TOLERANCE
from hybridnav.viz import style
from hybridnav.viz.canvas import new_figure
from hybridnav.viz.style import Sizes

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from numpy.typing import ArrayLike

    from hybridnav._base.typing import FloatArray

LEAST_LOSS = 1e-4
"""Where a scale of losses turns from linear to logarithmic: 0.01 %, the least loss worth a look."""

_HEIGHT = 0.46
"""Height of a new figure, in figure widths."""
_BOX = (0.1, 0.14, 0.54, 0.8)
"""Axes in a new figure; the legend stands right of them."""
_LINEAR_DECADES = 0.4
"""Length of the linear part of a scale of losses, in decades."""
_LONGEST_NAME = 32
_SAMPLES = 400
"""Losses at which a line may fall: more than a page resolves."""
_MARK_HEIGHT = 0.03  # of the axes
_MANY = 1000.0
_FEW = 100.0
"""Span of an axis that has room for more labels than one a decade."""
_MOST_DECADES = 8
"""Decades of losses that an axis has room to label one by one."""
_ALL = 100.0
"""Per cent."""


@dataclass(frozen=True, slots=True)
class MethodStyle:
    """How charts draw one method."""

    colour: str
    dashes: tuple[float, ...]
    """Lengths in line widths, of ink and gap in turn; none for a line without gaps."""
    marker: str

    def line(self, sizes: Sizes) -> Line2D:
        """Return a line without points in this style."""
        line = self.dot(sizes)
        line.set_linestyle((0.0, self.dashes) if self.dashes else "-")
        return line

    def dot(self, sizes: Sizes) -> Line2D:
        """Return a marker without a point in this style."""
        size = sizes.line
        mark = {"marker": self.marker, "ms": 6.5 * size, "mec": style.INK, "mew": 0.6 * size}
        line = Line2D([], [], color=self.colour, lw=1.5 * size, ls="none", clip_on=False)
        line.set(**mark)
        return line


@runtime_checkable
class HasLosses(Protocol):
    """What knows the losses of methods, such as a study of the harness."""

    @property
    def losses(self) -> Mapping[str, ArrayLike]:
        """For each method the losses of its pairs, as in `plot_losses`."""
        ...


_DASHES = ((), (3.5, 1.5), (1.0, 1.25), (4.5, 1.5, 1.0, 1.5), (2.0, 1.0))
_MARKERS = "os^DvPX*"


def method_styles(names: Iterable[str]) -> dict[str, MethodStyle]:
    """Return a style for each name, so that several charts draw a method alike.

    Parameters
    ----------
    names
        Methods; the first mention of a name counts.

    Returns
    -------
    dict
        By name. No two of the first 35 styles share colour and dashes, or colour and marker.

    Examples
    --------
    >>> from hybridnav.viz import method_styles
    >>> list(method_styles(["shortest", "paper"]))
    ['shortest', 'paper']
    """
    return {
        name: MethodStyle(
            style.METHODS[index % len(style.METHODS)],
            _DASHES[index % len(_DASHES)],
            _MARKERS[index % len(_MARKERS)],
        )
        for index, name in enumerate(dict.fromkeys(names))
    }


def plot_losses(
    losses: Mapping[str, ArrayLike] | HasLosses,
    *,
    styles: Mapping[str, MethodStyle] | None = None,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw, for each method, the share of pairs that lose more than the value below it.

    The share is logarithmic, so that the few worst pairs show; a line ends at its largest loss.
    Marks of lines that begin as high stand side by side. The legend has the share without loss.

    Parameters
    ----------
    losses
        For each method the losses of its pairs, 0.01 for 1 %; infinite and NaN ones are left out.
        Or a study.
    styles
        By method, see `method_styles`; by default made here.
    ax
        Where to draw; by default new axes in a new figure. The legend stands right of them.
    title
        Title of the chart; by default there is none.
    width_in
        Width of a new figure in inches; it grows when it is saved, where names are long.

    Raises
    ------
    InvalidValueError
        When there is no method, or one has no finite loss.

    Examples
    --------
    >>> from hybridnav.viz import plot_losses
    >>> plot_losses({"paper": [0.0, 0.1, 0.3]}, title="losses").get_title()
    'losses'
    """
    given = losses.losses if isinstance(losses, HasLosses) else losses
    known = {name: _known(name, values) for name, values in given.items()}
    ax, sizes = _opened(ax, width_in, known, title)
    styles = method_styles(known) if styles is None else styles
    largest = max(1e-2, *(float(values[-1]) for values in known.values()))
    # One pair of the most that a method has stands clear of the lower side, where no pair is.
    least = min(0.05, 0.5 / max(map(len, known.values())))
    handles, labels = [], []
    marks: dict[Line2D, float] = {}
    for name, values in known.items():
        at = np.array([TOLERANCE, *np.geomspace(LEAST_LOSS, max(LEAST_LOSS, values[-1]), _SAMPLES)])
        shares = 1 - np.searchsorted(values, at, side="right") / len(values)
        handles.append(styles[name].line(sizes))
        line, mark = styles[name].line(sizes), styles[name].dot(sizes)
        line.set(data=(at, shares.clip(least)), drawstyle="steps-post", marker="", zorder=3)
        ax.add_line(line)
        share = max(shares[0], least)
        beside = sum(abs(math.log(y / share, least)) < _MARK_HEIGHT for y in marks.values())
        mark.set_marker(MarkerStyle(mark.get_marker(), transform=Affine2D().translate(beside, 0)))
        mark.set(data=([TOLERANCE], [share]), zorder=4)  # over all lines
        marks[mark] = share
        labels.append(f"{_short(name)}: {_percent(1 - shares[0])}")
    for mark in marks:
        ax.add_line(mark)
    ax.set_xscale("symlog", linthresh=LEAST_LOSS, linscale=_LINEAR_DECADES)
    ax.set_yscale("log")
    ax.set(xlim=(0.0, largest), ylim=(least, 1.0))
    _tick_losses(ax.xaxis)
    _tick_decades(ax.yaxis, 1 / least, factor=100.0)
    _finish(ax, sizes, "loss in per cent", "pairs that lose more, in per cent")
    _add_legend(ax, sizes, handles, labels, "pairs without loss")
    return ax


def plot_speed(  # noqa: PLR0913 - all but two have defaults
    losses: Mapping[str, ArrayLike],
    times_ms: Mapping[str, float],
    *,
    styles: Mapping[str, MethodStyle] | None = None,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw each method's mean loss over the median time of its queries.

    Both axes are logarithmic, that of losses above 0.01 %; the legend has both figures.

    Parameters
    ----------
    losses
        For each method the losses of its pairs, 0.01 for 1 %. Infinite and NaN ones are left out.
    times_ms
        For each method of `losses` the median time of a query in milliseconds.
    styles
        By method, see `method_styles`; by default made here.
    ax
        Where to draw; by default new axes in a new figure. The legend stands right of them.
    title
        Title of the chart; by default there is none.
    width_in
        Width of a new figure in inches; it grows when it is saved, where names are long.

    Raises
    ------
    InvalidValueError
        When there is no method, or one has no finite loss or no finite time above 0.

    Examples
    --------
    >>> from hybridnav.viz import plot_speed
    >>> plot_speed({"paper": [0.0, 0.1]}, {"paper": 0.5}, title="speed").get_title()
    'speed'
    """
    means = {name: float(_known(name, values).mean()) for name, values in losses.items()}
    for name in means:
        time_ms = times_ms.get(name, math.nan)
        if not (math.isfinite(time_ms) and time_ms > 0):
            raise InvalidValueError(
                f"method '{name}' needs a finite time above 0 ms, got {time_ms}: leave it out"
            )
    ax, sizes = _opened(ax, width_in, means, title)
    styles = method_styles(means) if styles is None else styles
    handles, labels = [], []
    for name, mean in means.items():
        dot = styles[name].dot(sizes)
        handles.append(styles[name].dot(sizes))
        dot.set(data=([times_ms[name]], [mean]), zorder=3)
        ax.add_line(dot)
        labels.append(f"{_short(name)}: {_rounded(times_ms[name])} ms, {_rounded(100 * mean)} %")
    times = [times_ms[name] for name in means]
    low, high = min(times) / 1.3, max(*times, 10 * min(times)) * 1.3
    ax.set_xscale("log")
    ax.set_yscale("symlog", linthresh=LEAST_LOSS, linscale=_LINEAR_DECADES)
    lowest = 1.3 * min(0.0, *means.values()) - 0.2 * LEAST_LOSS
    highest = 1.3 * max(1e-3, *means.values())
    ax.set(xlim=(low, high), ylim=(lowest, highest))
    _tick_decades(ax.xaxis, high / low)
    _tick_losses(ax.yaxis)
    _finish(ax, sizes, "median time of a query in ms", "mean loss in per cent")
    _add_legend(ax, sizes, handles, labels, "median time, mean loss")
    return ax


def _known(name: str, values: ArrayLike) -> FloatArray:
    """Return the finite losses of a method, rising."""
    known = np.asarray(values, dtype=np.float64).ravel()
    known = np.sort(known[np.isfinite(known)])
    if not len(known):
        raise InvalidValueError(f"method '{name}' needs a finite loss, got none: leave it out")
    return known


def _opened(
    ax: Axes | None, width_in: float, methods: Mapping[str, object], title: str | None
) -> tuple[Axes, Sizes]:
    if not methods:
        raise InvalidValueError("a chart needs one method at least, got none")
    if ax is None:
        ax = new_figure(width_in, _HEIGHT).add_axes(_BOX)
    sizes = Sizes.fitting(float(ax.figure.figure.get_size_inches()[0]), 1.0)
    if title:
        ax.set_title(title, fontsize=sizes.font, color=style.INK, parse_math=False)
    return ax, sizes


def _tick_decades(axis: Axis, span: float, *, factor: float = 1.0) -> None:
    """Label round values of a logarithmic axis, the more of them the fewer decades it spans."""
    subs = (1, 2, 5) if span < _FEW else (1, 3) if span < _FEW**2 else (1,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=8))
    _label(axis, factor)


def _tick_losses(axis: Axis) -> None:
    """Label 0 and powers of ten on both sides of it, fewer of them the more decades there are."""
    low, high = axis.get_view_interval()
    decades = [math.log10(max(side / LEAST_LOSS, 1.0)) for side in (-low, high)]
    step = math.ceil(sum(decades) / _MOST_DECADES)
    top = math.floor(math.log10(LEAST_LOSS) + max(decades) + 1e-9)
    # The least power lies close to 0, and goes first.
    least = round(math.log10(LEAST_LOSS)) + (step > 1)
    powers = 10.0 ** np.arange(top, least - 1, -step)
    if sum(decades) <= _MOST_DECADES / 2:
        powers = np.concatenate([powers, 3 * powers])
    ticks = np.concatenate([-powers, [0.0], powers])
    axis.set_major_locator(FixedLocator(np.sort(ticks[(ticks >= low) & (ticks <= high)]).tolist()))
    _label(axis, 100.0)


def _label(axis: Axis, factor: float) -> None:
    """Label ticks with their value times a factor, and no ticks between them."""
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: _number(factor * value)))


def _number(value: float) -> str:
    return f"{value:.6g}".replace("-", "\u2212")


def _percent(share: float) -> str:
    """Return a share in per cent with one decimal, 0 or 100 only where that is exact."""
    shown = round(100 * share, 1)
    if shown == _ALL and share < 1:
        return "> 99.9 %"
    return "< 0.1 %" if shown == 0 < share else f"{shown:g} %"


def _rounded(value: float) -> str:
    """Return a value with three digits, without an exponent where it is large."""
    text = f"{value:,.0f}" if abs(value) >= _MANY else f"{value:.3g}"
    return text.replace("-", "\u2212")


def _short(name: str) -> str:
    """Return a name as a chart can show it: no longer than there is room, without control codes."""
    shown = "".join(c if c.isprintable() else " " if c.isspace() else "\ufffd" for c in name)
    return shown if len(shown) <= _LONGEST_NAME else f"{shown[: _LONGEST_NAME - 1]}\u2026"


def _finish(ax: Axes, sizes: Sizes, x_label: str, y_label: str) -> None:
    font = sizes.font
    ax.set_xlabel(x_label, fontsize=font, color=style.INK)
    ax.set_ylabel(y_label, fontsize=font, color=style.INK)
    ax.tick_params(labelsize=font, width=0.6, length=0.35 * font, color=style.ARC)
    ax.grid(visible=True, color=style.UNEXPLORED, linewidth=0.5)
    ax.set_axisbelow(True)
    for side, spine in ax.spines.items():
        spine.set(linewidth=0.6, color=style.ARC, visible=side in {"left", "bottom"})


def _add_legend(
    ax: Axes, sizes: Sizes, handles: Sequence[Line2D], labels: Sequence[str], title: str
) -> None:
    """Put a legend right of the axes, whose labels may hold any characters."""
    legend = ax.legend(
        handles,
        ["" for _ in handles],
        title=title,
        loc="upper left",
        bbox_to_anchor=(1.02, 1.03),
        fontsize=sizes.font,
        title_fontsize=sizes.font,
        alignment="left",
        frameon=False,
        borderaxespad=0,
        handlelength=1.2 if handles[0].get_linestyle() == "None" else 4.0,
        labelcolor=style.INK,
    )
    for text, label in zip(legend.get_texts(), labels, strict=True):
        text.set(text=label, parse_math=False)
