"""Names of methods: baselines, aliases, classes and the hashes of their sources, and what names one
with all its settings. Public: `NamedMethod`.
"""

from __future__ import annotations

import difflib
import hashlib
import importlib
import inspect
import json
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any

from hybridnav.errors import InvalidValueError, brief
from hybridnav.planning import Metric

REFERENCE = "grid-astar"
"""The baseline whose lengths are the optimum; part of every run."""

LINE_OF_SIGHT = "line-of-sight"
"""Value of `planner.smooth`; added to the names of presets that have it, as in
`octile+line-of-sight`."""

BASELINES: dict[str, tuple[str, dict[str, Any]]] = {
    "grid-astar": ("hybridnav.harness.baselines.grid:GridAstar", {}),
    "grid-dijkstra": ("hybridnav.harness.baselines.grid:GridDijkstra", {}),
    "weighted-astar": ("hybridnav.harness.baselines.grid:WeightedAstar", {}),
    "hpa-star": ("benchmarks.baselines.hpa:HpaStar", {}),
    "hpa-star-raw": ("benchmarks.baselines.hpa:HpaStar", {"smooth": False}),
    "hpa-star-lines": ("benchmarks.baselines.hpa:HpaStar", {"line_cells": 1000}),
    "simple-graph": ("hybridnav.harness.baselines.regions:SimpleGraphPyramid", {}),
    "thrun": ("benchmarks.baselines.thrun:ThrunMap", {}),
}
"""Class of each baseline and its options; those named in `ON_PLACES` are made from a
`TopologicalMap`, the others from an `OccupancyGrid`. Those in `benchmarks` are in a checkout alone.
Work outside this package names its own class as `module:class`."""

RECORDED = "hybridnav.harness.recorded_method:RecordedMethod"
"""The class of recorded paths."""

ON_PLACES = frozenset({"simple-graph"})

ALIASES = {
    "a-star": "grid-astar",
    "astar": "grid-astar",
    "dijkstra": "grid-dijkstra",
    "weighted-a-star": "weighted-astar",
    "wa-star": "weighted-astar",
    "hpa": "hpa-star",
    "thrun-1998": "thrun",
}
"""Other names of baselines, as the literature writes them, in small letters, "-" for blanks and
"-star" for "*"."""

_RIVALS = {
    "extremitypathfinder": "rivals_any_angle:ExtremityPathfinder",
    "nano-astar": "rivals:NanoAstar",
    "networkx": "rivals:Networkx",
    "ompl-whole": "rivals_any_angle:OmplWhole",
    "ompl-whole-prmstar": "rivals_any_angle:OmplWhole with settings: {planner: PRMstar}",
    "pyastar2d": "rivals:Pyastar2d",
    "pyroutingkit": "rivals:RoutingKit",
    "tcod": "rivals:Tcod",
}
"""Planners of others, which were baselines by these names: their classes in `benchmarks`."""

_HASH_DIGITS = 12
_MOST_LETTERS, _MOST_LETTERS_OF_SETTINGS = 60, 200


@dataclass(frozen=True)
class NamedMethod:
    """A method of a run with a name and settings of its own, for `RunSettings.methods`.

    Examples
    --------
    >>> from hybridnav.harness import NamedMethod
    >>> NamedMethod("baseline", "weighted A*", settings={"weight": 2.0}).kind
    'baseline'
    """

    kind: str
    """What `source` names: a "baseline", a "class" as module:class, a "preset", a "graph", or the
    folder of "recorded" paths."""
    source: str
    name: str = ""
    """Name in tables; empty for that of the source."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Keyword arguments of the class; of a preset, values by dotted key; of recorded paths `unit`
    and `frame`, see `load_paths`."""


def baseline_name(name: str, choices: Iterable[str]) -> str:
    """Return the baseline of a name or an alias, such as "hpa-star" of "HPA*".

    Raises `InvalidValueError` when there is none; the message names those that look like it.
    """
    plain = "-".join(name.lower().replace("*", "-star").split()).replace("--", "-")
    current = ALIASES.get(plain, plain)
    names = list(choices)
    if current in names:
        return current
    if current in _RIVALS:
        raise InvalidValueError(
            f"baseline {current} is no longer in the package: in a checkout write "
            f"benchmarks.{_RIVALS[current]}, or give a class of your own as module:class"
        )
    near = difflib.get_close_matches(current, [*names, *ALIASES], n=1)
    hint = f" (did you mean {near[0]}?)" if near else ""
    raise InvalidValueError(
        f"no baseline is called {brief(name)}{hint}: there are {', '.join(names)}, or module:class"
    )


def class_of(path: str) -> Any:
    """Return the class of a path `module:class`.

    Raises `InvalidValueError` when it cannot be imported; the last line of the reason.
    """
    module, _, attribute = path.partition(":")
    try:
        return getattr(importlib.import_module(module), attribute)
    except Exception as error:  # a module of others may fail in any way
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        if module.startswith("benchmarks.") and "benchmarks" not in sys.modules:
            reason += "; it is in a checkout alone: set PYTHONPATH to its folder"
        raise InvalidValueError(f"baseline {path}: {reason}") from error


