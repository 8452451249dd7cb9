"""A run of the harness: maps and methods in, records in a folder out. Public: `RunSettings` and
`write_records`.
"""

import json
import math
import shlex
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from hybridnav._base.files import MODEL_SUFFIX, printable
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.typing import BoolArray, PathLike
from hybridnav.errors import InvalidValueError, MapWarning, brief
from hybridnav.harness.methods import (
    baseline_spec,
    graph_spec,
    named_spec,
    preset_spec,
    recorded_settings,
)
from hybridnav.harness.names import REFERENCE, MethodSpec, NamedMethod
from hybridnav.harness.recorded_method import RecordedMethod
from hybridnav.harness.records import RECORDS_FILE, RUNS_FILE, Record, RecordFile, read_records
from hybridnav.harness.scenes import (
    SAMPLER_VERSION,
    GivenCosts,
    MapSpec,
    Pair,
    clear_scenes,
    evenly_spread,
    lattice_pairs,
    read_scene,
    sample_pairs,
    scenario_pairs,
    text_of_costs,
)
from hybridnav.harness.task import Task
from hybridnav.harness.timing import TimingTask, circumstances
from hybridnav.harness.workers import run_local, run_on_cluster
from hybridnav.harness.yardstick import ANSWERED, TOO_SLOW
from hybridnav.maps import DEFAULT_MAX_CELLS, CellClass, OccupancyGrid
from hybridnav.maps.cells import DEFAULT_ROBOT_RADIUS_M
from hybridnav.maps.files.movingai import Scenario, load_scenarios
from hybridnav.planning import Preset

MOVINGAI_MERGE_DISTANCE_M = 40.0
"""Default on MovingAI maps, whose cells are 1 m by agreement; the robot is a point there."""

_AnyTask = TypeVar("_AnyTask", Task, TimingTask)
_PAIRS = 100
_PAIRS_PER_TASK = 2000

_SAMPLE = 3
"""Pairs of a task whose optima independent code computes too."""


@dataclass(frozen=True, kw_only=True)
class RunSettings:
    """The maps, methods and pairs of a run; see `write_records`.

    Examples
    --------
    >>> from hybridnav.harness import RunSettings
    >>> RunSettings(maps=("office.yaml",), presets=("shortest", "paper"), pairs=50).workers
    1
    """

    maps: tuple[str, ...]
    presets: tuple[str | Preset, ...] = ("shortest",)
    baselines: tuple[str, ...] = ()
    graphs: tuple[Any, ...] = ()
    """Graphs that others have made, or files of them; there must be one map. Routes go straight to
    the nearest node in sight of the start. They take the edges that are shortest in metres, and go
    straight on from the nearest node in sight of the goal."""
    methods: tuple[NamedMethod, ...] = ()
    """Methods with names and settings of their own. Recorded paths go with one map. Theirs are
    the pairs that are asked, unless a lattice or scenarios are given."""
    clear_edges_only: bool = False
    """Whether edges of these graphs that the robot cannot follow are left out."""
    pairs: int | None = None
    """Sampled pairs a map, 100 unless given; of a scenario file as many, evenly spread over it, or
    all."""
    lattice_step_m: float | None = None
    """Instead of sampled pairs: all pairs of free cells on a lattice."""
    scenarios: str | tuple[str, ...] | None = None
    """Instead of sampled pairs: a MovingAI scenario file, which goes with one map, or one for each
    map, an empty text for sampled pairs."""
    seed: int = 0
    """Seed of the sampler."""
    repeat: int = 0
    """Queries of each method and pair in the timing pass, in which one process asks all methods in
    shuffled order. 0 for none: times are then those of the answers, one method after the other."""
    robot_radius_m: float | None = None
    """None: 0.25 m for ROS maps, 0 for MovingAI's."""
    merge_distance_m: float | None = None
    """None: the preset's for ROS maps (4 m for baselines), 40 m for MovingAI's."""
    corner_cutting: bool = False
    costs: GivenCosts = ()
    """Costs of cells, by which paths are judged: texts as in `hybridnav plan --costs`, such as
    `("clearance:multiplier=4",)`, read for each map, or a `CostLayer` for one map. They take the
    place of costs that a preset names; cells that they close are occupied for all methods."""
    max_cells: int = DEFAULT_MAX_CELLS
    """The most cells that a map may have; see `load_map`."""
    workers: int = 1
    scheduler: str | None = None
    """Address of a dask.distributed scheduler, instead of processes of this machine."""
    timeout_s: float = 600.0
    """Longest silence of a worker: one query, or a preparation."""
    limit_s: float | None = None
    """Seconds that a method may take on a map, for its preparation and all answers. The pairs that
    are left then are recorded as "too slow", and the timing pass leaves it out. None: no limit."""


