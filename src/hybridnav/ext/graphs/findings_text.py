"""What was found wrong with a graph, as lines for a person and as figures; and pages of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from hybridnav._base.files import printable, replace_file
from hybridnav.cli.common import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from hybridnav.ext.graphs import Finding

SHOWN = 5
"""Cases of a kind in a summary."""
FAIL_ON = "warning"
_LEVELS = ("error", "warning", "note", "never")

FailOnOption = Annotated[
    str,
    typer.Option(
        "--fail-on",
        metavar="LEVEL",
        help="Exit with 1 from findings of this level on: error, warning, note; never: exit with 0 "
        "whatever is found.",
    ),
]


def check_level(level: str) -> None:
    """Refuse a level that is none."""
    if level not in _LEVELS:
        raise UsageError(f"--fail-on must be one of {', '.join(_LEVELS)}, got {level!r:.80}")


def fails(findings: Iterable[Finding], level: str) -> bool:
    """Return whether a finding is as bad as a level, or worse."""
    return any(_LEVELS.index(each.severity) <= _LEVELS.index(level) for each in findings) and (
        level != "never"
    )


def count_line(findings: Iterable[Finding]) -> str:
    """Return the line that counts cases of errors, warnings and notes."""
    counts = dict.fromkeys(_LEVELS, 0)
    for each in findings:
        counts[each.severity] += each.count
    words = [f"{n:,} {level}{'s' * (n != 1)}" for level, n in counts.items() if n]
    return f"found      {', '.join(words) or 'nothing'}"


def found_lines(findings: Iterable[Finding], on: str = "") -> list[str]:
    """Return lines on findings, each with its first cases.

    Parameters
    ----------
    findings
        The findings.
    on
        Where all of them are, such as " on floor 2".
    """
    lines = []
    for each in findings:
        what = f"{each.count:,} {each.text}{printable(on)} ({each.kind})"
        lines.append(f"{each.severity:<10} {what}")
        lines += [f"           {printable(example.where)}" for example in each.examples[:SHOWN]]
        if each.count > SHOWN:
            lines.append(f"           and {each.count - SHOWN:,} more")
    return lines


def found_figures(findings: Iterable[Finding]) -> dict[str, Any]:
    """Return findings as plain values for JSON, by their kinds."""
    return {
        each.kind: {
            "severity": each.severity,
            "count": each.count,
            "text": each.text,
            "cases": [
                {"where": example.where, "points": example.points} for example in each.examples
            ],
        }
        for each in findings
    }


def write_page(page: str, out: Path) -> None:
    """Write a page on what was found."""
    try:
        replace_file(out, page.encode())
    except OSError as error:
        raise UsageError(f"--out: cannot write '{printable(out)}': {error.strerror}") from None
