"""Consistency as a table: contradictions of a method by kind, beside the number of checks.

S. Thrun: Learning metric-topological maps for indoor mobile robot navigation, Artificial
Intelligence 99(1), 1998.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from hybridnav.harness.contradictions import ANSWERED, KINDS, contradiction, kind_of_contradiction
from hybridnav.harness.outcome import query_key

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav.harness.contradictions import Kind
    from hybridnav.harness.outcome import Outcome
    from hybridnav.harness.records import Record
    from hybridnav.harness.tables import Row

RIGHTLY, WRONGLY = '"no path", right', '"no path", wrong'
CONSISTENCY_COLUMNS = (
    "regions",
    "plan to path",
    "path to plan",
    "paths",
    RIGHTLY,
    WRONGLY,
    "bounds",
    "without an answer",
)
"""Columns of the table of consistency."""

DEFINITION = (
    "Two layers are consistent when each path of one has its counterpart in the other (S. Thrun: "
    "Learning metric-topological maps for indoor mobile robot navigation, Artificial Intelligence "
    "99(1), 1998, pages 21-71): every plan over regions has a metric path inside them, every "
    "metric path maps to a walk over regions, and both agree on whether there is a path. "
    "Connectivity is computed by scipy, not by the planners. Beside these the harness checks that "
    "paths are paths and that bounds hold. A cell reads: contradictions of checks; it is empty "
    "where nothing was to check."
)
"""What the table of consistency holds."""


def consistency_row(outcomes: Sequence[Outcome]) -> Row:
    """Return the contradictions of one method on some maps, by kind.

    Parameters
    ----------
    outcomes
        Outcomes of the method, one for each map.

    Returns
    -------
    dict
        By column: for each kind a text "WRONG of CHECKED", empty where nothing was checked, and
        both numbers as "KIND wrong" and "KIND checked". A record with several contradictions of a
        kind counts once.
    """
    wrong: Counter[Kind] = Counter()
    checked: Counter[Kind] = Counter()
    rightly = 0
    for outcome in outcomes:
        for record in (outcome.preparation, *outcome.records):
            reference = outcome.optimum.get(query_key(record)) if "start" in record else None
            found = kinds_of(record, reference)
            wrong.update(found)
            checked.update(_checked(record, reference) | found)
            rightly += record["status"] == "no path" and "no path" not in found
    row: Row = {}
    for kind in KINDS:
        row[WRONGLY if kind == "no path" else kind] = _share(wrong[kind], checked[kind])
        row[f"{kind} wrong"], row[f"{kind} checked"] = wrong[kind], checked[kind]
    row[RIGHTLY] = rightly
    row["without an answer"] = sum(outcome.failures for outcome in outcomes)
    return row


def kinds_of(record: Record, reference: Record | None) -> set[Kind]:
    """Return the kinds of contradictions of a record, by the judge and by the optima."""
    kinds: set[Kind] = set(record.get("fault_kinds", ()))
    if record.get("faults") and not kinds:  # of a preparation, or of an older version
        kinds.add("regions" if record["type"] == "preparation" else "paths")
    text = None if reference is None else contradiction(record, reference)
    return kinds if text is None else kinds | {kind_of_contradiction(text)}


def _checked(record: Record, reference: Record | None) -> set[Kind]:
    kinds: set[Kind] = set(record.get("checked", ()))
    if record["type"] == "pair" and record["status"] in ANSWERED:
        if record["status"] == "solved":
            kinds.add("paths")
        if reference is not None and reference["status"] in ANSWERED:
            kinds.add("no path")
            if record["status"] == reference["status"] == "solved":
                kinds.add("bounds")
    return kinds


def _share(wrong: int, checked: int) -> str:
    return f"{wrong:,} of {checked:,}" if checked else ""
