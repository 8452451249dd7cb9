"""From maps and methods to a study in one call. Public: `evaluate`."""

import os
import tempfile
from collections.abc import Iterable
from contextlib import nullcontext
from pathlib import Path
from typing import Any, overload

from hybridnav._base.typing import PathLike
from hybridnav.errors import InvalidValueError, renamed
from hybridnav.harness.analysis import Study, load_study
from hybridnav.harness.names import NamedMethod
from hybridnav.harness.run import RunSettings, write_records
from hybridnav.planning import Preset, preset_names

Method = str | Preset | NamedMethod | type
"""What `evaluate` takes for a method."""
_ONE = (str, os.PathLike, Preset, NamedMethod, type)


@overload
def evaluate(maps: RunSettings, methods: PathLike, **settings: Any) -> int: ...
@overload
def evaluate(
    maps: PathLike | Iterable[PathLike],
    methods: str | Iterable[Method] = ...,
    *,
    folder: PathLike | None = ...,
    **settings: Any,
) -> Study: ...
def evaluate(
    maps: PathLike | Iterable[PathLike] | RunSettings,
    methods: str | Iterable[Method] | PathLike = "shortest",
    *,
    folder: PathLike | None = None,
    **settings: Any,
) -> Study | int:
    r"""Measure methods on maps: all answer the same pairs, and every answer is judged.

    A script calls it under `if __name__ == "__main__":`, as it starts processes.

    Parameters
    ----------
    maps
        A map file, or several.
    methods
        A method, or several: names of presets, files of presets, names of baselines, `module:Class`
        or the class itself, a `Preset`, a `NamedMethod`. A* on the whole grid is always among them.
    folder
        Where the records stay, to go on with them later; by default they are not kept.
    **settings
        What else `RunSettings` has: `pairs`, `seed`, `robot_radius_m`, `costs`, `workers`.

    Returns
    -------
    Study
        It prints as a table; `plot_losses` draws it, and `to_latex` returns the table for a paper.

    Raises
    ------
    InvalidValueError
        When there is no such method, or a setting is out of range.
    MapError, PresetError
        When a map or a preset cannot be read.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("hall.map").write_text("type octile\nheight 2\nwidth 3\nmap\n...\n.@.\n")
    >>> study = hn.evaluate("hall.map", "octile", pairs=5)
    >>> study.labels, study.faults
    (['grid-astar', 'octile'], [])
    """
    several: Any = [methods] if isinstance(methods, _ONE) else methods
    if isinstance(maps, RunSettings):  # as it was called before 0.2
        renamed("evaluate(RunSettings(...), folder)", "harness.write_records(...)")
        return write_records(maps, several[0], **settings)
    files = [maps] if isinstance(maps, str | os.PathLike) else list(maps)
    kinds: dict[str, list[Any]] = {"presets": [], "baselines": [], "methods": []}
    for method in several:
        kind, read = _read(method)
        kinds[kind].append(read)
    given: dict[str, Any] = settings | {kind: tuple(named) for kind, named in kinds.items()}
    run = RunSettings(maps=tuple(map(str, files)), **given)
    kept = tempfile.TemporaryDirectory() if folder is None else nullcontext(str(folder))
    with kept as where:
        write_records(run, where)
        return load_study(where)


def _read(method: object) -> tuple[str, Any]:
    """Return the field of `RunSettings` for a method, and what stands there."""
    if isinstance(method, os.PathLike):
        method = str(method)
    if isinstance(method, Preset):
        return "presets", method
    if isinstance(method, NamedMethod):
        return "methods", method
    if isinstance(method, type):
        if method.__module__ == "__main__" or "." in method.__qualname__:
            raise InvalidValueError(
                f"class {method.__qualname__} stands where no other process can import it: write "
                "it at the top of a file of its own, and import it from there"
            )
        return "baselines", f"{method.__module__}:{method.__qualname__}"
    if not isinstance(method, str):
        raise InvalidValueError(
            f"a method is a name, a preset or a class, got {method!r:.80}: see `RunSettings`"
        )
    is_preset = method in preset_names() or Path(method).suffix.lower() in {".yaml", ".yml"}
    return "presets" if is_preset else "baselines", method
