"""Sheets of A4 that are filled from top to bottom: headings, paragraphs, tables, charts."""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.lines import Line2D

from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

WIDTH_IN, HEIGHT_IN = 8.27, 11.69
MARGIN_IN = 0.55
TEXT_PT, TABLE_PT = 9.0, 8.0
INNER_IN = WIDTH_IN - 2 * MARGIN_IN

_INK, _QUIET, _RULE = "#1a1a1a", "#57606a", "#b4bcc4"
_LEADING = 1.32
_GAP_IN = 0.09
"""Least space between two columns."""
_POINTS = 72.0
_FOOT_IN = 0.3
_LEAST_TABLE_IN = 1.2
"""Height of a table that must have room on a page; the rest may stand on the next one."""
_LAST_ROWS = 3
"""Rows at the end of a table that are not parted."""
_LEAST_WORDS_IN = 0.6
_TOO_MANY = 100


class Sheets:
    """Pages that are filled in the order of the calls.

    Parameters
    ----------
    foot
        Line at the foot of each page, before its number.
    """

    def __init__(self, foot: str) -> None:
        self.pages: list[Figure] = []
        self._foot = foot
        self._y_in = 0.0
        self._new_page()

    def heading(self, text: str, size_pt: float = 12.0) -> None:
        """Set a heading, which never stands last on a page."""
        self._need(4 * size_pt * _LEADING / _POINTS)
        self._y_in -= 0.6 * size_pt / _POINTS
        self._line(text, MARGIN_IN, size_pt, weight="bold")
        self._y_in -= 0.3 * size_pt / _POINTS

    def paragraph(self, text: str) -> None:
        """Set a paragraph, broken into lines."""
        for line in wrapped(text, INNER_IN, TEXT_PT):
            self._need(TEXT_PT * _LEADING / _POINTS)
            self._line(line, MARGIN_IN, TEXT_PT)
        self._y_in -= 0.4 * TEXT_PT / _POINTS

    def table(
        self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], note: str = ""
    ) -> None:
        """Set a table, the title bold above it; a long one goes on on the next page.

        The first column is aligned to the left, and so are columns of words; a column of words is
        broken into lines where the table is too wide.

        Raises
        ------
        InvalidValueError
            When its columns do not fit beside each other.
        """
        set_ = _Setting(columns, rows)
        whole_in = set_.height_in()
        least_in = whole_in if len(set_.rows) <= _LAST_ROWS else min(whole_in, _LEAST_TABLE_IN)
        self._need(least_in + 0.5)
        self._y_in -= 0.06
        self._line(title, MARGIN_IN, TEXT_PT, weight="bold")
        if note:
            for line in wrapped(note, INNER_IN, TABLE_PT):
                self._line(line, MARGIN_IN, TABLE_PT, colour=_QUIET)
        self._y_in -= 0.04
        self._head(set_)
        last = max(len(set_.rows) - _LAST_ROWS, 0)
        for at, row in enumerate(set_.rows):
            # The last rows go on together: one alone on the next page looks like a mistake.
            together = set_.rows[at:] if at == last else [row]
            if self._y_in - set_.height_of(together) < MARGIN_IN + _FOOT_IN:
                self._new_page()
                self._head(set_)
            self._row(set_, row, weight="normal")
        self._rule(set_)
        self._y_in -= 0.12

    def chart(self, draw: Callable[[Axes], object], height_in: float, caption: str) -> None:
        """Draw a chart into a part of the page; its legend stands right of the axes."""
        lines = wrapped(caption, INNER_IN, TABLE_PT)
        under_in = 0.55
        self._need(height_in + under_in + len(lines) * TABLE_PT * _LEADING / _POINTS)
        self._y_in -= 0.12
        bottom_in = self._y_in - height_in
        box = (
            (MARGIN_IN + 0.55) / WIDTH_IN,
            bottom_in / HEIGHT_IN,
            0.56 * INNER_IN / WIDTH_IN,
            height_in / HEIGHT_IN,
        )
        draw(self.pages[-1].add_axes(box))
        self._y_in = bottom_in - under_in
        for line in lines:
            self._line(line, MARGIN_IN, TABLE_PT, colour=_QUIET)
        self._y_in -= 0.1

    def save(self, path: Path, title: str) -> None:
        """Write the pages as a PDF, with equal bytes for equal pages."""
        for number, page in enumerate(self.pages, start=1):
            text = f"{self._foot} \u00b7 {number} of {len(self.pages)}"
            page.text(
                0.5, MARGIN_IN / 2 / HEIGHT_IN, text, size=TABLE_PT, ha="center", color=_QUIET
            )
        about = {"Title": title, "CreationDate": None}
        with mpl.rc_context({"pdf.fonttype": 42}), PdfPages(path, metadata=about) as pages:
            for page in self.pages:
                pages.savefig(page)

    def _head(self, set_: _Setting) -> None:
        self._rule(set_)
        self._row(set_, set_.head, weight="bold")
        self._rule(set_)

    def _row(self, set_: _Setting, row: Sequence[list[str]], weight: str) -> None:
        """Set one row, the lines of its cells from the top."""
        top_in, step_in = self._y_in, TABLE_PT * _LEADING / _POINTS
        deepest = set_.lines(row)
        for left_in, width_in, words, lines in zip(
            set_.lefts_in, set_.widths_in, set_.is_words, row, strict=True
        ):
            skip = deepest - len(lines) if weight == "bold" else 0
            for at, line in enumerate(lines):
                y_in = top_in - (at + skip) * step_in
                x_in = left_in if words else left_in + width_in
                self._text(line, x_in, y_in, "left" if words else "right", weight)
        self._y_in = top_in - deepest * step_in

    def _text(self, line: str, x_in: float, y_in: float, side: str, weight: str) -> None:
        self.pages[-1].text(
            x_in / WIDTH_IN,
            (y_in - TABLE_PT / _POINTS) / HEIGHT_IN,
            line,
            size=TABLE_PT,
            ha=side,
            weight=weight,
            color=_INK,
            parse_math=False,
        )

    def _rule(self, set_: _Setting) -> None:
        y = (self._y_in - 0.02) / HEIGHT_IN
        ends = (MARGIN_IN / WIDTH_IN, (set_.lefts_in[-1] + set_.widths_in[-1]) / WIDTH_IN)
        self.pages[-1].add_artist(Line2D(ends, (y, y), color=_RULE, linewidth=0.6))
        self._y_in -= 0.045

    def _line(
        self, text: str, x_in: float, size_pt: float, *, weight: str = "normal", colour: str = _INK
    ) -> None:
        self._y_in -= size_pt * _LEADING / _POINTS
        self.pages[-1].text(
            x_in / WIDTH_IN,
            self._y_in / HEIGHT_IN,
            text,
            size=size_pt,
            weight=weight,
            color=colour,
            parse_math=False,
        )

    def _need(self, height_in: float) -> None:
        if self._y_in - height_in < MARGIN_IN + _FOOT_IN:
            self._new_page()

    def _new_page(self) -> None:
        self.pages.append(Figure(figsize=(WIDTH_IN, HEIGHT_IN)))
        self._y_in = HEIGHT_IN - MARGIN_IN


