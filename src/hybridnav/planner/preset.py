"""Presets: how to build a pyramid and how to plan on it, in YAML files that are checked."""

from __future__ import annotations

import os
import re
import warnings
from pathlib import Path
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, get_args

import yaml
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)
from pydantic_core import PydanticCustomError

from hybridnav._base.files import printable
from hybridnav._base.yaml_file import parse_value, read_yaml
from hybridnav.errors import PresetError, PresetNotFoundError, brief
from hybridnav.maps.limits import DEFAULT_ROBOT_RADIUS_M
from hybridnav.refine.ompl.settings import OmplSettings  # noqa: TC001 - pydantic reads it

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._base.typing import PathLike

_PACKAGE = Path(__file__).parents[1]
_FOLDERS = (_PACKAGE / "presets", _PACKAGE.parents[1] / "planners")
"""Folders of presets: inside an installed package, or beside `src` in a checkout."""


_REFINED_BY = {
    "max-distance": "grid-astar",
    "mesh": "none",
    "jumps": "none",
    "overlay": "none",
    "none": "grid-astar",
}
"""What refines each coarse search; OMPL refines them all."""

_OLD_NAMES = {
    "ompl-rrtconnect": "RRTConnect",
    "ompl-rrtstar": "RRTstar",
    "ompl-informed-rrtstar": "InformedRRTstar",
    "ompl-bitstar": "BITstar",
    "ompl-prmstar": "PRMstar",
}
"""Presets of earlier versions, which were `ompl` with one of OMPL's planners each."""

_REFINERS = ("grid-astar", "ompl", "none")
_OWN = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*")


def _no_boolean(value: Any) -> Any:
    """Refuse a YAML `yes` or `on` where a number belongs; Python would call it 1."""
    if isinstance(value, bool):
        raise PydanticCustomError("number_type", "input should be a number")
    return value


def _known_refiner(refine: str) -> str:
    """Refuse what is neither a refiner of the package nor written like the name of a class."""
    if refine in _REFINERS or _OWN.fullmatch(refine):
        return refine
    if refine == "gates":
        raise PydanticCustomError("renamed", "gates is now called none: write refine: none")
    known = ", ".join(map(repr, _REFINERS))
    raise PydanticCustomError(
        "refiner", f"input should be {known} or a class of your own, module:Class"
    )


_Float = Annotated[float, BeforeValidator(_no_boolean)]
_Int = Annotated[int, BeforeValidator(_no_boolean)]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=True)


class PyramidSettings(_Section):
    """Section `pyramid`: how the map is inflated and contracted.

    Examples
    --------
    >>> from hybridnav.planner import PyramidSettings
    >>> PyramidSettings(merge_distance_m=2.0).linkage
    'radius'
    """

    merge_distance_m: Annotated[_Float, Field(gt=0)] = 4.0
    """U_d in metres, infinity (.inf) allowed."""
    linkage: Literal["survivor", "radius", "diameter"] = "radius"
    """What stays below U_d."""
    seed: Annotated[_Int, Field(ge=0, lt=2**32)] = 0
    """Breaks ties."""
    robot_radius_m: Annotated[_Float, Field(ge=0, allow_inf_nan=False)] = DEFAULT_ROBOT_RADIUS_M
    """Radius by which occupied cells are inflated, in metres."""


class ClearanceSettings(_Section):
    """Section `planner.costs.clearance`: factors by Nav2's inflation, see `CostLayer.clearance`.

    Examples
    --------
    >>> from hybridnav.planner import ClearanceSettings
    >>> ClearanceSettings(multiplier=3.0).scaling
    3.0
    """

    inflation_radius_m: Annotated[_Float, Field(ge=0, allow_inf_nan=False)] = 0.70
    """Distance from obstacles up to which cells cost more, in metres."""
    scaling: Annotated[_Float, Field(ge=0, allow_inf_nan=False)] = 3.0
    """How quickly costs fall off, 1 / m: `cost_scaling_factor`."""
    inscribed_radius_m: Annotated[_Float, Field(ge=0, allow_inf_nan=False)] | None = None
    """Distance from which they fall off, in metres; null for the radius of the robot."""
    multiplier: Annotated[_Float, Field(ge=0, le=991)] = 2.0
    """Factor above 1 of a cell at the inscribed radius."""


class CostSettings(_Section):
    """Section `planner.costs`: what makes a metre in a cell cost more than a metre.

    Examples
    --------
    >>> from hybridnav.planner import CostSettings
    >>> print(CostSettings().clearance)
    None
    """

    clearance: ClearanceSettings | None = None
    """Distance from obstacles; null for no such costs."""


