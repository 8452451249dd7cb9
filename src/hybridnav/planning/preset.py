"""Presets: how to build a pyramid and how to plan on it, in YAML files that are checked. Public:
`planner_settings`.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Any, get_args

import yaml
from pydantic import ValidationError

from hybridnav._base.files import printable
from hybridnav._base.yaml_file import parse_value, read_yaml
from hybridnav.errors import InvalidValueError, PresetError, PresetNotFoundError, brief
from hybridnav.planning.settings import (
    METHODS,
    SECTIONS,
    AnyMethod,
    LimitSettings,
    PaperSettings,
    PlannerSettings,
    PyramidSettings,
    Section,
    method_of,
)

if TYPE_CHECKING:  # they load numpy, which the commands on presets need not
    from hybridnav._base.typing import PathLike
    from hybridnav.maps import OccupancyGrid

_PACKAGE = Path(__file__).parents[1]
_FOLDERS = (_PACKAGE / "presets", _PACKAGE.parents[1] / "planners")
"""Folders of presets: inside an installed package, or beside `src` in a checkout."""


class Preset(Section):
    """A planner's configuration: sections `pyramid`, `planner` and `limits`, and its purpose.

    Examples
    --------
    >>> print(hn.load_preset("paper").to_yaml().splitlines()[0])
    description: max-distance arcs, down the levels, grid A*
    """

    name: str = "custom"
    description: str = ""
    pyramid: PyramidSettings = PyramidSettings()
    planner: AnyMethod = PaperSettings()
    limits: LimitSettings | None = None
    """How fast the robot drives; None for plans without durations."""

    def to_yaml(self) -> str:
        """Return the preset as the text of a YAML file, every key present."""
        # Unless it escapes them, PyYAML reads back line breaks such as U+0085 as spaces.
        plain = self.description.isprintable()
        tree = self.model_dump(exclude={"name"})
        tree["planner"] = {"method": self.planner.method, **tree["planner"]}  # the method first
        return yaml.safe_dump(tree, sort_keys=False, allow_unicode=plain)


def planner_settings(method: str = "paper", **settings: Any) -> PlannerSettings:
    """Return the section of a method.

    Parameters
    ----------
    method
        Its name.
    **settings
        Keys of its section.

    Raises
    ------
    PresetError
        When there is no such method, a key is unknown or a value is out of range.

    Examples
    --------
    >>> from hybridnav.planning import planner_settings
    >>> planner_settings("shortest", epsilon=0.02).epsilon
    0.02
    """
    return _checked({"planner": {"method": method, **settings}}, where="").planner


def preset_names() -> list[str]:
    """Return the names of the presets in the package, in alphabetical order.

    Examples
    --------
    >>> hn.preset_names()[:3]
    ['grid-astar', 'octile', 'ompl']
    """
    return sorted({file.stem for folder in _FOLDERS for file in folder.glob("*.yaml")})


def is_preset_name(source: PathLike) -> bool:
    """Return whether this is the name of a preset; with a suffix or a separator it is a path.

    `source`: what was given for a preset. Returns whether it is a name; there need not be such a
    preset.
    """
    text = os.fspath(source)
    separators = [mark for mark in (os.sep, os.altsep) if mark is not None]
    return not Path(text).suffix and not any(mark in text for mark in separators)


def load_preset(source: PathLike | Preset, *, overrides: Iterable[str] = ()) -> Preset:
    """Read a preset by name or from a file and check it.

    Parameters
    ----------
    source
        Name of a preset that comes with the package, or a path to a YAML file: anything with a
        suffix or a separator is a path. A `Preset` stays as it is.
    overrides
        Settings that win over the file, each `section.key=value`, the value in YAML; checked
        together.

    Raises
    ------
    PresetNotFoundError
        When there is no such preset or file; the message lists existing ones.
    PresetError
        When a key is unknown or a value is out of range; the message names the key and its place.

    Examples
    --------
    >>> preset = hn.load_preset("robot", overrides=["planner.turning_radius_m=0.5"])
    >>> preset.planner.turning_radius_m
    0.5
    """
    preset = source if isinstance(source, Preset) else _read(_find(source))
    tree, given = preset.model_dump(), list(overrides)
    for override in given:
        _apply(tree, override)
    method = method_of(tree["planner"])
    if method != method_of(preset.planner) and method in SECTIONS:
        # Keys of the method before go, unless they are given.
        stated = {text.partition("=")[0].strip().split(".")[1] for text in given}
        keys = {*stated, *SECTIONS[method].model_fields}
        tree["planner"] = {key: one for key, one in tree["planner"].items() if key in keys}
    # All at once, for some keys go only together.
    return _checked(tree, where="setting ") if given else preset


def _read(path: Path) -> Preset:
    tree = read_yaml(path, what="preset", error=PresetError, missing=PresetNotFoundError)
    where = f"preset {printable(path)}: "
    if "name" in tree:
        raise PresetError(f"{where}name: a preset is named after its file, remove this key")
    return _checked({**tree, "name": path.stem}, where=where)


def _find(source: PathLike) -> Path:
    if not is_preset_name(source):
        return Path(source)
    name = os.fspath(source)
    if name in preset_names():
        return next(file for f in _FOLDERS if (file := f / f"{name}.yaml").is_file())
    raise PresetNotFoundError(
        f"no preset is called {brief(name)}: there are {', '.join(preset_names())}; "
        "a file is given by its path, with .yaml"
    )


def _apply(tree: dict[str, Any], override: str) -> None:
    key, equals, text = override.partition("=")
    section, dot, name = key.strip().partition(".")
    if not (equals and dot and name and isinstance(tree.get(section, ""), dict | None)):
        sections = " or ".join(key for key, one in tree.items() if isinstance(one, dict | None))
        raise PresetError(
            f"setting {brief(override)}: expected section.key=value, section {sections}"
        )
    *inner, name = name.split(".")
    branch = tree[section] = tree[section] or {}
    for part in inner:
        if part in branch and not isinstance(branch[part], dict | None):
            raise PresetError(f"setting {printable(key)}: unknown key; {part} is no section")
        branch[part] = branch.get(part) or {}
        branch = branch[part]
    try:
        branch[name] = parse_value(text)
    except (yaml.YAMLError, ValueError, RecursionError):
        raise PresetError(
            f"setting {printable(key)}: the value is not YAML: {brief(text)}"
        ) from None


def _checked(tree: dict[str, Any], *, where: str) -> Preset:
    try:
        return Preset.model_validate(tree)
    except ValidationError as error:
        raise PresetError(f"{where}{_first_problem(error)}") from None


def _first_problem(error: ValidationError) -> str:
    problem = error.errors(include_url=False)[0]
    place, given = problem["loc"], problem["input"]
    if len(place) > 1 and place[0] == "planner" and place[1] in SECTIONS:
        place = (place[0], *place[2:])  # without the tag of the method
    key = printable(".".join(map(str, place)))
    if problem["type"] == "extra_forbidden":
        return f"{key}: {_known_keys(problem['loc'][:-1], str(place[-1]))}"
    if problem["type"] == "union_tag_invalid":
        if not isinstance(given, dict):
            return f"{key}: expected a section with keys, got {brief(given)}"
        method = given.get("method")
        known = ", ".join(map(repr, METHODS))
        return (
            f"{key}.method: should be one of {known} or a class of your own, module:Class, "
            f"got {brief(method)}"
        )
    if problem["type"] in {"model_type", "union_tag_not_found"}:
        expected = "expected a section with keys"
    else:
        text = problem["msg"].partition(", unable to")[0].partition(", got")[0]
        expected = text[:1].lower() + text[1:]
    if isinstance(given, dict):  # a check of several keys names what it found itself
        return f"{key}: {expected.removeprefix('input ')}"
    shown = "nothing" if given is None else brief(given)
    return f"{key}: {expected.removeprefix('input ')}, got {shown}"


def _known_keys(section: tuple[int | str, ...], key: str) -> str:
    """Return what is wrong with a key, and the keys of its section, by the place of an error."""
    model: Any = Preset
    for depth, part in enumerate(section):
        if section[0] == "planner" and depth < 2:  # noqa: PLR2004 - the method is its tag
            model = SECTIONS.get(str(part))
        else:
            annotation = model.model_fields[str(part)].annotation
            models = [kind for kind in get_args(annotation) if kind is not NoneType]
            model = models[0] if models else annotation
    names = ", ".join(name for name in model.model_fields if name != "name")
    if len(section) != 2 or section[0] != "planner":  # noqa: PLR2004
        return f"unknown key; known are {names}"
    with_it = ", ".join(method for method in METHODS if key in SECTIONS[method].model_fields)
    wrong = f"no key of method {section[1]}, but of {with_it}" if with_it else "unknown key"
    return f"{wrong}; {section[1]} has {names}"


# Check of the robot's radius, which map and preset both state.


def check_radius(grid: OccupancyGrid, preset: Preset) -> None:
    """Refuse a map of the default radius with a preset for another radius.

    A radius that the caller chose for the map wins over the preset's, and results record it.

    Raises `InvalidValueError` when the map has the default radius, not chosen by the caller, and
    the preset names another.
    """
    wanted_m, radius_m = preset.pyramid.robot_radius_m, grid.robot_radius_m
    if grid.radius_is_default and wanted_m != radius_m:
        raise InvalidValueError(
            f"preset {preset.name} is for a robot radius of {wanted_m} m, the map was made with "
            f"the default of {radius_m} m: make it with robot_radius_m={wanted_m}, or with "
            f"robot_radius_m={radius_m} if that is meant"
        )
