"""Commands that print what there is: the parts of a map and of its pyramid, and presets."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._base.files import printable, replace_file
from hybridnav.cli.common import (
    EXIT_NOT_SOLVED,
    UsageError,
    answer,
    check_output,
    check_picture,
    extent_line,
    islands_line,
    timings,
)
from hybridnav.cli.map_options import MapOptions
from hybridnav.cli.options import MapArgument, PlotOption, RegionsOption, option
from hybridnav.cli.reading import grow_topology, read_preset

if TYPE_CHECKING:
    from hybridnav.search.descent import WatchedDescent

LevelOption = Annotated[
    int | None,
    option(
        "--level N",
        "Level to describe and draw: 0 the base, -1 the apex; else the apex, or the regions.",
    ),
]
WatchOption = Annotated[
    tuple[str, Path] | None,
    option(
        "--watch WHAT FILE",
        "Draw what moves, on a long way: growth of the pyramid, descent by `paper`, search by A* "
        "and `octile`, proof of `octile`; .gif, or .html with a slider. A descent also as a strip, "
        ".png; a search also as .trace.json for Posthoc.",
    ),
]
_WATCHED = {
    "growth": (".gif", ".html"),
    "descent": (".gif", ".html", ".png", ".pdf", ".svg"),
    "search": (".gif", ".html", ".trace.json"),
    "proof": (".gif", ".html"),
}
"""What `--watch` draws, and the endings of its files."""
ProofArgument = Annotated[
    Path,
    typer.Argument(metavar="PROOF", help="JSON of hybridnav plan --proof, or of PlanResult.proof."),
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ShowOptions(MapOptions):
    """The options of `hybridnav show`."""

    level: LevelOption = None
    regions: RegionsOption = None
    plot: PlotOption = None
    watch: WatchOption = None


def show(args: ShowOptions) -> None:
    """Show the classes of MAP's cells and the levels of its pyramid.

    Example: hybridnav show maps/office/office.yaml --plot levels.png
    """
    level, watch = args.level, args.watch
    check_picture(args.plot)
    if watch is not None:
        if watch[0] not in _WATCHED:
            known = ", ".join(_WATCHED)
            raise UsageError(f"--watch draws one of {known}, got {printable(watch[0])!r:.80}")
        if not watch[1].name.lower().endswith(".trace.json") or watch[0] != "search":
            endings = [ending for ending in _WATCHED[watch[0]] if ending.count(".") == 1]
            check_output(watch[1], "--watch", tuple(endings))
    settings = args.settings()
    seconds: dict[str, float] = {}
    model = args.load(settings, seconds)
    pyramid = grow_topology(model, settings, seconds).pyramid
    if args.regions is not None:
        pyramid = pyramid.with_regions(args.regions)
    if level is None:
        level = -1 if pyramid.region_cells is None else pyramid.region_level
    if not -len(pyramid) <= level < len(pyramid):
        raise UsageError(f"--level must be from {-len(pyramid)} to {len(pyramid) - 1}, got {level}")
    if not model.is_filed:
        seconds = {"load": seconds["load"], **pyramid.stats.seconds}
    shown, draw = pyramid[level], None if watch is None else _watched(watch, pyramid, settings)
    parts = [_describe_map(pyramid), _describe_levels(pyramid, shown), _describe_level(shown)]
    answer("\n\n".join(parts) + f"\nseconds    {timings(seconds)}\n")
    if args.plot is not None:
        viz().save_figure(viz().plot_level(shown), args.plot)
    if draw is not None:
        draw()


def _watched(
    watch: tuple[str, Path], pyramid: hn.DualGraphPyramid, preset: hn.Preset
) -> Callable[[], object]:
    """Return what draws what is to be watched, between two cells that are far apart by the way
    between them.

    `preset`: for a descent one of method `paper`, else that of the package is taken.
    """
    (what, file), grid = watch, pyramid.grid
    if what == "growth":
        return lambda: viz().save_growth(pyramid, file)
    from hybridnav.search.grid_search import far_apart  # noqa: PLC0415

    enterable = grid.enterable(allow_unexplored=preset.planner.allow_unexplored)
    if not enterable.any():
        raise UsageError(f"--watch: map {printable(grid.name)} has no free cell to plan from")
    ends = far_apart(enterable)
    if what == "descent":
        descent = _descent(pyramid, preset, ends)
        if file.suffix.lower() in {".gif", ".html"}:
            return lambda: viz().save_descent(grid, descent, file)
        return lambda: viz().save_figure(viz().plot_descent(grid, descent)[0], file)
    own = preset.planner.allow_unexplored
    octile = hn.load_preset("octile", overrides=[f"planner.allow_unexplored={str(own).lower()}"])
    planner = hn.HybridPlanner(hn.TopologicalMap(pyramid), preset=octile)
    if what == "search":
        return _searches(grid, planner, ends, file)
    start, goal = map(tuple, grid.frame.points_of(ends).tolist())
    proof = hn.prove(planner.plan(start, goal))
    return lambda: viz().save_proof(grid, proof, file)


def viz() -> Any:
    """Return the pictures, which load matplotlib."""
    from hybridnav import viz as pictures  # noqa: PLC0415 - on demand

    return pictures


def _searches(
    grid: hn.OccupancyGrid, planner: hn.HybridPlanner, ends: Any, file: Path
) -> Callable[[], object]:
    """Return what draws A* and the search of `octile`, or writes a trace of the former."""
    from hybridnav.search.grid_search import GridSearch  # noqa: PLC0415

    allowed = planner.preset.planner.allow_unexplored
    astar = GridSearch(grid.enterable(allow_unexplored=allowed)).watch(*ends)
    if file.suffix.lower() == ".json":
        text = json.dumps(astar.trace(grid.shape), separators=(",", ":"))
        return lambda: replace_file(file, text.encode())
    jumps: Any = planner.method.prepare()
    records = {"A*": astar, "octile": jumps.watch(*ends)}
    return lambda: viz().save_search(grid, records, file)


def _descent(pyramid: hn.DualGraphPyramid, preset: hn.Preset, ends: Any) -> WatchedDescent:
    """Return the descent between two cells, by a preset of method `paper`."""
    from hybridnav.search.descent import Descent  # noqa: PLC0415

    if preset.planner.method != "paper":
        preset = hn.load_preset("paper")
    descent = hn.HybridPlanner(hn.TopologicalMap(pyramid), preset=preset).method.prepare()
    if not isinstance(descent, Descent):
        raise UsageError("--watch: the preset has levels: places, which is one step, not a descent")
    watched = descent.watch(*ends)
    assert watched is not None  # noqa: S101 - there is a way between both
    return watched


def _describe_map(pyramid: hn.DualGraphPyramid) -> str:
    grid = pyramid.grid
    rows, cols = grid.shape
    size = f"{cols} x {rows} cells of {grid.resolution_m:g} m"
    size_m = f"{cols * grid.resolution_m:.2f} x {rows * grid.resolution_m:.2f} m"
    cells = grid.class_counts()
    closed = f", {cells.pop('closed'):,} closed with islands" if "closed" in cells else ""
    counts = ", ".join(f"{n:,} {name}" for name, n in cells.items())
    built = f"linkage {pyramid.linkage}, seed {pyramid.seed}"
    return "\n".join(
        [
            f"map        {printable(grid.name)}, {size}, {size_m}",
            extent_line(grid),
            f"cells      {counts} by a robot radius of {grid.robot_radius_m:g} m{closed}",
            *islands_line(grid),
            f"pyramid    U_d {pyramid.merge_distance_m:g} m, {built}",
        ]
    )


def _describe_levels(pyramid: hn.DualGraphPyramid, shown: hn.Level) -> str:
    """Return a table of all levels; `factor` is the number of vertices one level down divided by
    that here."""
    lines = [f"{'level':>5} {'vertices':>12} {'arcs':>12} {'self-loops':>12} {'factor':>7}"]
    below, names = None, _names_of(pyramid)
    for index, size in enumerate(pyramid.stats.sizes):
        factor = f"{below / size.vertices:.2f}" if below else ""
        mark = f"  {names[index]}" if index in names else ""
        mark += " <" if index == shown.index else ""
        counts = f"{size.vertices:>12,} {size.arcs:>12,} {size.self_loops:>12,}"
        lines.append(f"{index:>5} {counts} {factor:>7}{mark}".rstrip())
        below = size.vertices
    return "\n".join(lines)


def _names_of(pyramid: hn.DualGraphPyramid) -> dict[int, str]:
    """Name the levels of a pyramid that goes on above its places."""
    if len(pyramid) == pyramid.place_level + 1:
        return {}
    tops = [("places", pyramid.place_level)]
    tops += [] if pyramid.region_cells is None else [("regions", pyramid.region_level)]
    tops += [] if pyramid.rooms is None else [("rooms", pyramid.room_level)]
    return {at: ", ".join(name for name, top in tops if top == at) for _, at in tops}


def _describe_level(level: hn.Level) -> str:
    """Return one line on a level; a simple graph would lose its parallel arcs: second doors."""
    import numpy as np  # noqa: PLC0415 - help and wrong usage can do without

    from hybridnav._base.rows import unique_rows  # noqa: PLC0415

    free = int(np.count_nonzero(level.classes == hn.CellClass.FREE))
    largest_m2 = int(level.areas.max(initial=0)) * level.grid.resolution_m**2
    plain = np.sort(level.arcs[~level.is_self_loop], axis=1)
    parallel = len(plain) - len(unique_rows(plain).rows)
    vertices = f"{free:,} free and {level.n_vertices - free:,} unexplored vertices"
    return (
        f"level {level.index:<4} {vertices}, "
        f"the largest of {largest_m2:.2f} m²; {parallel:,} parallel arcs"
    )


# `hybridnav preset`: list, print and check presets.


preset = typer.Typer(
    name="preset",
    help="List, print and check presets.\n\nExample: hybridnav preset show robot",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode=None,
)

PresetArgument = Annotated[
    str, typer.Argument(metavar="NAME|FILE", help="A preset's name or its YAML file.")
]


@preset.command("list")
def list_presets() -> None:
    """List the presets that come with the package."""
    names = hn.preset_names()
    width = max(map(len, names), default=0)
    answer("".join(f"{name:<{width}}  {hn.load_preset(name).description}\n" for name in names))


@preset.command("show")
def show_preset(source: PresetArgument) -> None:
    """Print a preset in full, every key present."""
    answer(read_preset(source).to_yaml())


@preset.command("check")
def check_preset(source: PresetArgument) -> None:
    """Check a preset; an error names the key."""
    answer(f"{read_preset(source).name}: valid\n")


def verify(map_file: MapArgument[Path], proof_file: ProofArgument) -> None:
    """Check a PROOF of a plan on MAP.

    It is accepted if its path is free and has its cost, and no path costs less. The same is done by
    check_proof.py, a script that needs nothing of this package.

    Exits with 0 when the proof is accepted, 1 when it is rejected, 3 on unreadable input.

    Example: hybridnav verify maps/office/office.yaml proof.json
    """
    from hybridnav import check_proof  # noqa: PLC0415 - loads numpy

    try:
        proof = json.loads(proof_file.read_bytes())
        low, high = map(float, proof["thresholds"])
    except OSError as error:
        raise hn.errors.MapError(f"proof {printable(proof_file)}: {error.strerror}") from None
    except (ValueError, TypeError, LookupError, RecursionError):
        raise hn.errors.MapError(
            f"proof {printable(proof_file)}: not a proof, expected one of hybridnav plan --proof"
        ) from None
    grid = hn.load_map(map_file)
    if (grid.free_threshold, grid.occupied_threshold) != (low, high):
        grid = hn.load_map(map_file, free_threshold=low, occupied_threshold=high)
    frame = [grid.resolution_m, *grid.frame.origin_m, grid.frame.yaw_rad]
    try:
        said = check_proof.check(grid.measured, frame, proof)
    except check_proof.Rejected as error:
        answer(f"rejected   {error}\n")
        raise typer.Exit(EXIT_NOT_SOLVED) from None
    answer(f"accepted   {said}\n")
