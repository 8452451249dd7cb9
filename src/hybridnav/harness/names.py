"""Names of methods: aliases, classes and the hashes of their sources, lists in YAML files."""

from __future__ import annotations

import difflib
import hashlib
import importlib
import inspect
import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from hybridnav.errors import InvalidValueError, brief

if TYPE_CHECKING:
    from collections.abc import Iterable
    from types import ModuleType

    from hybridnav._base.typing import PathLike

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

_KEYS = ("name", "baseline", "class", "preset", "graph", "settings", "grid")
_SOURCES = _KEYS[1:5]
_HASH_DIGITS = 12
_MOST_LETTERS, _MOST_LETTERS_OF_SETTINGS = 60, 200
_MOST_RADIUS_M = 1e3


@dataclass(frozen=True)
class NamedMethod:
    """One entry of a YAML file of methods.

    Examples
    --------
    >>> from hybridnav.harness import NamedMethod
    >>> NamedMethod("baseline", "weighted A*", settings={"weight": 2.0}).kind
    'baseline'
    """

    kind: str
    """What `source` names: a "baseline", a "class" as module:class, a "preset", or a "graph"."""
    source: str
    name: str = ""
    """Name in tables; empty for that of the source."""
    settings: dict[str, Any] = field(default_factory=dict)
    """Keyword arguments of the class; of a preset, values by dotted key."""
    grid: dict[str, Any] = field(default_factory=dict)
    """Grid of its own, `robot_radius_m` and `corner_cutting`; empty for that of the run. Paths are
    judged on that of the run."""


def baseline_name(name: str, known: Iterable[str]) -> str:
    """Return the baseline of a name or an alias, such as "hpa-star" of "HPA*".

    Raises `InvalidValueError` when there is none; the message names those that look like it.
    """
    plain = "-".join(name.lower().replace("*", "-star").split()).replace("--", "-")
    found = ALIASES.get(plain, plain)
    names = list(known)
    if found in names:
        return found
    if found in _RIVALS:
        raise InvalidValueError(
            f"baseline {found} is no longer in the package: in a checkout write "
            f"benchmarks.{_RIVALS[found]}, or give a class of your own as module:class"
        )
    near = difflib.get_close_matches(found, [*names, *ALIASES], n=1)
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
    # By content alone: a clone elsewhere has the same hash.
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


def load_methods(path: PathLike) -> tuple[NamedMethod, ...]:
    """Read a YAML file of methods.

    Parameters
    ----------
    path
        A file with a list `methods`. Each entry has one of `baseline`, `class`, `preset` and
        `graph`, and may have a `name` and `settings`.

    Returns
    -------
    tuple of NamedMethod
        In the order of the file.

    Raises
    ------
    InvalidValueError
        When the file cannot be read or has another form; the message names the entry.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import load_methods
    >>> _ = Path("methods.yaml").write_text("methods: [{name: taut, preset: shortest}]")
    >>> load_methods("methods.yaml")[0].name
    'taut'
    """
    try:
        content = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
    except OSError as error:
        raise InvalidValueError(f"methods {path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise InvalidValueError(f"methods {path}: {' '.join(str(error).split())}") from None
    entries = content.get("methods") if isinstance(content, dict) else None
    if not isinstance(entries, list) or not entries:
        raise InvalidValueError(f"methods {path}: expected a list under the key methods")
    methods = tuple(
        _entry(entry, f"methods {path}, entry {at}") for at, entry in enumerate(entries, 1)
    )
    names = [method.name or method.source for method in methods]
    twice = [name for name in names if names.count(name) > 1]
    if twice:
        raise InvalidValueError(f"methods {path}: two are called {twice[0]}: set a name for each")
    return methods


def _entry(entry: Any, where: str) -> NamedMethod:
    if not isinstance(entry, dict):
        raise InvalidValueError(f"{where}: expected keys and values, got {brief(entry)}")
    unknown = [key for key in entry if key not in _KEYS]
    if unknown:
        raise InvalidValueError(
            f"{where}: no key {brief(unknown[0])}: there are {', '.join(_KEYS)}"
        )
    kinds = [key for key in _SOURCES if key in entry]
    if len(kinds) != 1:
        raise InvalidValueError(f"{where}: expected one of {', '.join(_SOURCES)}, got {kinds}")
    source, name = entry[kinds[0]], entry.get("name", "")
    if not isinstance(source, str) or not isinstance(name, str):
        raise InvalidValueError(f"{where}: {kinds[0]} and name must be texts")
    if kinds[0] == "class" and ":" not in source:
        raise InvalidValueError(f"{where}: class {brief(source)} must be written module:class")
    settings = entry.get("settings") or {}
    if not isinstance(settings, dict) or not all(isinstance(key, str) for key in settings):
        raise InvalidValueError(f"{where}: settings must be keys with values")
    try:
        json.dumps(settings, sort_keys=True)
    except TypeError as error:
        raise InvalidValueError(f"{where}: settings must be numbers and texts: {error}") from None
    try:
        grid = _checked_grid(entry.get("grid") or {})
    except InvalidValueError as error:
        raise InvalidValueError(f"{where}: {error}") from None
    return NamedMethod(kinds[0], source, " ".join(name.split())[:_MOST_LETTERS], settings, grid)


def _checked_grid(given: Any) -> dict[str, Any]:
    """Return the settings of a grid of its own as a file of methods states them.

    Raises
    ------
    InvalidValueError
        When a key or a value is not known.
    """
    if not isinstance(given, dict) or given.keys() - {"robot_radius_m", "corner_cutting"}:
        raise InvalidValueError(
            f"grid has the keys robot_radius_m, in metres, and corner_cutting, got {brief(given)}"
        )
    radius = given.get("robot_radius_m", 0)
    is_number = isinstance(radius, (int, float)) and not isinstance(radius, bool)
    if not is_number or not 0 <= radius <= _MOST_RADIUS_M:
        raise InvalidValueError(f"grid: robot_radius_m is a number of metres, got {brief(radius)}")
    if not isinstance(given.get("corner_cutting", False), bool):
        raise InvalidValueError(
            f"grid: corner_cutting is true or false, got {brief(given['corner_cutting'])}"
        )
    return dict(given)
