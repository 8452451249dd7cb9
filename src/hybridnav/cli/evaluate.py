"""`hybridnav evaluate` and `hybridnav compare`: the harness on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

import hybridnav as hn
from hybridnav._base.extension import extension
from hybridnav._base.files import printable
from hybridnav.cli import options
from hybridnav.cli.common import EXIT_NOT_SOLVED, UsageError, answer, complain, progress_bar
from hybridnav.cli.map_options import is_building_file
from hybridnav.cli.options import option
from hybridnav.cli.reading import read_settings
from hybridnav.maps import DEFAULT_MAX_CELLS

if TYPE_CHECKING:
    from hybridnav.harness.analysis import Study
    from hybridnav.harness.run import RunSettings
    from hybridnav.harness.yardstick import Yardstick

BaselinesOption = Annotated[
    list[str] | None,
    option("--baseline NAME", "A baseline, or module:class; may be given several times."),
]
GraphsOption = Annotated[
    list[Path] | None,
    option(
        "--graph FILE",
        "A graph in any format that `hybridnav check` reads, to follow on one map; may be given "
        "several times.",
    ),
]
RecordedOption = Annotated[
    list[Path] | None,
    option(
        "--recorded FOLDER",
        "Recorded paths, in files that `hybridnav judge` reads, as a method on one map; the pairs "
        "are theirs. May be given several times.",
    ),
]
ClearEdgesOption = Annotated[
    bool, option("--clear-edges", "Leave out edges of the graph that the robot cannot follow.")
]
PairsOption = Annotated[
    int | None, option("--pairs N", "Pairs a map: 100 sampled, or all of --scen.", min=1)
]
LatticeOption = Annotated[
    float | None, option("--all-pairs STEP", "All pairs of cells STEP metres apart.")
]
ScenariosOption = Annotated[Path | None, option("--scen FILE", "The pairs of a scenario file.")]
RepeatOption = Annotated[
    int,
    option(
        "--repeat N",
        "Time each query N times in a pass of its own, all methods in shuffled order; 0 for times "
        "of the answers alone.",
        min=0,
    ),
]
WorkersOption = Annotated[int, option("--workers W", "Processes on this machine.")]
SchedulerOption = Annotated[
    str | None, option("--scheduler ADDRESS", "A dask.distributed scheduler instead.")
]
CornersOption = Annotated[
    bool, option("--corner-cutting", "Let diagonals cut corners: breaks consistency.")
]
TimeoutOption = Annotated[float, option("--timeout S", "Longest silence of a process, seconds.")]
LimitOption = Annotated[
    float | None, option("--limit S", "Seconds for a method on a map; pairs left are not asked.")
]
RunArgument = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of a run.")]
MetricOption = Annotated[
    str,
    option(
        "--metric WHICH",
        "What losses refer to: the any-angle optimum for all paths, the octile optimum, the least "
        "cost of paths of cells (with --costs), or both, each path's own (any-angle, octile, "
        "weighted, both).",
    ),
]


def evaluate(
    map_files: options.MapArgument[list[Path]],
    out: options.OutOption[Path],
    preset: options.PresetOption[list[str] | None] = None,
    baseline: BaselinesOption = None,
    graph: GraphsOption = None,
    recorded: RecordedOption = None,
    floor: options.GraphFloorOption = None,
    clear_edges: ClearEdgesOption = False,
    pairs: PairsOption = None,
    all_pairs: LatticeOption = None,
    scen: ScenariosOption = None,
    seed: options.SeedOption[int] = 0,
    repeat: RepeatOption = 0,
    workers: WorkersOption = 1,
    scheduler: SchedulerOption = None,
    overrides: options.SetOption = None,
    robot_radius_m: options.RadiusOption = None,
    merge_distance_m: options.MergeDistanceOption[float | None] = None,
    corner_cutting: CornersOption = False,
    costs: options.CostsOption = None,
    max_cells: options.MaxCellsOption = DEFAULT_MAX_CELLS,
    timeout_s: TimeoutOption = 600.0,
    limit_s: LimitOption = None,
    metric: MetricOption = "both",
) -> None:
    """Measure consistency, loss and efficiency of methods on maps.

    They answer the same pairs. Records go to records.jsonl in the folder --out; a run that was
    stopped goes on where it was. --preset may be given several times, shortest where no method is
    named; --set holds for all of them. --seed is that of sampled pairs. Methods plan by --costs and
    are judged by them. Robot radii of presets do not count. On MovingAI maps the radius is 0 unless
    stated, and the size of places 40 m.

    Exits with 1 when a counter-example was found, a method could not be made, or nothing was
    checked. Queries in which a method raised are counted on stderr, and do not change that.

    Example: hybridnav evaluate maps/figure1/figure1.yaml --pairs 20 -o run
    """
    if all_pairs is not None and (scen is not None or pairs is not None):
        raise UsageError(
            "--all-pairs chooses the pairs: leave out --scen and --pairs, or --all-pairs"
        )
    from hybridnav.harness.names import NamedMethod  # noqa: PLC0415
    from hybridnav.harness.output import write_outputs  # noqa: PLC0415 - loads every method
    from hybridnav.harness.run import RunSettings  # noqa: PLC0415

    yardstick = _yardstick(metric)
    if not options.parsed_costs(costs) and yardstick == "weighted":
        raise UsageError("--metric weighted goes with --costs: state them, or take another metric")
    if yardstick == "any-angle" and corner_cutting:
        raise UsageError(
            "--metric any-angle does not go with --corner-cutting: no any-angle path passes "
            "between two blocked cells that meet at a corner; take --metric octile"
        )
    if clear_edges and not graph:
        raise UsageError("--clear-edges goes with --graph: name the graph, or leave it out")
    if floor is not None and not graph:
        raise UsageError("--floor goes with --graph: name the graph, or leave it out")
    _check_maps(map_files)
    others = baseline or graph or recorded
    names = preset if preset is not None else ([] if others else ["shortest"])
    settings = RunSettings(
        maps=tuple(map(str, map_files)),
        presets=tuple(read_settings(name, overrides, None, None) for name in names),
        baselines=tuple(baseline or ()),
        graphs=tuple(_graph(file, floor) for file in graph or ()),
        methods=tuple(NamedMethod("recorded", str(folder)) for folder in recorded or ()),
        clear_edges_only=clear_edges,
        pairs=pairs,
        lattice_step_m=all_pairs,
        scenarios=None if scen is None else str(scen),
        seed=seed,
        repeat=repeat,
        robot_radius_m=robot_radius_m,
        merge_distance_m=merge_distance_m,
        corner_cutting=corner_cutting,
        costs=tuple(costs or ()),
        max_cells=max_cells,
        workers=workers,
        scheduler=scheduler,
        timeout_s=timeout_s,
        limit_s=limit_s,
    )
    _run(settings, out)
    study = write_outputs(out, metric=yardstick)
    answer((out / "summary.md").read_text(encoding="utf-8") + f"\nreport: {out / 'report.html'}\n")
    faults = [f"{each.map_name}, {each.label}: {fault}" for each, _, fault in study.faults]
    unmade = [
        f"{each.map_name}, {each.label}: {each.preparation.get('error', 'lost')}"
        for each in study.outcomes
        if each.is_asked and each.preparation["status"] != "ready"
    ]
    raised = [
        f"{each.map_name}, {each.label}: {record.get('error', record['status'])}"
        for each in study.outcomes
        if each.preparation["status"] == "ready"
        for record in each.failed
    ]
    for what, cases in (
        ("counter-examples", faults),
        ("methods without answers", unmade),
        ("queries that failed", raised),
    ):
        if cases:
            complain(f"{what}: {len(cases)}, the first: {cases[0]}")
    if not study.checks and not unmade:
        complain(f"nothing was checked: {_why_nothing(study)}")
    if faults or unmade or not study.checks:
        raise typer.Exit(EXIT_NOT_SOLVED)


def _check_maps(files: list[Path]) -> None:
    """Refuse buildings, whose routes over floors are no pairs of cells of one map."""
    for file in files:
        if is_building_file(file):
            raise UsageError(
                f"{printable(file)} is a building, and methods are measured on maps: give the "
                "maps of its floors, or compare the routes of a graph over all of them by "
                "`hybridnav check BUILDING GRAPH`"
            )


def _why_nothing(study: Study) -> str:
    """Return the reason for a run without answers."""
    for outcome in study.outcomes:
        if not outcome.is_asked:
            return f"{outcome.map_name}, {outcome.label}: {outcome.preparation['error']}"
    return "the maps have no such pairs of free cells"


def _graph(file: Path, floor: str | None) -> str | hn.graphs.WaypointGraph:
    if floor is None:
        return str(file)
    return extension("formats", "graph").load_graph(file, floor=floor)


def _yardstick(metric: str) -> Yardstick:
    from hybridnav.harness.yardstick import check_yardstick  # noqa: PLC0415 - on demand

    check_yardstick(metric)
    return cast("Yardstick", metric)


def _run(settings: RunSettings, out: Path) -> None:
    from hybridnav.harness.run import write_records as run  # noqa: PLC0415

    with progress_bar("records") as advance:
        run(settings, out, progress=advance)


def compare(first: RunArgument, second: RunArgument, metric: MetricOption = "both") -> None:
    """Set two runs side by side, and test whether they differ.

    Example: hybridnav compare run-a run-b
    """
    from hybridnav.harness.compare import compare_runs  # noqa: PLC0415 - on demand
    from hybridnav.harness.tables import to_markdown  # noqa: PLC0415 - on demand

    rows = compare_runs(first, second, metric=_yardstick(metric))
    for over in dict.fromkeys(row["loss over"] for row in rows):
        own = [row for row in rows if row["loss over"] == over]
        table = to_markdown([{key: row[key] for key in row if key != "loss over"} for row in own])
        answer(f"## Loss over {over}\n\n{table}\n")
