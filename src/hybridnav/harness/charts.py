"""Charts of losses and times, as figures of the report or files of their own."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.harness.svg import (
    CHART_CSS,
    Look,
    Rect,
    Scale,
    axes,
    coordinate,
    drawing,
    escape,
    labels,
    legend,
    legend_size,
    number,
    percent,
    rounded_share,
    shortened,
    text,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hybridnav._typing import FloatArray

NO_LOSS = 1e-9
"""Largest loss that counts as none: costs are recounted as a + b sqrt 2 to this accuracy."""
LEAST_LOSS_DRAWN = 1e-4

_LOSS_BOX = Rect(58, 30, 440, 230)
_SPEED_BOX = Rect(58, 30, 620, 290)
_ZERO_PX = 52
"""Width of the strip left of the logarithmic axis, where a loss of nothing has its place."""

LIGHT_CSS = (
    ":root{--paper:#fff;--ink:#1b1f24;--quiet:#57606a;--rule:#d8dee4;--link:#0550ae;"
    "--bad:#b3261e;--bad-paper:#fdecea;--good:#116329;--good-paper:#e8f5ea}"
)


def loss_chart(losses: Mapping[str, FloatArray], looks_of: Mapping[str, Look], title: str) -> str:
    """Figure of the share of pairs that lose more than x, a line per method; both logarithmic."""
    known = {name: _known(values) for name, values in losses.items()}
    drawn = {name: values for name, values in known.items() if len(values)}
    missing = [name for name in losses if name not in drawn]
    if not drawn:
        return figure(title, "", "No pair has a known loss.", missing)
    box = _LOSS_BOX
    largest = max(float(values[-1]) for values in drawn.values())
    x = Scale("log", LEAST_LOSS_DRAWN, max(1e-2, largest), box.left + _ZERO_PX, box.right - 6)
    # One pair of the most that a method has stands clear of the axis, where no pair is.
    least = min(0.05, 0.5 / max(map(len, drawn.values())))
    y = Scale("log", least, 1.0, box.bottom, box.top)
    zero = box.left + 14
    lines = [_survival(values, looks_of[name], x, y, zero) for name, values in drawn.items()]
    entries = [
        (looks_of[name], f"{shortened(name)}: {rounded_share(1 - _share_above(values, NO_LOSS))}")
        for name, values in drawn.items()
    ]
    x_ticks = [(zero, "0"), *((x(tick), percent(tick)) for tick in x.ticks(46))]
    frame = axes(
        box,
        x_ticks,
        [(y(tick), percent(tick)) for tick in y.ticks(28)],
        x_label="loss",
        y_label="pairs that lose more",
    )
    width, height = legend_size([content for _, content in entries])
    key_left = box.right + 22
    keys = text(key_left, box.top - 10, "pairs without loss", class_="quiet")
    keys += legend(key_left, box.top - 2, entries)
    size = key_left + max(width, 120), max(box.bottom + 44, box.top + height + 4)
    told = (
        "Each line is the share of pairs whose loss is above the value below it; at 0, the share "
        "with any loss. The share is logarithmic, so that the few worst pairs show; a line on the "
        "axis stands for no pair. A line further down and left is better."
    )
    return figure(title, drawing(*size, title, frame, *lines, keys), told, missing)


def speed_chart(
    losses: Mapping[str, FloatArray],
    times_ms: Mapping[str, float],
    looks_of: Mapping[str, Look],
    title: str,
) -> str:
    """Figure of each method's mean loss over its median time of a query, with labelled points."""
    names = list(dict.fromkeys([*losses, *times_ms]))
    points = {}
    for name in names:
        values, time = _known(losses.get(name)), times_ms.get(name, math.nan)
        if len(values) and math.isfinite(time) and time > 0:
            points[name] = (float(time), float(values.mean()))
    missing = [name for name in names if name not in points]
    if not points:
        return figure(title, "", "No method has both a time and a loss.", missing)
    box = _SPEED_BOX
    times, means = zip(*points.values(), strict=True)
    slow = max(*times, 10 * min(times)) * 1.3
    x = Scale("log", min(times) / 1.3, slow, box.left, box.right)
    low = min(0.0, *means) * 1.3
    y = Scale("symlog", low, max(1e-3, *means) * 1.3, box.bottom - 10, box.top + 8)
    places = [(x(time), y(mean)) for time, mean in points.values()]
    frame = axes(
        box,
        [(x(tick), number(tick)) for tick in x.ticks(44)],
        [(y(tick), percent(tick)) for tick in y.ticks(22)],
        x_label="median time of a query, ms",
        y_label="mean loss",
    )
    dots = [
        looks_of[name].dot(*place, f"{name}: {time:.3g} ms, {100 * mean:.3g} %")
        for (name, (time, mean)), place in zip(points.items(), places, strict=True)
    ]
    names_drawn = labels(places, [shortened(name) for name in points], box)
    svg = drawing(box.right + 12, box.bottom + 44, title, frame, names_drawn, *dots)
    return figure(
        title,
        svg,
        "Down and to the left is better; the loss axis is logarithmic above 0.01\u00a0%.",
        missing,
    )


def chart_file(chart: str) -> str:
    """A figure's drawing as the text of an SVG file of its own, in the light palette."""
    svg = chart[chart.index("<svg") : chart.index("</svg>") + len("</svg>")]
    head, _, rest = svg.partition(">")
    opening = head.replace("<svg", '<svg xmlns="http://www.w3.org/2000/svg"')
    style = f"{LIGHT_CSS}{CHART_CSS}svg{{font:13px system-ui,sans-serif}}"
    paper = '<rect width="100%" height="100%" fill="#fff"/>'
    return f"{opening}><style>{style}</style>{paper}{rest}\n"


def _survival(values: FloatArray, look: Look, x: Scale, y: Scale, zero: float) -> str:
    """A falling staircase with one corner per unit of x at most, and a marker at no loss."""
    columns = np.arange(math.ceil(x.end - x.start) + 1)
    power = np.log10(x.low) + columns / (x.end - x.start) * np.log10(x.high / x.low)
    shares = 1 - np.searchsorted(values, 10**power, side="right") / len(values)
    path = [f"M{coordinate(zero)} {coordinate(y(_share_above(values, NO_LOSS)))}"]
    path.append(f"L{coordinate(x.start)} {coordinate(y(float(shares[0])))}")
    corners = np.flatnonzero(np.diff(shares)) + 1
    path += [
        f"H{coordinate(x.start + column)}V{coordinate(y(float(shares[column])))}"
        for column in corners.tolist()
    ]
    end = x.end if shares[-1] > 0 or not len(corners) else x.start + corners[-1]
    path.append(f"H{coordinate(float(end))}")
    return look.line("".join(path)) + look.dot(zero, y(_share_above(values, NO_LOSS)))


def figure(title: str, svg: str, told: str, missing: Sequence[str]) -> str:
    """A drawing with its title, what there is to say of it, and who is not in it."""
    left_out = f" Not drawn, for want of values: {', '.join(missing)}." if missing else ""
    caption = f"<strong>{escape(title)}.</strong> {escape(told + left_out)}".rstrip()
    return f"<figure>{svg}<figcaption>{caption}</figcaption></figure>"


def _known(values: FloatArray | None) -> FloatArray:
    """Finite losses, rising."""
    if values is None:
        return np.empty(0)
    return np.sort(values[np.isfinite(values)])


def _share_above(values: FloatArray, loss: float) -> float:
    return 1 - float(np.searchsorted(values, loss, side="right")) / len(values)
