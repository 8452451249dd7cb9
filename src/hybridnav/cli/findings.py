"""What was found wrong with a graph, as lines for a person and as figures; and pages of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hybridnav._files import printable, replace_file
from hybridnav.cli.errors import UsageError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from hybridnav.graphs import Finding

SHOWN = 5
"""Cases of a kind in a summary."""


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
        lines.append(f"found      {each.count:,} {each.text}{printable(on)} ({each.kind})")
        lines += [f"           {printable(example.where)}" for example in each.examples[:SHOWN]]
        if each.count > SHOWN:
            lines.append(f"           and {each.count - SHOWN:,} more")
    return lines


def found_figures(findings: Iterable[Finding]) -> dict[str, Any]:
    """Return findings as plain values for JSON, by their kinds."""
    return {
        each.kind: {
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
        raise UsageError(f"--out: cannot write {str(out)!r}: {error.strerror}") from None
