"""The runs of the study: lengths, costs and OMPL, each into a folder of its own, all resumable."""

import importlib.metadata
import inspect
import json
import sys
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import hybridnav as hn
from benchmarks.rivals import needed_package
from benchmarks.subjects._study_maps import StudyMap
from hybridnav._base.files import replace_file
from hybridnav.errors import HybridNavError, InvalidValueError
from hybridnav.harness.methods import preset_spec
from hybridnav.harness.names import BASELINES, REFERENCE, NamedMethod, class_of
from hybridnav.harness.run import RunSettings, write_records
from hybridnav.planning import Preset, load_preset

RUN_FILE = "study-run.json"
COSTS = ("clearance",)
"""Nav2's inflation with the defaults of its bringup."""

BESIDE_OMPL = "octile"
"""Preset whose paths of cells, shortened by line of sight, stand beside those of OMPL."""

GRAPHS = (
    NamedMethod("class", "benchmarks.subjects._study_graphs:RouteGraphMethod", "route graph"),
    NamedMethod("class", "benchmarks.subjects._study_graphs:SwaggerLike", "swagger-like"),
)
"""Graphs of waypoints, made for each map, by their names in tables. Their module is imported where
they are made: it needs scikit-image."""

RIVALS = (
    *(
        NamedMethod("class", f"benchmarks.rivals:{made_of}", name)
        for name, made_of in {
            "nano-astar": "NanoAstar",
            "networkx": "Networkx",
            "pyastar2d": "Pyastar2d",
            "pyroutingkit": "RoutingKit",
            "tcod": "Tcod",
        }.items()
    ),
    NamedMethod("class", "benchmarks.rivals_any_angle:ExtremityPathfinder", "extremitypathfinder"),
    NamedMethod("class", "benchmarks.rivals_any_angle:OmplWhole", "ompl-whole"),
    NamedMethod(
        "class",
        "benchmarks.rivals_any_angle:OmplWhole",
        "ompl-whole-prmstar",
        {"planner": "PRMstar"},
    ),
)
"""Planners of others, by their names in tables."""

SAMPLING = tuple(
    NamedMethod("preset", "ompl", f"ompl-{name}", {"planner.ompl.planner": planner})
    for name, planner in {
        "rrtconnect": "RRTConnect",
        "rrtstar": "RRTstar",
        "informed-rrtstar": "InformedRRTstar",
        "bitstar": "BITstar",
        "prmstar": "PRMstar",
    }.items()
)
"""The preset `ompl` with one planner each, by their names in tables."""

PLACES_FIRST = NamedMethod("preset", "ompl", "paper+ompl", {"planner.along": "paper"})
"""RRTConnect where the coarse route of `paper` leads; `paper` has grid A* there."""

_LATE_S = 120.0
"""Silence beyond the limit that loading kernels and judging may add."""
_SPEAK_S = 15.0


@dataclass(frozen=True)
class Plan:
    """How much a study asks."""

    name: str
    pairs: int
    """Of each map."""
    ompl_pairs: int
    """Of each map, in the part about OMPL."""
    repeat: int
    """Queries of each pair in the timing passes."""
    limit_s: float
    """Seconds for a method on a map."""
    without: tuple[str, ...] = ()
    """Methods that are left out."""


_ONLY_WHOLE = (
    "grid-dijkstra", "hpa-star-raw", "hpa-star-lines", "ompl-prmstar", "ompl-rrtstar",
)  # fmt: skip
"""Methods of the whole study alone: another setting of a method that a quarter has, or a slow
yardstick."""

PLANS = {
    "quarter": Plan("quarter", 16, ompl_pairs=4, repeat=3, limit_s=60.0, without=_ONLY_WHOLE),
    "whole": Plan("whole", 64, ompl_pairs=16, repeat=5, limit_s=600.0),
}


@dataclass(frozen=True)
class Part:
    """One run of the study: the same maps, other methods or another metric."""

    name: str
    presets: tuple[str | Preset, ...]
    baselines: tuple[str, ...]
    pairs: int
    repeat: int
    costs: tuple[str, ...] = ()
    methods: tuple[NamedMethod, ...] = ()


def rivals() -> tuple[list[NamedMethod], dict[str, str]]:
    """Return the planners of others that can be asked, and why others cannot."""
    there, missing = [], {}
    for rival in RIVALS:
        try:
            needed_package(class_of(rival.source).package)
        except HybridNavError as error:
            missing[rival.name] = str(error)
        else:
            there.append(rival)
    return there, missing