def write_records(
    settings: RunSettings, folder: PathLike, *, progress: Progress = no_progress
) -> int:
    r"""Answer all pairs on all maps by all methods, and append the records to a folder.

    Records that exist are kept, so a run that was killed resumes. The baseline "grid-astar" is
    always among the methods: its lengths are the optimum. With costs the optimum is that of
    Dijkstra's algorithm by the judges, for each pair. Methods that can plan by costs do; the paths
    of the others are judged by their cost too.

    Parameters
    ----------
    settings
        The maps, methods and pairs to evaluate.
    folder
        Created if it is missing; receives `records.jsonl` and `runs.jsonl`.
    progress
        Called with the number of finished records and of all.

    Returns
    -------
    int
        Number of new records.

    Raises
    ------
    InvalidValueError
        When a setting is out of range, the folder cannot be written, or it holds a run with other
        costs.
    MapError, PresetError
        When a map, a graph, a scenario file or a preset cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import RunSettings, write_records
    >>> _ = Path("hall.map").write_text("type octile\nheight 2\nwidth 3\nmap\n...\n.@.\n")
    >>> settings = RunSettings(maps=("hall.map",), presets=("octile",), pairs=5)
    >>> write_records(settings, "run")
    12
    """
    path = Path(folder)
    if settings.repeat < 0:
        raise InvalidValueError(f"repeats are at least 0, got {settings.repeat}")
    if settings.limit_s is not None and not settings.limit_s > 0:
        raise InvalidValueError(f"the limit must be positive, got {settings.limit_s} s")
    clear_scenes()  # a file may have changed since the last run of this process
    _check_one_map(settings)
    files = _scenario_files(settings)
    tasks = [
        task
        for name, scenarios in zip(settings.maps, files, strict=True)
        for task in _tasks_of(settings, name, scenarios)
    ]
    try:
        path.mkdir(parents=True, exist_ok=True)
        if any(path.iterdir()) and not (path / RECORDS_FILE).exists():
            raise InvalidValueError(f"folder {folder} holds other files and no run: take a new one")
        with RecordFile(path, [task.method for task in tasks]) as records:
            own = text_of_costs(settings.costs)
            for other in sorted(records.costs - {own}):
                raise InvalidValueError(
                    f"folder {records.path.parent} holds a run {_with(other)}, and this one is "
                    f"{_with(own)}: take a new folder"
                )
            _write_settings(settings, path, _sources(tasks))
            total = len({name for task in tasks for name in task.ids})
            wanted = [rest for task in tasks if (rest := _missing(task, records.ids)) is not None]
            before = len(records.ids)
            done = total - sum(len({*task.ids} - records.ids) for task in wanted)
            for some in (
                [task for task in wanted if task.method.source],
                [task for task in wanted if not task.method.source],
            ):
                needed = _needed(some, tasks, records)
                done += sum(len(task.ids) for task in some) - sum(len(task.ids) for task in needed)
                for batch in _run(settings, needed):
                    known = len(records.ids)
                    records.append(batch)
                    done += len(records.ids) - known
                    progress(done, total)
            timing = _timing_tasks(settings, tasks, records, path)
            total += sum(len(task.ids) for task in timing)
            alone = replace(settings, workers=1, timeout_s=_silence_s(settings, timing))
            left = [part for one in timing if (part := _missing(one, records.ids)) is not None]
            for batch in _run(alone, left):
                done += len(batch)
                records.append(batch)
                progress(min(done, total), total)
            return len(records.ids) - before
    except OSError as error:
        raise InvalidValueError(f"folder {folder}: {error.strerror}") from None


def _silence_s(settings: RunSettings, timing: Sequence[TimingTask]) -> float:
    """Return the longest silence of the timing pass, which prepares all methods of a map before its
    first record."""
    return settings.timeout_s * max((len(task.methods) for task in timing), default=1)


def _with(costs: str) -> str:
    return f"with costs {costs}" if costs else "without costs"


def _run(settings: RunSettings, tasks: Sequence[Task | TimingTask]) -> Iterator[list[Record]]:
    if not tasks:
        return iter(())
    if settings.scheduler is not None:
        return run_on_cluster(tasks, address=settings.scheduler)
    return run_local(tasks, workers=settings.workers, timeout_s=settings.timeout_s)


def _needed(part: Sequence[Task], tasks: Sequence[Task], records: RecordFile) -> list[Task]:
    """Return tasks without those of the reference on maps where no other method could be made:
    there is nothing to compare with it."""
    others = [task for task in tasks if task.method.name != REFERENCE]
    asked = {task.map_sha for task in others}
    made = {t.map_sha for t in others if (t.map_sha, t.method.digest) not in records.failed}
    in_vain = asked - made
    return [t for t in part if t.method.name != REFERENCE or t.map_sha not in in_vain]


