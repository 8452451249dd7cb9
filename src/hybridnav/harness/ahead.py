"""Sentences on where another method is ahead of every preset of a run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from hybridnav.harness.columns import shown
from hybridnav.harness.tables import text_of

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from hybridnav.harness.tables import Row

_LOWER = ("mean %", "p95 %", "max %", "query ms, median", "query ms, p95", "preparation s")
_HIGHER = ("solved %", "speed-up of means")
_MOST_NAMES = 4
_ALIKE = 0.005


def ahead_of_presets(rows: Sequence[Row], columns: Sequence[str], presets: Collection[str]) -> str:
    """Return a sentence on the methods that are ahead of every preset in some column of a table.

    Methods with a contradiction are not: what they found is no path. Figures that differ by less
    than half a per cent are equal.

    Parameters
    ----------
    rows
        Rows of the table, with `method` and `faults`.
    columns
        Columns of the table.
    presets
        Methods that are presets.

    Returns
    -------
    str
        Empty if the table holds no preset, or nothing else.
    """
    own = [row for row in rows if row["method"] in presets]
    n_maps = max((row.get("maps", 1) for row in rows), default=1)
    others = [
        row
        for row in rows
        if row["method"] not in presets
        and not row.get("faults")
        and row.get("maps", 1) == n_maps  # not of the easier maps alone
    ]
    sign_of = dict.fromkeys(_LOWER, 1) | dict.fromkeys(_HIGHER, -1)
    judged = {column: sign_of[shown(column)] for column in columns if shown(column) in sign_of}
    if not own or not others or not judged:
        return ""
    found = [
        part for column, sign in judged.items() if (part := _ahead_in(column, sign, own, others))
    ]
    if not found:
        return "No other method is ahead of every preset here."
    return f"Ahead of every preset here: {'; '.join(found)}."


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
