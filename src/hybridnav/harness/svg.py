"""Charts as inline SVG text: scales, ticks, axes, lines, markers, legends, labels kept apart."""

from __future__ import annotations

import html
import itertools
import math
import re
import unicodedata
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

Kind = Literal["linear", "log", "symlog"]

FONT_PX = 12
TEXT_GAP_PX = 8.0
WHOLE = 100.0
"""Per cent."""
LONGEST_NAME = 32
"""Characters of a name that a chart shows; the whole name is in the tooltip."""

_SYMLOG_UNIT = 1e-4
"""Where a symlog scale turns from linear to logarithmic: 0.01 %, the least loss worth a look."""
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "var(--ink)")
"""Okabe and Ito's palette, safe for the colour-blind, without the yellow that white swallows."""
_DASHES = ("", "7 3", "2 2.5", "9 3 2 3", "4 2")
_MARKERS = ("circle", "square", "up", "diamond", "down", "plus", "cross", "star")
_DIRECTIONS = tuple(
    (math.cos(math.radians(angle)), math.sin(math.radians(angle)))
    for angle in (0, 180, -90, 90, -45, 45, -135, 135, -22, 22, -158, 158, -68, 68, -112, 112)
)
"""In which labels are tried, y down: beside the point first, then above and below."""
_UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")

CHART_CSS = (
    "svg text{font:12px system-ui,sans-serif;fill:var(--ink)}"
    "svg .name{paint-order:stroke;stroke:var(--paper);stroke-width:3px}"
    "svg .quiet{fill:var(--quiet)}"
    "svg .grid{stroke:var(--rule);stroke-width:1;fill:none}"
    "svg .axis{stroke:var(--quiet);stroke-width:1;fill:none}"
    "svg .line{stroke:var(--c);stroke-width:2;fill:none;stroke-linejoin:round}"
    "svg .dot{fill:var(--c);stroke:var(--ink);stroke-width:.8}"
    "svg .leader{stroke:var(--quiet);stroke-width:.7;fill:none}"
) + "".join(f".c{index}{{--c:{colour}}}" for index, colour in enumerate(_COLOURS))


def escape(text: str) -> str:
    """`text` for HTML, in an element or in a quoted attribute; what no page may hold is replaced.

    A file name can carry control characters and lone surrogates, which cannot be written as UTF-8.
    """
    return html.escape(_UNPRINTABLE.sub("\ufffd", text), quote=True)


def element(name: str, *children: str, **attributes: str | float) -> str:
    """One element as text; children are markup, attributes are escaped here.

    An underscore in an attribute's name stands for a hyphen, one at its end for nothing.
    """
    told = "".join(
        f' {key.rstrip("_").replace("_", "-")}="{_attribute(value)}"'
        for key, value in attributes.items()
    )
    inside = "".join(children)
    return f"<{name}{told}>{inside}</{name}>" if inside else f"<{name}{told}/>"


def text(x: float, y: float, content: str, **attributes: str | float) -> str:
    """A line of text, its baseline starting at a point unless `text_anchor` says otherwise."""
    return element("text", escape(content), x=x, y=y, **attributes)


def drawing(width: float, height: float, title: str, *children: str) -> str:
    """An SVG drawing with a title, at most its natural size and no wider than the page."""
    return element(
        "svg",
        element("title", escape(title)),
        *children,
        viewBox=f"0 0 {coordinate(width)} {coordinate(height)}",
        width=width,
        height=height,
        role="img",
    )


def coordinate(value: float) -> str:
    """A length in drawing units with at most one decimal."""
    short = f"{value:.1f}".removesuffix(".0")
    return "0" if short == "-0" else short


def text_width(content: str) -> float:
    """Width in drawing units, on the safe side: the page's font is not known here."""
    return sum(_glyph_width(character) for character in content)


