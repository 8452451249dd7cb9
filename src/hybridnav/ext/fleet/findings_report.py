"""What was found wrong with a graph: as lines, as figures, and as a page with pictures."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import resources
from typing import TYPE_CHECKING, Annotated, Any, get_args

from hybridnav._base.files import printable
from hybridnav.cli.common import UsageError
from hybridnav.cli.options import option

if TYPE_CHECKING:
    from hybridnav.ext.fleet import BuildingGraphCheck, BuildingGraphReport
    from hybridnav.graphs import Finding, GraphCheck

SHOWN = 5
"""Cases of a kind in a summary."""
FAIL_ON = "warning"
_LEVELS = ("error", "warning", "note", "never")

FailOnOption = Annotated[
    str,
    option(
        "--fail-on LEVEL",
        "Exit with 1 from findings of this level on: error, warning, note; never: exit with 0 "
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

    `on`: where all of them are, such as " on floor 2".
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


# The page on a graph that was checked, in one HTML text.

_SHOWN = 100
"""Cases of a kind on the page; JSON has up to 1,000."""
_WIDTH_IN, _DPI = 10.0, 160.0


def check_facts(check: GraphCheck) -> list[tuple[str, str]]:
    """Return the figures of a check, each with its name."""
    grid, graph = check.grid, check.graph
    clear, free = int(check.is_clear.sum()), int(check.is_free.sum())
    frame = f", frame {graph.frame}" if graph.frame else ""
    facts = [
        ("graph", f"{graph.name}, {graph.format}{frame}"),
        ("map", f"{grid.name}, robot radius {grid.robot_radius_m:g} m"),
        ("nodes", f"{graph.n_nodes:,}, the robot fits at {free:,}"),
        ("edges", f"{graph.n_edges:,}, the robot can follow {clear:,}"),
        ("in sight", f"{check.in_sight:.1%} of free points see a node"),
    ]
    if check.rooms[1]:
        facts.append(("doors", "{} of {} are passed".format(*check.doors)))
        facts.append(("rooms", "{} of {} have a node".format(*check.rooms)))
    return facts


def building_facts(
    check: BuildingGraphCheck, report: BuildingGraphReport | None
) -> list[tuple[str, str]]:
    """Return the figures of the check of a building's graph, each with its name.

    `report`: what came of its routes; None if they were not compared.
    """
    matched, building = check.matched, check.matched.building
    n_links = sum(link.own is not None for link in matched.links)
    of_all = f"{len(check.floors)} of {len(building.floors)} floors"
    facts = [
        ("graph", f"{matched.name}, {of_all}, {n_links} of {len(building.links)} links"),
        ("building", f"robot radius {building.robot_radius_m:g} m"),
    ]
    for name, floor in check.floors.items():
        graph = floor.graph
        text = (
            f"{graph.n_nodes:,} nodes, the robot fits at {int(floor.is_free.sum()):,}; "
            f"{graph.n_edges:,} edges, it can follow {int(floor.is_clear.sum()):,}; "
            f"{floor.in_sight:.1%} of free points see a node"
        )
        if floor.rooms[1]:
            text += "; {} of {} doors, {} of {} rooms".format(*floor.doors, *floor.rooms)
        facts.append((f"floor {name}", text))
    for name, counts in ({} if report is None else report.counts).items():
        answers = ", ".join(f"{number:,} {answer}" for answer, number in counts.answers.items())
        facts.append((name, f"{counts.pairs:,} pairs: {answers}"))
        if counts.loss is not None:
            loss = counts.loss
            figures = f"mean {loss.mean:.2%}, p95 {loss.p95:.2%}, at most {loss.greatest:.2%}"
            facts.append(("", f"loss: {figures}"))
    return facts


def render_check(check: GraphCheck) -> str:
    """Return the page on a check as one HTML text without references to other files.

    `check`: what to show. Returns an HTML document, to be written as UTF-8.
    """
    heading = "Findings" if check.findings else "Nothing is wrong"
    part = {"heading": heading, "findings": check.findings, "picture": _picture(check, None)}
    title = f"{check.graph.name} on {check.grid.name}"
    return _page(title, check_facts(check), [part])


def render_building_check(check: BuildingGraphCheck, report: BuildingGraphReport | None) -> str:
    """Return the page on the graph of a building, with a table of its routes, and a picture of each
    floor.

    `check`: what to show; `report`: what came of its routes; None if they were not compared.
    Returns an HTML document, to be written as UTF-8.
    """
    parts = [_part("The whole graph", check.findings)]
    parts += [
        _part(f"Floor {name}", floor.findings) | {"picture": _picture(floor, f"floor {name}")}
        for name, floor in check.floors.items()
    ]
    rows = None if report is None else _rows(report)
    lines = () if report is None else report.contradictions
    facts = building_facts(check, None)
    return _page(f"{check.matched.name}: the graph of a building", facts, parts, rows, lines)


def _part(name: str, findings: tuple[Finding, ...]) -> dict[str, Any]:
    heading = name if findings else f"{name}: nothing is wrong"
    return {"heading": heading, "findings": findings, "picture": None}


def _rows(report: BuildingGraphReport) -> list[list[str]]:
    """Return the table of routes, its heads first."""
    from hybridnav.ext.fleet.graph_match import Answer  # noqa: PLC0415 - buildings alone need it

    answers = get_args(Answer)
    heads = [*answers, "loss mean", "p95", "most", "steps", "expanded", "graph, ms", "building, ms"]
    rows = [["", "pairs", *heads]]
    for name, counts in report.counts.items():
        loss = counts.loss
        losses = (
            [""] * 3 if loss is None else [f"{x:.2%}" for x in (loss.mean, loss.p95, loss.greatest)]
        )
        times = [f"{1e3 * seconds:.2f}" for seconds in counts.seconds]
        effort = [f"{counts.steps:.1f}", f"{counts.expanded:.0f}", *times]
        numbers = [f"{counts.answers.get(answer, 0):,}" for answer in answers]
        rows.append([name, f"{counts.pairs:,}", *numbers, *losses, *effort])
    return rows


def _picture(check: GraphCheck, title: str | None) -> str:
    from hybridnav.graphs import plot_graph_check  # noqa: PLC0415 - loads matplotlib
    from hybridnav.viz.canvas import picture_bytes, png_uri  # noqa: PLC0415

    axes = plot_graph_check(check, width_in=_WIDTH_IN, title=title)
    return png_uri(picture_bytes(axes, ".png", dpi=_DPI))


def _page(
    title: str,
    facts: list[tuple[str, str]],
    parts: list[dict[str, Any]],
    rows: list[list[str]] | None = None,
    lines: tuple[str, ...] = (),
) -> str:
    from hybridnav.harness.report import page_template  # noqa: PLC0415 - loads matplotlib

    source = resources.files("hybridnav.ext.fleet").joinpath("check.html.j2")
    return page_template(source.read_text(encoding="utf-8")).render(
        title=title, facts=facts, parts=parts, rows=rows, lines=lines, most=_SHOWN
    )