def _timing_tasks(
    settings: RunSettings, tasks: Sequence[Task], records: RecordFile, folder: Path
) -> list[TimingTask]:
    """Return the timing pass of each map: the methods that could be made, and the pairs without
    those queries that had no answer."""
    if settings.repeat == 0:
        return []
    records_there = read_records(folder)
    answered = {r["id"] for r in records_there if r["status"] in ANSWERED}
    slow = {(r["map_sha"], r["method_sha"]) for r in records_there if r["status"] == TOO_SLOW}
    passes = []
    for sha in dict.fromkeys(task.map_sha for task in tasks):
        own = [task for task in tasks if task.map_sha == sha]
        left_out = records.failed | slow
        made = [
            task
            for task in own
            if (sha, task.method.digest) not in left_out and not task.method.is_recorded
        ]
        methods = {task.method.digest: task.method for task in made}
        without = {
            (task.method.digest, pair.key)
            for task in made
            for pair, name in zip(task.pairs, task.ids[1:], strict=True)
            if name not in answered
        }
        pairs = tuple(dict.fromkeys(pair for task in made for pair in task.pairs))
        if len(methods) > 1 and pairs:
            specs = tuple(methods.values())
            timing = (settings.repeat, settings.seed, frozenset(without))
            passes.append(TimingTask(own[0].map, sha, specs, pairs, *timing))
    return passes


def _missing(task: _AnyTask, there: set[str]) -> _AnyTask | None:
    """Return the part of a task without records, None if there is no such part."""
    pairs = tuple(
        pair for pair, name in zip(task.pairs, task.ids[1:], strict=True) if name not in there
    )
    if not pairs and task.ids[0] in there:
        return None
    return replace(task, pairs=pairs)


def _scenario_files(settings: RunSettings) -> tuple[str, ...]:
    """Return the scenario file of each map, an empty text for none."""
    given = settings.scenarios
    files = (given,) if isinstance(given, str) else given or ("",) * len(settings.maps)
    if len(files) != len(settings.maps):
        raise InvalidValueError(
            f"a scenario file goes with one map, got {len(files)} for {len(settings.maps)} maps"
        )
    return files


def _tasks_of(settings: RunSettings, name: str, scenarios: str) -> list[Task]:
    """Return the tasks of one map, the reference's first."""
    suffix = Path(name).suffix.lower()
    ros = suffix != ".map"
    radius_m = settings.robot_radius_m
    if radius_m is None and suffix != MODEL_SUFFIX:
        radius_m = DEFAULT_ROBOT_RADIUS_M if ros else 0.0
    merge_distance_m = settings.merge_distance_m
    if merge_distance_m is None and not ros:
        merge_distance_m = MOVINGAI_MERGE_DISTANCE_M
    if merge_distance_m is not None and not merge_distance_m > 0:
        raise InvalidValueError(f"the merge distance must be positive, got {merge_distance_m} m")
    file = str(Path(name).resolve())
    spec = MapSpec(file, radius_m, settings.corner_cutting, settings.max_cells, settings.costs)
    scene = read_scene(spec)
    digest = scene.digest
    pairs = _pairs_of(settings, scene.grid, scenarios)
    parts = [
        tuple(pairs[at : at + _PAIRS_PER_TASK])
        for at in range(0, max(len(pairs), 1), _PAIRS_PER_TASK)
    ]
    return [
        Task(spec, digest, method, part, frozenset(part[:_SAMPLE]), limit_s=settings.limit_s)
        for method in methods_of(settings, merge_distance_m)
        for part in parts
    ]


def methods_of(settings: RunSettings, merge_distance_m: float | None) -> list[MethodSpec]:
    """Return the methods of a run on a map, the reference first, none twice."""
    specs = [
        baseline_spec(name, merge_distance_m=merge_distance_m)
        for name in (REFERENCE, *settings.baselines)
    ]
    for preset in settings.presets:
        spec = preset_spec(
            preset, merge_distance_m=merge_distance_m, by_costs=bool(text_of_costs(settings.costs))
        )
        # The preset of the same name as the reference is that very search: measured once.
        if spec.name != REFERENCE:
            specs.append(spec)
    specs += [
        graph_spec(graph, clear_edges_only=settings.clear_edges_only) for graph in settings.graphs
    ]
    for named in settings.methods:
        spec = named_spec(
            named,
            merge_distance_m=merge_distance_m,
            by_costs=bool(text_of_costs(settings.costs)),
            clear_edges_only=settings.clear_edges_only,
        )
        if spec.name in {other.name for other in specs}:
            raise InvalidValueError(f"two methods are called {spec.name}: name one of them")
        specs.append(spec)
    lines = [spec.name for spec in specs if spec.metric != "octile"]
    if lines and settings.corner_cutting:
        raise InvalidValueError(
            f"method {lines[0]}: an any-angle path never passes between two blocked cells that "
            "meet at a corner: leave corner cutting out, or take presets with octile paths, such "
            "as octile"
        )
    return list({spec.digest: spec for spec in specs}.values())