def parts_of(plan: Plan) -> list[Part]:
    """Return the parts of the study, with all methods that are there."""
    others, _ = rivals()
    samplers = [one for one in others if "ompl" in one.name]
    others = [one for one in others if one not in samplers]
    known = [name for name in BASELINES if name not in plan.without]
    own = [n for n in hn.preset_names() if n not in {REFERENCE, "ompl", *plan.without}]
    by_costs = [name for name in own if load_preset(name).planner.refusal_of_costs() is None]
    knowing = [name for name in known if _takes_costs(BASELINES[name][0])]
    others_knowing = [one for one in others if _takes_costs(one.source)]
    line = load_preset(BESIDE_OMPL, overrides=["planner.smooth=line-of-sight"])
    sampling = [one for one in SAMPLING if one.name not in plan.without and _is_measured("ompl")]
    return [
        Part(
            "lengths",
            tuple(name for name in own if _is_measured(name)),
            tuple(known),
            plan.pairs,
            plan.repeat,
            methods=(*others, *GRAPHS),
        ),
        Part(
            "costs",
            tuple(dict.fromkeys([*by_costs, "octile", "shortest"])),
            tuple(knowing),
            plan.pairs,
            plan.repeat,
            COSTS,
            tuple(others_knowing),
        ),
        Part(
            "ompl",
            (line, "shortest", "paper"),
            (),
            plan.ompl_pairs,
            0,
            methods=(*samplers, *sampling, *(PLACES_FIRST,) * bool(sampling)),
        ),
    ]


def _is_measured(name: str) -> bool:
    """Return whether the harness can ask a preset for lengths here: some need costs, some OMPL."""
    try:
        preset_spec(name)
    except HybridNavError:
        return False
    return True


def _takes_costs(path: str) -> bool:
    made_of: Any = class_of(path)
    return "costs" in inspect.signature(made_of).parameters


def run(  # noqa: PLR0913 - two have defaults
    maps: Sequence[StudyMap],
    folder: Path,
    plan: Plan,
    parts: Sequence[Part],
    *,
    workers: int = 1,
    scheduler: str | None = None,
) -> None:
    """Answer all that is not answered yet, and note how long it took.

    `folder`: gets a folder of records for each part; `plan`: how much to ask; `parts`: the parts to
    run; `workers`, `scheduler`: as in `RunSettings`. Raises `InvalidValueError` when the folder
    holds a study that asked otherwise.
    """
    _check_plan(folder, plan)
    folder.mkdir(parents=True, exist_ok=True)
    for part in parts:
        settings = RunSettings(
            maps=tuple(str(one.path) for one in maps),
            scenarios=tuple(one.scenarios for one in maps),
            presets=part.presets,
            baselines=part.baselines,
            methods=part.methods,
            pairs=part.pairs,
            repeat=part.repeat,
            costs=part.costs,
            workers=workers,
            scheduler=scheduler,
            timeout_s=plan.limit_s + _LATE_S,
            limit_s=plan.limit_s,
        )
        clock = _Clock(folder, plan, part.name)
        made = write_records(settings, folder / part.name, progress=clock.tell)
        clock.note()
        sys.stderr.write(f"{part.name}: {made:,} new records in {clock.seconds:.0f} s\n")


def _check_plan(folder: Path, plan: Plan) -> None:
    own = json.loads(json.dumps(asdict(plan)))
    other = read_note(folder).get("plan", own)
    if other != own:
        raise InvalidValueError(
            f"folder {folder} holds a study of {other['pairs']} pairs a map ({other['name']}), "
            f"this one has {plan.pairs} ({plan.name}): take another folder, or remove that one"
        )


class _Clock:
    """The time of a part: it is noted now and then, so that a run that is stopped counts too."""

    def __init__(self, folder: Path, plan: Plan, part: str) -> None:
        self._folder, self._plan, self._part = folder, plan, part
        self._began = self._told = time.monotonic()
        self._before = read_note(folder).get("seconds", {}).get(part, 0.0)

    @property
    def seconds(self) -> float:
        """Seconds of this run."""
        return time.monotonic() - self._began

    def tell(self, done: int, total: int) -> None:
        """Tell now and then how far the part is."""
        if time.monotonic() - self._told > _SPEAK_S:
            self._told = time.monotonic()
            self.note()
            sys.stderr.write(f"{self._part}: {done:,} of {total:,} records\n")

    def note(self) -> None:
        """Write what was asked, and the seconds of all runs of the part."""
        _, missing = rivals()
        seconds = read_note(self._folder).get("seconds", {})
        new = {
            "plan": asdict(self._plan),
            "ompl": importlib.metadata.version("ompl") if find_spec("ompl") else "",
            "missing": missing,
            "seconds": seconds | {self._part: self._before + self.seconds},
        }
        replace_file(self._folder / RUN_FILE, (json.dumps(new, indent=1) + "\n").encode())


def read_note(folder: Path) -> dict[str, Any]:
    """Return what was noted about the runs into a folder."""
    path = folder / RUN_FILE
    noted: dict[str, Any] = json.loads(path.read_text("utf-8")) if path.exists() else {}
    return noted