def source_hash(path: str) -> str:
    """Return a short hash of the files of a class `module:class`, as they are on the disk now.

    They are that of its module, and those that it imports from the same folder or the same package,
    and these in turn. Imports inside functions are not seen. Empty for a module without a file.
    """
    files = _files_of(sys.modules.get(path.partition(":")[0]))
    if not files:
        return ""
    return content_hash(files)


def content_hash(files: Iterable[Path]) -> str:
    """Return a short hash of files, by content alone: a clone elsewhere has the same hash."""
    parts = sorted(hashlib.sha256(file.read_bytes()).hexdigest() for file in files)
    whole = parts[0] if len(parts) == 1 else hashlib.sha256("".join(parts).encode()).hexdigest()
    return whole[:_HASH_DIGITS]


def _files_of(module: ModuleType | None) -> set[Path]:
    """Return the files of a module, and of those beside it and in its package that it imports."""
    files: set[Path] = set()
    waiting, seen = [module], {module}
    while waiting:
        one = waiting.pop()
        file = getattr(one, "__file__", None)
        if one is None or file is None or not Path(file).is_file():
            continue
        files.add(Path(file))
        for value in vars(one).values():
            name = getattr(value, "__name__" if inspect.ismodule(value) else "__module__", None)
            other = sys.modules.get(name) if isinstance(name, str) else None
            if other is not None and other not in seen and _is_beside(other, one):
                seen.add(other)
                waiting.append(other)
    return files


def _is_beside(other: ModuleType, module: ModuleType) -> bool:
    """Return whether two modules are of one package, or lie in one folder."""
    package = module.__name__.partition(".")[0]
    if "." in module.__name__ and other.__name__.partition(".")[0] == package:
        return True
    files = [getattr(one, "__file__", None) for one in (other, module)]
    return all(files) and Path(str(files[0])).parent == Path(str(files[1])).parent


def own_name(method: Any) -> str:
    """Return the name that a method gives itself, on one line; empty for none."""
    name = getattr(method, "name", "")
    return " ".join(name.split())[:_MOST_LETTERS] if isinstance(name, str) else ""


def own_settings(method: Any) -> str:
    """Return the settings that a method states in its `settings`, on one line; empty for none."""
    words = getattr(method, "settings", "")
    return " ".join(words.split())[:_MOST_LETTERS_OF_SETTINGS] if isinstance(words, str) else ""


@dataclass(frozen=True)
class MethodSpec:
    """A method to build: a preset or a baseline, and the pyramid under it. Plain values, so that it
    can go to another process."""

    name: str
    preset: dict[str, Any] | None
    """The preset's sections; None for a baseline."""
    pyramid: dict[str, Any] = field(default_factory=dict)
    """merge_distance_m, linkage, seed: of the places that it plans on."""
    graph: Any = None
    """The `WaypointGraph` whose routes it follows, if that is all that it does; None for others."""
    clear_edges_only: bool = False
    """Whether edges of the graph that the robot cannot follow are left out."""
    factory: str = ""
    """The baseline, or the class as `module:class`, that makes it; empty for that of its name."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Keyword arguments of its class."""
    source: str = ""
    """Hash of the file of a class of others: a class that was mended is another method."""
    label: str = ""
    """Name that a class of others gives itself, as far as known before it is made; else empty."""

    @property
    def made_by(self) -> str:
        """The baseline, or the class as `module:class`."""
        return self.factory or self.name

    @property
    def is_recorded(self) -> bool:
        """Whether its paths were recorded: it has no times, and answers on its own map alone."""
        return self.made_by == RECORDED

    @property
    def metric(self) -> Metric:
        """Metric of its paths; octile for baselines, even for those whose answers have an
        `any_angle` path."""
        if self.graph is not None or self.is_recorded:
            return "any-angle"
        planner = (self.preset or {}).get("planner", {})
        settings = (
            ("method", "ompl"),
            ("smooth", LINE_OF_SIGHT),
            ("smooth", "arcs"),
            ("method", "shortest"),
        )
        is_any_angle = any(planner.get(key) == value for key, value in settings)
        return "any-angle" if is_any_angle else "octile"

    @cached_property
    def digest(self) -> str:
        """Short hash of all settings, part of every record's id."""
        parts: list[Any] = [self.name, self.preset, self.pyramid]
        if self.graph is not None:
            parts += [self.graph.digest, self.clear_edges_only]
        if self.factory or self.settings or self.source:
            parts += [self.factory, self.settings, self.source]
        text = json.dumps(parts, sort_keys=True)
        return hashlib.sha256(text.encode()).hexdigest()[:12]

    @property
    def who(self) -> str:
        """What has its name: the hash of a class of others with its settings, mended or not; the
        name itself of other methods."""
        return replace(self, source="").digest if self.source else self.name
