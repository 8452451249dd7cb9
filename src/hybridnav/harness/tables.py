"""Tables: CSV for machines, Markdown, HTML, LaTeX and plain text for people."""

import csv
import io
import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from hybridnav.errors import InvalidValueError, brief
from hybridnav.harness.yardstick import OPTIMA, REGIONS

Row = dict[str, str | float]

METHOD_COLUMNS = {
    "kind": "what the method is: a preset of this package, a baseline of it, a planner of others, "
    "a class, or a graph",
    "version": "version of the package that plans, or the hash of the file of a class",
    "settings": "settings that differ from the usual ones",
    "not asked": "maps that the method cannot take by a limit of its own, and the reason; they are "
    "no fault, and it is in no table of theirs",
}
"""Columns of the table of methods, and their meaning."""

_WORDS = ("method", "map", "metric", *METHOD_COLUMNS)
"""Columns that hold no numbers."""
_LOWER = ("mean %", "p95 %", "max %", "query ms, median", "query ms, p95", "preparation s")
_HIGHER = ("solved %", "speed-up of means")
_MOST_NAMES = 4
_ALIKE = 0.005
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


def to_markdown(rows: Sequence[Row]) -> str:
    """Return rows as a table in Markdown, numbers rounded to three digits."""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    return markdown_of(columns, [[text_of(row.get(c, "")) for c in columns] for row in rows])


def markdown_of(columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return texts as a table in Markdown."""
    columns = list(columns)
    lines = [f"| {' | '.join(cells)} |\n" for cells in (columns, *rows)]
    return "".join([lines[0], f"|{'---|' * len(columns)}\n", *lines[1:]])


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


@dataclass(frozen=True)
class Table:
    """A table of texts."""

    columns: list[str]
    rows: list[list[str]]
    caption: str
    numeric: frozenset[int] = frozenset()
    """Indices of the columns that are aligned to the right."""
    note: str = ""
    """A sentence below it."""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise InvalidValueError(
                    f"table {brief(self.caption)}: a row has {len(row)} cells, "
                    f"expected {len(self.columns)}"
                )

    def __str__(self) -> str:
        """Return aligned columns, and the caption below them."""
        lines = [self.columns, *self.rows]
        widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
        texts = (
            "  ".join(
                cell.rjust(width) if at in self.numeric else cell.ljust(width)
                for at, (cell, width) in enumerate(zip(line, widths, strict=True))
            ).rstrip()
            for line in lines
        )
        return "\n".join([*texts, self.caption])


_LATEX = {c: f"\\{c}" for c in "&%$#_{}"} | {
    "\\": r"\textbackslash{}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"\textless{}",
    ">": r"\textgreater{}",
}
"""What LaTeX takes for commands, or prints as something else."""


def latex_of(table: Table) -> str:
    """Return a table for LaTeX with rules of booktabs, every character as it is."""
    lines = [
        " & ".join("".join(_LATEX.get(c, c) for c in cell) for cell in line) + r" \\"
        for line in (table.columns, *table.rows)
    ]
    align = "".join("r" if at in table.numeric else "l" for at in range(len(table.columns)))
    head, *body = lines
    rows = [r"\toprule", head, r"\midrule", *body, r"\bottomrule"]
    return "\n".join([rf"\begin{{tabular}}{{{align}}}", *rows, r"\end{tabular}", ""])


def table_of(rows: Sequence[Row], columns: Iterable[str], caption: str, note: str = "") -> Table:
    """Return a table without columns that are empty."""
    kept = ["method", *(column for column in columns if with_values(rows, column))]
    return Table(
        columns=[shown(column) for column in kept],
        rows=[[text_of(row.get(column, "")) for column in kept] for row in rows],
        caption=caption,
        numeric=frozenset(at for at, column in enumerate(kept) if column not in _WORDS),
        note=note,
    )


def with_values(rows: Sequence[Row], column: str) -> list[Row]:
    """Return the rows that have a value in a column."""
    return [row for row in rows if text_of(row.get(column, "")) != ""]


def shown(column: str) -> str:
    """Return the heading of a column in a table whose caption names the optimum."""
    for optimum in OPTIMA:
        column = column.removeprefix(f"{optimum} loss ")
    return column


def ahead_of_presets(rows: Sequence[Row], columns: Iterable[str], presets: Collection[str]) -> str:
    """Return a sentence on the methods that are ahead of every preset in some column of a table.

    Methods with a contradiction are not, and methods without paths. Figures that differ by less
    than half a per cent are equal.

    `rows`: rows of the table, with `method` and `faults`; `presets`: methods that are presets.
    Result: empty if the table holds no preset, or nothing else.
    """
    own = [row for row in rows if row["method"] in presets]
    n_maps = max((row.get("maps", 1) for row in rows), default=1)
    others = [
        row
        for row in rows
        if row["method"] not in presets
        and not row.get("faults")
        and row.get("metric") != REGIONS
        and row.get("maps", 1) == n_maps  # not of the easier maps alone
    ]
    sign_of = dict.fromkeys(_LOWER, 1) | dict.fromkeys(_HIGHER, -1)
    judged = {column: sign_of[shown(column)] for column in columns if shown(column) in sign_of}
    if not own or not others or not judged:
        return ""
    ahead = [
        part for column, sign in judged.items() if (part := _ahead_in(column, sign, own, others))
    ]
    if not ahead:
        return "No other method is ahead of every preset here."
    return f"Ahead of every preset here: {'; '.join(ahead)}."


def _ahead_in(column: str, sign: int, own: Sequence[Row], others: Sequence[Row]) -> str:
    """Return the methods that are ahead in one column, the best first."""
    best = min((row for row in own if _has(row, column)), key=_by(column, sign), default=None)
    if best is None:
        return ""
    better = [
        row
        for row in others
        if _has(row, column)
        and _by(column, sign)(row) < _by(column, sign)(best)
        and not math.isclose(float(row[column]), float(best[column]), rel_tol=_ALIKE)
    ]
    better.sort(key=_by(column, sign))
    if not better:
        return ""
    names = [f"{row['method']} ({text_of(row[column])})" for row in better[:_MOST_NAMES]]
    more = len(better) - len(names)
    names += [f"{more} more"] if more else []
    against = f"{text_of(best[column])} of {best['method']}"
    return f'in "{shown(column)}" {", ".join(names)}, against {against}'


def _by(column: str, sign: int) -> Any:
    return lambda row: sign * float(row[column])


def _has(row: Row, column: str) -> bool:
    value = row.get(column, "")
    return isinstance(value, (int, float)) and math.isfinite(value)
