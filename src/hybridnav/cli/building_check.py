"""`hybridnav check` for the graph of a building of several floors."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav.cli.building import BuildingSource
from hybridnav.cli.common import answer, stage, timings
from hybridnav.cli.errors import UsageError
from hybridnav.cli.findings import (
    SHOWN,
    count_line,
    fails,
    found_figures,
    found_lines,
    write_page,
)

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    from hybridnav.building import BuildingGraphCheck, BuildingGraphReport
    from hybridnav.graphs import Finding

CHECK_OPTIONS = frozenset(
    {
        *(
            "map_file",
            "graph_file",
            "out",
            "ignore",
            "fail_on",
            "preset",
            "robot_radius_m",
            "max_cells",
        ),
        *("align", "match", "pairs", "no_stairs", "as_json"),
    }
)
"""Parameters of `hybridnav check` that mean something for a building."""
ONLY_BUILDINGS = frozenset({"align", "match", "pairs", "no_stairs"})
"""Those that mean nothing for one map."""

AlignOption = Annotated[
    bool,
    typer.Option(
        "--align",
        help="For a building: move the floors of the graph so that its links stop where those of "
        "the building do.",
    ),
]
MatchOption = Annotated[
    list[str] | None,
    typer.Option(
        "--match",
        metavar="NAME=FLOOR",
        help="For a building: the graph calls FLOOR otherwise; may be given several times.",
    ),
]
PairsOption = Annotated[
    int,
    typer.Option(
        "--pairs",
        metavar="N",
        min=0,
        max=1_000_000,
        help="For a building: pairs of points whose routes are compared.",
    ),
]
NoStairsOption = Annotated[
    bool, typer.Option("--no-stairs", help="For a building: the robot takes no stairs.")
]


@dataclass(frozen=True)
class BuildingOptions:
    """What `hybridnav check` takes for buildings alone."""

    align: bool
    match: Sequence[str]
    pairs: int
    stairs: bool


def check_building(given: Mapping[str, Any], how: BuildingOptions) -> bool:
    """Check the graph of a building, print a summary, and return whether that is a failure.

    Parameters
    ----------
    given
        The values of the parameters of `hybridnav check` by their names.
    how
        Those for buildings alone.
    """
    from hybridnav.building import (  # noqa: PLC0415 - on demand
        check_building_graph,
        judge_building_graph,
        match_graph,
    )
    from hybridnav.building.floor_graphs import SAME_POINT_M  # noqa: PLC0415

    seconds: dict[str, float] = {}
    file = given["graph_file"]
    names = _names_of(how.match)
    with stage(f"reading {file}", seconds, "graph"):
        graph = hn.load_building_graph(file)
    building = BuildingSource.of({**given, "overrides": ()}).load(seconds)
    with stage("checking", seconds, "check"):
        matched = match_graph(building, graph, floors=names, align=how.align)
        found = check_building_graph(matched)
    report = None
    if how.pairs:
        with stage("comparing routes", seconds, "routes"):
            report = judge_building_graph(matched, pairs=how.pairs, stairs=how.stairs)
    ignored = given["ignore"] or ()
    if given["as_json"]:
        figures = _figures(found, report, ignored) | {"seconds": seconds}
        answer(json.dumps(figures, allow_nan=False) + "\n")
    else:
        lines = _summary(found, report, ignored)
        if not how.align and matched.away_m > SAME_POINT_M:
            away = f"links stop up to {matched.away_m:.2f} m from those of the building"
            lines.append(f"hint       {away}: --align, if floors have other frames than their maps")
        lines.append(f"seconds    {timings(seconds)}")
        answer("\n".join(lines) + "\n")
    if given["out"] is not None:
        from hybridnav.harness.check_page import render_building_check  # noqa: PLC0415 - on demand

        write_page(render_building_check(found, report), given["out"])
    # An answer that the building contradicts is an error.
    is_refuted = report is not None and bool(report.contradictions)
    level = given["fail_on"]
    return (is_refuted and level != "never") or fails(_all(_wrong(found, ignored)), level)


def _names_of(texts: Sequence[str]) -> dict[str, str]:
    """Return the building's name of floors, by the graph's."""
    names = {}
    for text in texts:
        name, equals, own = text.rpartition("=")
        if not equals or not name or not own:
            raise UsageError(f"--match must be NAME=FLOOR, got {text!r:.80}")
        if name in names:
            raise UsageError(f"--match has floor {name!r:.80} of the graph twice, expected once")
        names[name] = own
    return names


def _wrong(found: BuildingGraphCheck, ignored: Collection[str]) -> dict[str, list[Finding]]:
    """Return the findings that count, by the name of their floor; those of the whole by ""."""
    whole = {"": found.findings} | {name: one.findings for name, one in found.floors.items()}
    return {
        name: [each for each in findings if each.kind not in ignored]
        for name, findings in whole.items()
    }


def _all(wrong: Mapping[str, list[Finding]]) -> list[Finding]:
    return [each for findings in wrong.values() for each in findings]


def _summary(
    found: BuildingGraphCheck, report: BuildingGraphReport | None, ignored: Collection[str]
) -> list[str]:
    from hybridnav.harness.check_page import building_facts  # noqa: PLC0415 - on demand

    lines = [f"{name:<10} {_line(text)}" for name, text in building_facts(found, report)]
    wrong = _wrong(found, ignored)
    lines.append(count_line(_all(wrong)))
    for name, findings in wrong.items():
        lines += found_lines(findings, f" on floor {name}" if name else "")
    cases = () if report is None else report.contradictions
    for number, text in enumerate(cases[:SHOWN]):
        lines.append(f"{'' if number else 'routes':<10} {_line(text)}")
    return lines


def _figures(
    found: BuildingGraphCheck, report: BuildingGraphReport | None, ignored: Collection[str]
) -> dict[str, Any]:
    wrong = _wrong(found, ignored)
    return {
        "graph": found.matched.name,
        "robot_radius_m": found.matched.building.robot_radius_m,
        "floors": {
            name: {
                "nodes": check.graph.n_nodes,
                "edges": check.graph.n_edges,
                "free_nodes": int(check.is_free.sum()),
                "clear_edges": int(check.is_clear.sum()),
                "in_sight": check.in_sight,
                "findings": found_figures(wrong[name]),
            }
            for name, check in found.floors.items()
        },
        "links": {
            link.drawn.name: None if link.own is None else link.own.name
            for link in found.matched.links
        },
        "findings": found_figures(wrong[""]),
        "routes": None
        if report is None
        else {name: counts.to_dict() for name, counts in report.counts.items()},
        "contradictions": [] if report is None else list(report.contradictions),
    }


def _line(text: str) -> str:
    """Return a text, escaped if names in it would break the line."""
    return text if text.isprintable() else repr(text)
