"""Tables of the subject `ompl` in Markdown."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

Record = dict[str, Any]

HEAD = ("solved", "by line of sight", "loss mean", "loss max", "first path, median",
        "near the best", "near after, median", "time over budget, max")  # fmt: skip


def figures(records: Sequence[Record]) -> tuple[str, ...]:
    """One row: of OMPL's own paths, but for the column that counts those of the grid."""
    own = [record for record in records if record["length_m"] is not None]
    losses = [record["length_m"] / record["best_m"] - 1 for record in own]
    firsts = [record["first_s"] for record in own if record["first_s"] is not None]
    nears = [record["near_s"] for record in own if record["near_s"] is not None]
    over = [record["seconds"] / record["budget_s"] - 1 for record in records]
    by_grid = sum(record["status"] == "line of sight" for record in records)
    return (
        f"{len(own)} of {len(records)}",
        str(by_grid),
        _percent(losses, np.mean),
        _percent(losses, np.max),
        _milliseconds(firsts),
        f"{len(nears)}",
        _milliseconds(nears),
        _percent([max(value, 0.0) for value in over], np.max),
    )


def table(records: Sequence[Record], keys: Sequence[str]) -> str:
    """Rows by some fields of the records."""
    groups: dict[tuple[Any, ...], list[Record]] = {}
    for record in records:
        groups.setdefault(tuple(record[key] for key in keys), []).append(record)
    lines = [_line((*keys, *HEAD)), _line(["---"] * (len(keys) + len(HEAD)))]
    for group, members in sorted(groups.items()):
        shown = [f"{value:g} s" if isinstance(value, float) else str(value) for value in group]
        lines.append(_line((*shown, *figures(members))))
    return "\n".join(lines) + "\n"


def _percent(values: Sequence[float], reduce: Callable[[Sequence[float]], Any]) -> str:
    return f"{100 * float(reduce(values)):.2f} %" if values else "-"


def _milliseconds(values: Sequence[float]) -> str:
    return f"{1e3 * float(np.median(values)):.0f} ms" if values else "-"


def _line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"