def shortened(name: str) -> str:
    """A name that fits a chart."""
    return name if len(name) <= LONGEST_NAME else name[: LONGEST_NAME - 1] + "\u2026"


@dataclass(frozen=True, slots=True)
class Look:
    """How one method is drawn everywhere; no two of the first 35 share colour and dash."""

    colour: str
    """CSS class that sets `--c`."""
    dash: str
    marker: str

    def key(self, x: float, y: float) -> str:
        """A legend's sample: a piece of line under a marker, 30 units long from `x`."""
        return self.line(f"M{coordinate(x)} {coordinate(y)}h30") + self.dot(x + 15, y)

    def line(self, path: str) -> str:
        """A line along path data."""
        dash = {"stroke_dasharray": self.dash} if self.dash else {}
        return element("path", class_=f"line {self.colour}", d=path, **dash)

    def dot(self, x: float, y: float, tooltip: str = "") -> str:
        """A marker round a point, 9 units wide."""
        told = element("title", escape(tooltip)) if tooltip else ""
        points = " ".join(
            f"{coordinate(x + 4.5 * dx)},{coordinate(y + 4.5 * dy)}" for dx, dy in _shape(self)
        )
        if self.marker == "circle":
            return element("circle", told, class_=f"dot {self.colour}", cx=x, cy=y, r=4.5)
        return element("polygon", told, class_=f"dot {self.colour}", points=points)


def looks(names: Iterable[str]) -> dict[str, Look]:
    """A look for each name, by order of first appearance."""
    return {
        name: Look(
            f"c{index % len(_COLOURS)}",
            _DASHES[index % len(_DASHES)],
            _MARKERS[index % len(_MARKERS)],
        )
        for index, name in enumerate(dict.fromkeys(names))
    }


@dataclass(frozen=True, slots=True)
class Scale:
    """Values to drawing units: `low` at `start`, `high` at `end`; values beyond stop there."""

    kind: Kind
    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        """Where a value lies."""
        low, high = self._warped(self.low), self._warped(self.high)
        share = (self._warped(min(max(value, self.low), self.high)) - low) / (high - low)
        return self.start + share * (self.end - self.start)

    def _warped(self, value: float) -> float:
        if self.kind == "log":
            return math.log10(value)
        if self.kind == "symlog":
            return math.copysign(math.log10(1 + abs(value) / _SYMLOG_UNIT), value)
        return value

    def ticks(self, gap: float) -> list[float]:
        """Round values on the scale, at least `gap` drawing units apart, rising."""
        if self.kind == "linear":
            room = max(1.0, abs(self.end - self.start) / gap)
            step = round_step((self.high - self.low) / room)
            first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
            return [round(count * step, 12) for count in range(first, last + 1)]
        kept = self._decades(gap)
        below = [tick / 10 for tick in kept] if self.kind == "log" else []
        for digits in ((2, 5), (3,)):
            between = [digit * tick for tick in (*below, *kept) for digit in digits]
            finer = self._inside([*kept, *between])
            if self._apart(finer, gap):
                return finer
        return kept

    def _decades(self, gap: float) -> list[float]:
        """Powers of ten, on a symlog scale on both sides of 0; every second one where room lacks.

        The least power of a symlog scale lies close to 0 and goes first.
        """
        signed = self.kind == "symlog"
        first = math.ceil(math.log10(_SYMLOG_UNIT if signed else self.low) - 1e-9)
        last = math.floor(math.log10(max(abs(self.low), abs(self.high))) + 1e-9)
        kept: list[float] = []
        for every in range(1, last - first + 2):
            for least in (first, first + 1):
                powers = [10.0**power for power in range(last, least - 1, -every)]
                kept = self._inside([*powers, 0.0, *(-p for p in powers)] if signed else powers)
                if self._apart(kept, gap):
                    return kept
        return kept

    def _inside(self, values: Iterable[float]) -> list[float]:
        slack = 1e-9 * (abs(self.low) + abs(self.high))
        rounded = {float(f"{value:.6g}") for value in values}
        return sorted(v for v in rounded if self.low - slack <= v <= self.high + slack)

    def _apart(self, values: Sequence[float], gap: float) -> bool:
        places = sorted(self(value) for value in values)
        return all(b - a >= gap for a, b in itertools.pairwise(places))


