"""Names of methods: aliases, classes and the hashes of their sources."""

import difflib
import hashlib
import importlib
import inspect
import sys
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from hybridnav.errors import InvalidValueError, brief

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