class PlannerSettings(_Section):
    """Section `planner`: coarse search, corridor, refinement.

    Examples
    --------
    >>> from hybridnav.planner import PlannerSettings
    >>> PlannerSettings(coarse="jumps", refine="none").coarse
    'jumps'
    """

    coarse: Literal["max-distance", "mesh", "jumps", "overlay", "none"] = "max-distance"
    """Structure to plan on. `max-distance`: the places, by that attribute of their arcs, which
    chooses the route. `mesh`: convex polygons of free space. `jumps`: the corner cells at which
    shortest paths of cells turn. `overlay`: exact costs between the border cells of fields on
    several levels of the pyramid. `none`: the cells of the whole map. All but the first derive the
    route from the path. For `portals`, which is gone, `jumps` is taken with a warning, and
    `overlay` with costs."""
    corridor: Literal["route", "neighbours"] = "route"
    """Fields in which `grid-astar` and `ompl` begin: those of the coarse route, or also their
    neighbours. It has no effect with `refine: none` and `coarse: none`."""
    refine: Annotated[str, AfterValidator(_known_refiner)] = "grid-astar"
    """Search for the path. `grid-astar`: cell by cell in the corridor. `ompl`: by a sampling-based
    planner. `none`: the coarse search has found it, on the mesh, the corner cells or the overlay.
    In place of `grid-astar`, `module:Class` names a refiner of your own, which is imported when a
    planner is made."""
    ompl: OmplSettings | None = None
    """With `refine: ompl`, a section of its own; otherwise null."""
    epsilon: Annotated[_Float, Field(ge=0, le=1)] | None = None
    """With `refine: none`, on the mesh and the overlay: the search ends once no path
    can be better by more than this part; null or 0 for the optimum."""
    budget_s: Annotated[_Float, Field(ge=0)] | None = None
    """On the mesh: seconds after which a query returns the best path so far, with its proved bound;
    null for no limit. Until the planner is prepared, such queries shorten a path of cells by line
    of sight."""
    smooth: Literal["none", "line-of-sight", "arcs"] = "none"
    """Whether the path is shortened to an any-angle one; `arcs`, which goes with costs, also rounds
    its bends."""
    turning_radius_m: Annotated[_Float, Field(gt=0, allow_inf_nan=False)] = 0.3
    """With `smooth: arcs`, the least radius of an arc in metres; where none fits, the robot turns
    on the spot."""
    allow_unexplored: bool = False
    """Whether unexplored cells may be entered."""
    costs: CostSettings | None = None
    """With `refine: grid-astar`, and with `coarse: overlay`, factors by which metres
    cost more; the path is the cheapest one. null makes costs lengths."""

    def refusal_of_costs(self) -> str | None:
        """Return why these settings cannot plan by costs, None if they can."""
        knows = self.refine == "none" and self.coarse == "overlay"
        if knows or self.refine == "grid-astar":
            return None
        what = f"coarse: {self.coarse}" if self.refine == "none" else f"refine: {self.refine}"
        return (
            f"{what} knows lengths only; costs go with coarse: overlay, as in preset robot, or "
            "refine: grid-astar, as in preset grid-astar"
        )

    @model_validator(mode="before")
    @classmethod
    def _portals_are_gone(cls, given: Any) -> Any:
        """Take a method in place of portals that plans the same or better paths."""
        if not isinstance(given, dict) or given.get("coarse") != "portals":
            return given
        by_costs = given.get("costs") or given.get("smooth") == "arcs"
        taken = "mesh" if given.get("refine") == "ompl" else "overlay" if by_costs else "jumps"
        as_in = ", as in preset octile" if taken == "jumps" else ""
        text = f"portals are gone, coarse: {taken} plans instead{as_in}: write that"
        warnings.warn(text, FutureWarning, stacklevel=2)
        # Corner cells need no epsilon: their paths are the shortest.
        return {**given, "coarse": taken} | ({"epsilon": None} if taken == "jumps" else {})

    @model_validator(mode="before")
    @classmethod
    def _ompl_has_settings(cls, given: Any) -> Any:
        if isinstance(given, dict) and given.get("refine") == "ompl" and given.get("ompl") is None:
            return {**given, "ompl": {}}
        return given

    @model_validator(mode="after")
    def _go_together(self) -> Self:
        has_costs = self.costs is not None and self.costs.clearance is not None
        if (has_costs or self.smooth == "arcs") and (why := self.refusal_of_costs()):
            raise PydanticCustomError("costs_refused", "{why}", {"why": why})
        if self.ompl is not None and self.refine != "ompl":
            raise PydanticCustomError("ompl_needed", "section ompl goes with refine: ompl")
        if self.refine == "ompl":
            if self.smooth != "none":
                raise PydanticCustomError(
                    "no_smooth", "smooth goes with grid paths: with refine: ompl set it to none"
                )
            if self.epsilon is not None:
                raise PydanticCustomError("bounds_needed", "epsilon goes with no refine: ompl")
            return self
        usual = _REFINED_BY[self.coarse]
        if self.refine != usual and not (usual == "grid-astar" and ":" in self.refine):
            own = ", module:Class" if usual == "grid-astar" else ""
            raise PydanticCustomError(
                "refine_needed", f"coarse: {self.coarse} goes with refine: {usual}{own} or ompl"
            )
        if self.coarse == "mesh" and self.smooth != "none":
            raise PydanticCustomError(
                "no_smooth",
                "smooth shortens grid paths, with coarse: mesh they are any-angle: set it to none",
            )
        if self.budget_s is not None and (self.coarse, self.refine) != ("mesh", "none"):
            raise PydanticCustomError("mesh_needed", "budget_s needs coarse: mesh, refine: none")
        if self.epsilon is not None and self.coarse not in {"mesh", "overlay"}:
            raise PydanticCustomError("bounds_needed", "epsilon needs coarse: mesh or overlay")
        return self