class _Setting:
    """A table with the widths of its columns, and its cells broken into lines."""

    def __init__(self, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        cells = list(zip(*rows, strict=True)) if rows else [() for _ in columns]
        self.is_words = [at == 0 or not all(map(_is_number, own)) for at, own in enumerate(cells)]
        room_in = INNER_IN - _GAP_IN * (len(columns) - 1)
        widths = self._widths(columns, cells, lines=2)
        if sum(widths) > room_in:
            widths = self._widths(columns, cells, lines=9)
        over_in = sum(widths) - room_in
        while over_in > 1e-6:
            words = [at for at, is_words in enumerate(self.is_words) if is_words]
            widest = max(words, key=lambda at: widths[at])
            less_in = min(over_in, 0.05)
            widths[widest] -= less_in
            over_in -= less_in
            if widths[widest] < _LEAST_WORDS_IN:
                raise InvalidValueError(f"a table of {', '.join(columns)} does not fit a page")
        spare_in = max(0.0, room_in - sum(widths)) / max(len(columns) - 1, 1)
        gap_in = _GAP_IN + min(spare_in, 0.25)
        self.widths_in = widths
        self.lefts_in = [MARGIN_IN + sum(widths[:at]) + gap_in * at for at in range(len(columns))]
        self.head = [
            wrapped(head, width, TABLE_PT, "bold")
            for head, width in zip(columns, widths, strict=True)
        ]
        self.rows = [
            [wrapped(cell, width, TABLE_PT) for cell, width in zip(row, widths, strict=True)]
            for row in rows
        ]

    @staticmethod
    def _widths(
        columns: Sequence[str], cells: Sequence[Sequence[str]], *, lines: int
    ) -> list[float]:
        """Return the widths of columns whose headings have at most so many lines."""
        return [
            max([_width_of_head(head, lines), *(width_of(cell, TABLE_PT) for cell in own)])
            for head, own in zip(columns, cells, strict=True)
        ]

    def lines(self, row: Sequence[list[str]]) -> int:
        """Return the number of lines of a row."""
        return max(map(len, row))

    def height_in(self) -> float:
        """Return the height of the table."""
        return self.height_of([self.head, *self.rows]) + 0.2

    def height_of(self, rows: Sequence[Sequence[list[str]]]) -> float:
        """Return the height of some rows."""
        return sum(map(self.lines, rows)) * TABLE_PT * _LEADING / _POINTS


def _is_number(cell: str) -> bool:
    """Return whether a cell belongs into a column of numbers, which are aligned to the right."""
    return cell in {"", "never"} or cell.lstrip("-<> ")[:1].isdigit()


def _width_of_head(head: str, lines: int) -> float:
    """Return the least width at which a heading has at most so many lines."""
    words = head.split(" ")
    parts = [
        " ".join(words[first:last])
        for first in range(len(words))
        for last in range(first + 1, len(words) + 1)
    ]
    widths = sorted(width_of(part, TABLE_PT, "bold") for part in parts)
    return next(width for width in widths if len(_lines_of(head, width)) <= lines)


def _lines_of(head: str, width_in: float) -> list[str]:
    """Return a heading as lines, more than any table has where a word is wider."""
    if max(width_of(word, TABLE_PT, "bold") for word in head.split(" ")) > width_in + 1e-6:
        return [head] * _TOO_MANY
    return wrapped(head, width_in, TABLE_PT, "bold")


def wrapped(text: str, width_in: float, size_pt: float, weight: str = "normal") -> list[str]:
    """Return a text as lines of a width; a word that is wider is broken where it has to be."""
    lines = [""]
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}".strip()
        if width_of(longer, size_pt, weight) <= width_in + 1e-6:
            lines[-1] = longer
            continue
        if lines[-1]:
            lines.append("")
        for letter in word:
            if width_of(lines[-1] + letter, size_pt, weight) > width_in + 1e-6 and lines[-1]:
                lines.append("")
            lines[-1] += letter
    return lines


@functools.cache
def width_of(text: str, size_pt: float, weight: str = "normal") -> float:
    """Return the width of a text in inches."""
    font = get_font(findfont(FontProperties(weight=weight)))
    font.set_size(size_pt, _POINTS)
    font.set_text(text)
    width, _ = font.get_width_height()
    return float(width) / 64 / _POINTS