def _pairs_of(settings: RunSettings, grid: OccupancyGrid, scenarios: str) -> list[Pair]:
    if scenarios:
        stated = load_scenarios(scenarios, shape=grid.shape)
        pairs = scenario_pairs(grid, stated)
        _warn_of(stated, grid, scenarios)
        return evenly_spread(pairs, settings.pairs or len(pairs))
    if settings.lattice_step_m is not None:
        return lattice_pairs(grid, settings.lattice_step_m)
    recorded = [named for named in settings.methods if named.kind == "recorded"]
    if recorded:
        return _recorded_pairs(settings, recorded, grid)
    return sample_pairs(
        grid, _PAIRS if settings.pairs is None else settings.pairs, seed=settings.seed
    )


def _check_one_map(settings: RunSettings) -> None:
    is_recorded = any(named.kind == "recorded" for named in settings.methods)
    if (settings.graphs or is_recorded) and len(settings.maps) != 1:
        what = "a graph goes" if settings.graphs else "recorded paths go"
        raise InvalidValueError(
            f"{what} with one map, got {len(settings.maps)} maps: evaluate each by itself"
        )


def _recorded_pairs(
    settings: RunSettings, recorded: Sequence[NamedMethod], grid: OccupancyGrid
) -> list[Pair]:
    """Return the pairs of which paths were recorded, those between free cells."""
    made = [RecordedMethod(grid, **recorded_settings(named)) for named in recorded]
    ends = dict.fromkeys(pair for method in made for pair in method.pairs)
    free = grid.classes == CellClass.FREE
    inside = [ends for ends in ends if all(_holds(free, cell) for cell in ends)]
    if lost := len(ends) - len(inside):
        warnings.warn(
            f"{lost:,} of {len(ends):,} recorded paths begin or end in a cell that is not free: "
            "they are left out; `hybridnav judge` judges them",
            MapWarning,
            stacklevel=2,
        )
    pairs = [Pair(start, goal, "recorded") for start, goal in inside]
    return evenly_spread(pairs, settings.pairs or len(pairs))


def _holds(free: BoolArray, cell: tuple[int, int]) -> bool:
    on_map = all(0 <= at < size for at, size in zip(cell, free.shape, strict=True))
    return on_map and bool(free[cell])


def _warn_of(stated: Sequence[Scenario], grid: OccupancyGrid, file: str) -> None:
    """Warn of scenarios that are left out, and of those that name another map."""
    notes = []
    ends = [(one.start, one.goal) for one in stated]
    blocked = [end for pair in ends for end in pair if grid.classes[end] != CellClass.FREE]
    lost = sum(any(grid.classes[end] != CellClass.FREE for end in pair) for pair in ends)
    if lost:
        notes.append(
            f"{lost:,} of {len(ends):,} start or end in a cell that is not free, such as "
            f"{blocked[0]}: they are left out"
        )
    names = {Path(one.map_name.replace("\\", "/")).stem for one in stated}
    others = sorted(name for name in names if name.casefold() != grid.name.casefold())
    if others:
        notes.append(
            f"they are for map {brief(others[0])}, and this is {brief(grid.name)}, of the same "
            "size: check that it is the same map"
        )
    for text in notes:
        warnings.warn(f"scenarios {printable(file)}: {text}", MapWarning, stacklevel=2)


def _sources(tasks: Sequence[Task]) -> dict[str, str]:
    """Return the hash of the source of each class of others."""
    return {task.method.name: task.method.source for task in tasks if task.method.source}


def _write_settings(settings: RunSettings, folder: Path, sources: dict[str, str]) -> None:
    """Note the settings of this run, one line for each run into the folder."""
    plain = asdict(replace(settings, graphs=()))
    plain["graphs"] = [graph if isinstance(graph, str) else graph.name for graph in settings.graphs]
    plain["presets"] = [
        preset if isinstance(preset, str) else preset.name for preset in settings.presets
    ]
    plain["sampler_version"] = SAMPLER_VERSION
    plain["sources"] = sources
    program, *arguments = sys.argv or [""]
    own = Path(program).name in {"hybridnav", "__main__.py"}
    command = shlex.join(["hybridnav" if own else program, *arguments])
    plain |= {"command": command, **circumstances()}
    plain["costs"] = text_of_costs(settings.costs)
    if settings.merge_distance_m == math.inf:  # JSON has no such number
        plain["merge_distance_m"] = "inf"
    with (folder / RUNS_FILE).open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(plain) + "\n")