class Preset(_Section):
    """A planner's configuration: sections `pyramid` and `planner`, and what it is for.

    Examples
    --------
    >>> print(hn.load_preset("paper").to_yaml().splitlines()[0])
    description: max-distance arcs, corridor, grid A*
    """

    name: str = "custom"
    description: str = ""
    pyramid: PyramidSettings = PyramidSettings()
    planner: PlannerSettings = PlannerSettings()

    def to_yaml(self) -> str:
        """Return the preset as the text of a YAML file, every key present."""
        # Unless it escapes them, PyYAML reads back line breaks such as U+0085 as spaces.
        plain = self.description.isprintable()
        text: str = yaml.safe_dump(
            self.model_dump(exclude={"name"}), sort_keys=False, allow_unicode=plain
        )
        return text


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

    Parameters
    ----------
    source
        What was given for a preset.

    Returns
    -------
    bool
        Whether it is a name; there need not be such a preset.
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
        suffix or a separator is a path. A `Preset` stays as it is. Names of earlier versions, as
        `ompl-bitstar`, still work, with a warning that states what to write instead.
    overrides
        Settings that win over the file, each `section.key=value`, the value in YAML; checked
        together.

    Returns
    -------
    Preset
        Named after its file.

    Raises
    ------
    PresetNotFoundError
        When there is no such preset or file; the message lists those that exist.
    PresetError
        When a key is unknown or a value is out of range; the message names the key and its place.

    Examples
    --------
    >>> preset = hn.load_preset("robot", overrides=["planner.epsilon=0.02"])
    >>> preset.planner.epsilon
    0.02
    """
    is_gone = not isinstance(source, Preset) and os.fspath(source) == "portals"
    found = "octile" if is_gone else source
    preset = found if isinstance(found, Preset) else _renamed(found) or _read(_find(found))
    tree, given = preset.model_dump(), list(overrides)
    if is_gone:  # the section takes another one for it, by all of its settings
        tree["planner"]["coarse"] = "portals"
    for override in given:
        _apply(tree, override)
    # All at once, for some keys go only together.
    return _checked(tree, where="setting ") if given or is_gone else preset


def _renamed(source: PathLike) -> Preset | None:
    """Return what a name of earlier versions stands for, under that name; None for others."""
    name = os.fspath(source)
    if name not in _OLD_NAMES:
        return None
    setting = f"planner.ompl.planner={_OLD_NAMES[name]}"
    warnings.warn(
        f"preset {name} is now ompl with one setting: write --preset ompl --set {setting}, or "
        f'load_preset("ompl", overrides=["{setting}"])',
        FutureWarning,
        stacklevel=3,
    )
    return load_preset("ompl", overrides=[setting]).model_copy(update={"name": name})


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
    if not (equals and dot and name and isinstance(tree.get(section), dict)):
        sections = " or ".join(key for key, value in tree.items() if isinstance(value, dict))
        raise PresetError(
            f"setting {brief(override)}: expected section.key=value, section {sections}"
        )
    *inner, name = name.split(".")
    branch = tree[section]
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
    key = printable(".".join(map(str, place)))
    if problem["type"] == "extra_forbidden":
        return f"{key}: unknown key; {_known_keys(place[:-1])}"
    if problem["type"] == "model_type":
        expected = "expected a section with keys"
    else:
        text = problem["msg"].partition(", unable to")[0].partition(", got")[0]
        expected = text[:1].lower() + text[1:]
    if isinstance(given, dict):  # a check of several keys names what it found itself
        return f"{key}: {expected.removeprefix('input ')}"
    shown = "nothing" if given is None else brief(given)
    return f"{key}: {expected.removeprefix('input ')}, got {shown}"


def _known_keys(section: tuple[int | str, ...]) -> str:
    model: Any = Preset
    for part in section:
        annotation = model.model_fields[str(part)].annotation
        models = [kind for kind in get_args(annotation) if kind is not NoneType]
        model = models[0] if models else annotation
    names = [name for name in model.model_fields if name != "name"]
    return f"known are {', '.join(names)}"
