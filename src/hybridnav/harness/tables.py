"""Tables: CSV for machines, Markdown for pages, texts of numbers for people."""

from __future__ import annotations

import csv
import io
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence

Row = dict[str, str | float]

_DIGITS = 3
_LEAST = 1e-4


def to_csv(rows: Sequence[Row]) -> str:
    """Return rows as CSV, numbers in full."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    out = io.StringIO()
    writer = csv.DictWriter(out, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: _blank(value) for key, value in row.items()} for row in rows)
    return out.getvalue()


def _blank(value: str | float) -> str | float:
    return "" if isinstance(value, float) and math.isnan(value) else value


def to_markdown(rows: Sequence[Row], columns: Sequence[str] | None = None) -> str:
    """Return rows as a table in Markdown, numbers rounded to three digits."""
    columns = (
        list(dict.fromkeys(key for row in rows for key in row)) if columns is None else columns
    )
    lines = [f"| {' | '.join(columns)} |", f"|{'---|' * len(columns)}"]
    for row in rows:
        cells = (text_of(row.get(column, "")) for column in columns)
        lines.append(f"| {' | '.join(cells)} |")
    return "".join(f"{line}\n" for line in lines)


def text_of(value: str | float) -> str:
    """Return a value as text for people: three digits, thousands separated, an empty text for no
    value."""
    if isinstance(value, (str, int)):
        return value.replace("|", "\\|") if isinstance(value, str) else f"{value:,}"
    if math.isnan(value):
        return ""
    if math.isinf(value):
        return "never"
    if 0 < abs(value) < _LEAST:
        return f"< {_LEAST:.4f}" if value > 0 else f"> -{_LEAST:.4f}"
    if value == 0 or abs(value) >= 10**_DIGITS / 10:
        return f"{value:,.0f}"
    digits = max(0, _DIGITS - 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{min(digits, 4)}f}"
