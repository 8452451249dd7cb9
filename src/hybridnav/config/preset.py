"""Presets: how to build a pyramid and how to plan on it, in YAML files that are checked."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from hybridnav.config.yaml_file import read_yaml
from hybridnav.errors import PresetError, PresetNotFoundError

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._typing import PathLike

_PACKAGE = Path(__file__).parents[1]
_FOLDERS = (_PACKAGE / "presets", _PACKAGE.parents[1] / "planners")
"""Where presets are: inside an installed package, or beside `src` in a checkout."""


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=True)


class PyramidSettings(_Section):
    """Section `pyramid`: how the map is inflated and contracted."""

    merge_distance_m: Annotated[float, Field(gt=0)] = 4.0
    """U_d in metres, infinity (.inf) allowed."""
    linkage: Literal["radius"] = "radius"
    """What stays below U_d."""
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 0
    """Breaks ties."""
    robot_radius_m: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.25
    """Radius by which occupied cells are inflated, in metres."""


class PlannerSettings(_Section):
    """Section `planner`: coarse search, corridor, refinement."""

    coarse: Literal["max-distance", "none"] = "max-distance"
    """Cost of an arc in the coarse search; `none` makes the whole map the corridor."""
    corridor: Literal["route", "neighbours"] = "route"
    """Fields the refiner may stand on: those of the route, or also their neighbours'."""
    refine: Literal["grid-astar"] = "grid-astar"
    """How a path is found inside the corridor."""
    allow_unexplored: bool = False
    """Whether unexplored cells may be entered."""


class Preset(_Section):
    """A planner's configuration: sections `pyramid` and `planner`, and what it is for."""

    name: str = "custom"
    description: str = ""
    pyramid: PyramidSettings = PyramidSettings()
    planner: PlannerSettings = PlannerSettings()

    def to_yaml(self) -> str:
        """The preset as a YAML file would give it, every key present."""
        text: str = yaml.safe_dump(
            self.model_dump(exclude={"name"}), sort_keys=False, allow_unicode=True
        )
        return text


def preset_names() -> list[str]:
    """Names of the presets that come with the package, in alphabetical order."""
    return sorted({file.stem for folder in _FOLDERS for file in folder.glob("*.yaml")})


def load_preset(source: PathLike | Preset, *, overrides: Iterable[str] = ()) -> Preset:
    """Read a preset by name or from a file and check it.

    Parameters
    ----------
    source
        Name of a preset that comes with the package, or a path to a YAML file: anything with a
        suffix or a separator is a path. A `Preset` is taken as it is.
    overrides
        Settings that win over the file, each `section.key=value`, the value in YAML.

    Raises
    ------
    PresetNotFoundError
        When there is no such preset or file; names the ones there are.
    PresetError
        When a key is unknown or a value is out of range; names the key and where it stands.
    """
    if isinstance(source, Preset):
        tree, name, where = source.model_dump(exclude={"name"}), source.name, source.name
    else:
        path = _find(source)
        tree, name, where = _read(path), path.stem, str(path)
    for override in overrides:
        _apply(tree, override)
    if "name" in tree:
        raise PresetError(f"{where}: name: a preset is named after its file, remove this key")
    try:
        return Preset.model_validate({**tree, "name": name})
    except ValidationError as error:
        raise PresetError(f"{where}: {_first_problem(error)}") from None


def _read(path: Path) -> dict[str, Any]:
    return read_yaml(path, what="preset", error=PresetError, missing=PresetNotFoundError)


def _find(source: PathLike) -> Path:
    path = Path(source)
    if path.suffix or len(path.parts) != 1:
        return path
    for folder in _FOLDERS:
        if (file := folder / f"{path.name}.yaml").is_file():
            return file
    raise PresetNotFoundError(
        f"no preset is called {path.name!r}: there are {', '.join(preset_names())}; "
        "a file is given by its path, with .yaml"
    )


def _apply(tree: dict[str, Any], override: str) -> None:
    key, equals, text = override.partition("=")
    section, dot, name = key.strip().partition(".")
    if not (equals and dot and section and name):
        raise PresetError(f"a setting reads section.key=value, got {override!r}")
    try:
        value = yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        raise PresetError(f"{key}: the value is not YAML: {text[:80]!r}") from None
    target = tree.setdefault(section, {})
    if not isinstance(target, dict):
        raise PresetError(f"{section}: expected a section with keys, got {target!r:.80}")
    target[name] = value


def _first_problem(error: ValidationError) -> str:
    problem = error.errors(include_url=False)[0]
    key = ".".join(str(part) for part in problem["loc"]) or "preset"
    given = problem["input"]
    if problem["type"] == "extra_forbidden":
        return f"{key}: unknown key; {_known_keys(problem['loc'][:-1])}"
    if isinstance(given, float) and math.isnan(given):
        given = "nan"
    return f"{key}: {problem['msg'][0].lower()}{problem['msg'][1:]}, got {str(given)[:80]!r}"


def _known_keys(section: tuple[int | str, ...]) -> str:
    model: Any = Preset
    for part in section:
        model = model.model_fields[str(part)].annotation
    names = [name for name in model.model_fields if name != "name"]
    return f"known are {', '.join(names)}"