def round_step(least: float) -> float:
    """The least of 1, 2, 5, 10, 20, 50, ... times a power of ten that is not below `least`."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(digit * power for digit in (1, 2, 5, 10) if digit * power >= least * (1 - 1e-9))


def number(value: float) -> str:
    """A tick's value without exponent and without trailing zeros."""
    return f"{value:.10f}".rstrip("0").rstrip(".").replace("-", "\u2212") if value else "0"


def percent(share: float) -> str:
    """A share or a loss as a tick label: 0.005 is `0.5 %`."""
    return f"{number(round(100 * share, 8))}\u00a0%"


def rounded_share(share: float) -> str:
    """A share in per cent to one decimal, 0 or 100 only where that is exact."""
    shown = round(100 * share, 1)
    if shown == WHOLE and share < 1:
        return "> 99.9\u00a0%"
    return "< 0.1\u00a0%" if shown == 0 < share else f"{number(shown)}\u00a0%"


@dataclass(frozen=True, slots=True)
class Rect:
    """A box in drawing units, y down."""

    left: float
    top: float
    width: float
    height: float

    @property
    def right(self) -> float:
        """Its right side."""
        return self.left + self.width

    @property
    def bottom(self) -> float:
        """Its lower side."""
        return self.top + self.height

    def shared(self, other: Rect) -> float:
        """Area that two boxes have in common."""
        across = min(self.right, other.right) - max(self.left, other.left)
        down = min(self.bottom, other.bottom) - max(self.top, other.top)
        return max(0.0, across) * max(0.0, down)


def axes(
    box: Rect,
    x_ticks: Sequence[tuple[float, str]],
    y_ticks: Sequence[tuple[float, str]],
    *,
    x_label: str,
    y_label: str,
) -> str:
    """Frame, grid lines, tick labels and the names of both axes; ticks as (place, label)."""
    parts = []
    for x, label in x_ticks:
        d = f"M{coordinate(x)} {coordinate(box.top)}v{coordinate(box.height)}"
        parts.append(element("path", class_="grid", d=d))
        parts.append(text(x, box.bottom + 17, label, text_anchor="middle"))
    for y, label in y_ticks:
        d = f"M{coordinate(box.left)} {coordinate(y)}h{coordinate(box.width)}"
        parts.append(element("path", class_="grid", d=d))
        parts.append(text(box.left - 7, y + 4, label, text_anchor="end"))
    frame = f"M{coordinate(box.left)} {coordinate(box.top)}v{coordinate(box.height)}"
    middle = box.left + box.width / 2
    return "".join(
        [
            *parts,
            element("path", class_="axis", d=f"{frame}h{coordinate(box.width)}"),
            text(middle, box.bottom + 36, x_label, text_anchor="middle", class_="quiet"),
            text(2, box.top - 10, y_label, class_="quiet"),
        ]
    )


def legend(left: float, top: float, entries: Sequence[tuple[Look, str]]) -> str:
    """One line per entry, downwards from a corner; `legend_size` tells the room it takes."""
    return "".join(
        look.key(left, top + 18 * row + 9) + text(left + 37, top + 18 * row + 13, content)
        for row, (look, content) in enumerate(entries)
    )


def legend_size(contents: Sequence[str]) -> tuple[float, float]:
    """Width and height of a legend in drawing units."""
    widest = max((text_width(content) for content in contents), default=0.0)
    return 37 + widest, 18.0 * len(contents)


def labels(points: Sequence[tuple[float, float]], contents: Sequence[str], bounds: Rect) -> str:
    """A label for each point where there is room, tied to it by a thin line if it is not near."""
    leaders, names = [], []
    boxes = placed_labels(points, contents, bounds)
    for (x, y), content, (box, led) in zip(points, contents, boxes, strict=True):
        if led:
            near_x = min(max(x, box.left), box.right)
            near_y = min(max(y, box.top + 3), box.bottom - 3)
            d = f"M{coordinate(x)} {coordinate(y)}L{coordinate(near_x)} {coordinate(near_y)}"
            leaders.append(element("path", class_="leader", d=d))
        # The width is an estimate; anchoring on the point's side keeps the label beside it.
        anchor, at = ("end", box.right) if box.right <= x else ("start", box.left)
        names.append(text(at, box.bottom - 4, content, text_anchor=anchor, class_="name"))
    return "".join([*leaders, *names])


def placed_labels(
    points: Sequence[tuple[float, float]], contents: Sequence[str], bounds: Rect
) -> list[tuple[Rect, bool]]:
    """A box for each point's label, clear of all points and of one another where that can be.

    Points take turns by y, then x; each tries sixteen directions at growing distances and keeps the
    first box that is free, or the one that covers least. The flag asks for a leader line.
    """
    taken = [Rect(x - 6, y - 6, 12, 12) for x, y in points]
    found: dict[int, tuple[Rect, bool]] = {}
    for index in sorted(range(len(points)), key=lambda i: (points[i][1], points[i][0], i)):
        tries = _label_boxes(points[index], text_width(contents[index]), bounds)
        costs = [sum(box.shared(other) for other in taken) for box, _ in tries]
        found[index] = tries[costs.index(min(costs))]
        taken.append(found[index][0])
    return [found[index] for index in range(len(points))]


def _label_boxes(point: tuple[float, float], width: float, bounds: Rect) -> list[tuple[Rect, bool]]:
    x, y = point
    height = FONT_PX + 3.0
    boxes = []
    for away in (8, 16, 26, 40, 58, 80, 104, 130, 160, 200):
        for across, down in _DIRECTIONS:
            left = x + across * away - width * (1 - across) / 2
            top = y + down * away - height * (1 - down) / 2
            inside = Rect(
                min(max(left, bounds.left), max(bounds.left, bounds.right - width)),
                min(max(top, bounds.top), bounds.bottom - height),
                width,
                height,
            )
            boxes.append((inside, away > TEXT_GAP_PX))
    return boxes


def _attribute(value: str | float) -> str:
    return escape(value) if isinstance(value, str) else coordinate(value)


def _glyph_width(character: str) -> float:
    """Of a wide font (DejaVu Sans), so that labels kept apart stay apart in narrower ones."""
    if unicodedata.east_asian_width(character) in "WF" or character in "mwMW%@":
        return float(FONT_PX)
    if character in "iljtfrI.,:;|!' ()[]-":
        return 5.0
    return 9.5 if character.isupper() or character in "<>=+~#_&" else 7.6


def _shape(look: Look) -> list[tuple[float, float]]:
    if look.marker == "square":
        return [(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]
    if look.marker in {"up", "down"}:
        sign = 1 if look.marker == "up" else -1
        return [(0, -1.1 * sign), (1.1, 0.9 * sign), (-1.1, 0.9 * sign)]
    if look.marker == "diamond":
        return [(0, -1.25), (1.25, 0), (0, 1.25), (-1.25, 0)]
    if look.marker == "star":
        return [_turned((1.3 if k % 2 == 0 else 0.55), 0.0, k * 36) for k in range(10)]
    bar = [(-0.4, -1.2), (0.4, -1.2), (0.4, -0.4)]
    angle = 45 if look.marker == "cross" else 0
    return [_turned(-y, x, angle + 90 * k) for k in range(4) for x, y in bar]


def _turned(up: float, right: float, degrees: float) -> tuple[float, float]:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return up * s + right * c, right * s - up * c
