"""The sections of a preset: of the pyramid, and of the planner by each method. Public:
`ClearanceSettings`, `CostSettings` and `LimitSettings`.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    model_validator,
)
from pydantic_core import PydanticCustomError
from typing_extensions import Self

from hybridnav.maps.cells import DEFAULT_ROBOT_RADIUS_M
from hybridnav.refine.ompl.settings import Float, Int, OmplSettings

_OWN = re.compile(r"[^\W\d]\w*(\.[^\W\d]\w*)*:[^\W\d]\w*")


def _class_name(refine: str) -> str:
    """Refuse what is neither the grid search nor written like the name of a class."""
    if refine == "grid-astar" or _OWN.fullmatch(refine):
        return refine
    why = "input should be 'grid-astar' or a class of your own, module:Class"
    raise PydanticCustomError("refiner", why)


_Limit = Annotated[Float, Field(gt=0, allow_inf_nan=False)]


class Section(BaseModel):
    """Keys that are checked, and do not change."""

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True, allow_inf_nan=True)


class PyramidSettings(Section):
    """Section `pyramid`: how the map is inflated and contracted.

    Examples
    --------
    >>> from hybridnav.planning import PyramidSettings
    >>> PyramidSettings(merge_distance_m=2.0).linkage
    'throats'
    """

    merge_distance_m: Annotated[Float, Field(gt=0)] = 4.0
    """U_d in metres, infinity (.inf) allowed."""
    linkage: Literal["throats", "survivor", "radius", "diameter"] = "throats"
    """What stays below U_d."""
    seed: Annotated[Int, Field(ge=0, lt=2**32)] = 0
    """Breaks ties."""
    robot_radius_m: Annotated[Float, Field(ge=0, allow_inf_nan=False)] = DEFAULT_ROBOT_RADIUS_M
    """Radius by which occupied cells are inflated, in metres."""


class ClearanceSettings(Section):
    """Section `planner.costs.clearance`: factors by Nav2's inflation, see `CostLayer.clearance`.

    Examples
    --------
    >>> from hybridnav.planning import ClearanceSettings
    >>> ClearanceSettings(multiplier=3.0).scaling
    3.0
    """

    inflation_radius_m: Annotated[Float, Field(ge=0, allow_inf_nan=False)] = 0.70
    """Distance from obstacles up to which cells cost more, in metres."""
    scaling: Annotated[Float, Field(ge=0, allow_inf_nan=False)] = 3.0
    """How quickly costs fall off, 1 / m: `cost_scaling_factor`."""
    inscribed_radius_m: Annotated[Float, Field(ge=0, allow_inf_nan=False)] | None = None
    """Distance from which they fall off, in metres; null for the radius of the robot."""
    multiplier: Annotated[Float, Field(ge=0, le=991)] = 2.0
    """Factor above 1 of a cell at the inscribed radius."""


class CostSettings(Section):
    """Section `planner.costs`: what makes a metre in a cell cost more than a metre.

    Examples
    --------
    >>> from hybridnav.planning import CostSettings
    >>> print(CostSettings().clearance)
    None
    """

    clearance: ClearanceSettings | None = None
    """Distance from obstacles; null for no such costs."""


class LimitSettings(Section):
    """Section `limits`: how fast the robot drives, see `MotionLimits`; `duration_s` needs them.

    Examples
    --------
    >>> hn.load_preset("robot", overrides=["limits.max_speed_m_s=0.26"]).limits.max_speed_m_s
    0.26
    """

    max_speed_m_s: _Limit = 0.5
    """Speed ahead and backwards, m / s."""
    max_acceleration_m_s2: _Limit = 2.5
    """Gain of speed, m / s^2."""
    max_deceleration_m_s2: _Limit = 2.5
    """Loss of speed when braking, m / s^2."""
    max_lateral_acceleration_m_s2: _Limit = 1.0
    """Speed^2 * curvature on arcs, m / s^2."""
    max_turning_rate_rad_s: _Limit = 2.0
    """Turn of the heading, rad / s."""
    max_angular_acceleration_rad_s2: _Limit = 3.2
    """Change of the turning rate in turns on the spot, rad / s^2."""


Smooth = Literal["none", "line-of-sight", "arcs"]
"""What is smoothed of a path."""


class PlannerSettings(Section):
    """Section `planner`: the method, and what each method has; the keys of one are its class.

    Examples
    --------
    >>> from hybridnav.planning import planner_settings
    >>> planner_settings("octile").allow_unexplored
    False
    """

    allow_unexplored: bool = False
    """Whether unexplored cells may be entered."""

    needs_places: ClassVar[bool] = False
    """Whether the method plans on the places of the map, and not on its cells alone."""

    @property
    def finish(self) -> Smooth:
        """Smoothing of the path that the method finds."""
        return "none"

    @property
    def own_refiner(self) -> str | None:
        """The class `module:Class` that refines in place of the grid search; None for none."""
        return None

    @property
    def clearance(self) -> ClearanceSettings | None:
        """Costs that are computed from the map; None for none."""
        return None

    @property
    def sampling(self) -> OmplSettings | None:
        """How OMPL searches; None without it."""
        return None

    @property
    def underlying(self) -> PlannerSettings:
        """The section of the method that finds paths of cells or points: its own, or that along
        whose paths OMPL goes."""
        return self

    def refusal_of_costs(self) -> str | None:
        """Return why these settings cannot plan by costs, None if they can."""
        return f"method {self.method} knows lengths only; {_WITH_COSTS}"

    if TYPE_CHECKING:  # which keys there are depends on the method

        def __getattr__(self, name: str) -> Any: ...


_WITH_COSTS = """costs go with method cheapest, as in preset robot, with grid-astar and paper, \
without a refiner of your own, and with ompl for a footprint that turns on the spot"""


class ShortestSettings(PlannerSettings):
    """Method `shortest`: the shortest any-angle path, on convex polygons of free space.

    Examples
    --------
    >>> from hybridnav.planning import planner_settings
    >>> planner_settings("shortest", epsilon=0.02).epsilon
    0.02
    """

    method: Literal["shortest"] = "shortest"
    epsilon: Annotated[Float, Field(ge=0, le=1)] | None = None
    """The search ends once no path can be better by more than this part; null for the optimum."""
    budget_s: Annotated[Float, Field(ge=0)] | None = None
    """Seconds after which a query returns the best path so far, with its proved bound; null for no
    limit. Until the planner is prepared, such queries shorten a path of cells by line of sight."""


class OctileSettings(PlannerSettings):
    """Method `octile`: the shortest path of cells, on the corner cells at which such paths turn.

    Examples
    --------
    >>> from hybridnav.planning import planner_settings
    >>> planner_settings("octile", smooth="line-of-sight").finish
    'line-of-sight'
    """

    method: Literal["octile"] = "octile"
    smooth: Literal["none", "line-of-sight"] = "none"
    """Whether the path is shortened to an any-angle one."""

    @property
    def finish(self) -> Smooth:
        """Smoothing of the path of cells."""
        return self.smooth


class _ByCosts(PlannerSettings):
    smooth: Smooth = "none"
    """Whether a path of cells is moved to a cheaper one at any angle; `arcs`, which goes with
    costs, also rounds the bends."""
    turning_radius_m: Annotated[Float, Field(gt=0, allow_inf_nan=False)] = 0.3
    """With `smooth: arcs`, the least radius of an arc, metres; else the robot turns on the spot."""
    costs: CostSettings | None = None
    """Factors by which metres cost more, and the path is the cheapest; null for lengths."""

    @property
    def finish(self) -> Smooth:
        """Smoothing of the path of cells."""
        return self.smooth

    @property
    def clearance(self) -> ClearanceSettings | None:
        """Costs that are computed from the map; None for none."""
        return None if self.costs is None else self.costs.clearance

    def refusal_of_costs(self) -> str | None:
        """Return why these settings cannot plan by costs, None if they can."""
        own = self.own_refiner
        return None if own is None else f"refine: {own} knows lengths only; {_WITH_COSTS}"

    @model_validator(mode="after")
    def _go_together(self) -> Self:
        wants_costs = self.clearance is not None or self.smooth == "arcs"
        if wants_costs and (why := self.refusal_of_costs()):
            raise PydanticCustomError("costs_refused", "{why}", {"why": why})
        return self


class CheapestSettings(_ByCosts):
    """Method `cheapest`: a line over a lattice of the cells, moved to where it costs least.

    Examples
    --------
    >>> from hybridnav.planning import planner_settings
    >>> planner_settings("cheapest", smooth="arcs").turning_radius_m
    0.3
    """

    method: Literal["cheapest"] = "cheapest"
    keep_within: Annotated[Float, Field(ge=0, le=1e3)] = 0.02
    """Most that a kept path may cost more than a new one, a share; see `HybridPlanner.plan`."""


class _Refined(_ByCosts):
    refine: Annotated[str, AfterValidator(_class_name)] = "grid-astar"
    """Search for the path: `grid-astar`, cell by cell, or a refiner of your own, `module:Class`,
    which is imported when a planner is made."""

    @property
    def own_refiner(self) -> str | None:
        """The class `module:Class` that refines in place of the grid search; None for none."""
        return self.refine if ":" in self.refine else None


class GridSettings(_Refined):
    """Method `grid-astar`: the cells of the whole map.

    Examples
    --------
    >>> from hybridnav.planning import planner_settings
    >>> planner_settings("grid-astar").refine
    'grid-astar'
    """

    method: Literal["grid-astar"] = "grid-astar"


class PaperSettings(_Refined):
    """Method `paper`: a route of places by max-distances, which comes down to cells.

    Examples
    --------
    >>> from hybridnav.planning import planner_settings
    >>> planner_settings("paper", corridor="neighbours").corridor
    'neighbours'
    """

    method: Literal["paper"] = "paper"
    levels: Literal["descent", "places"] = "descent"
    """Whether a route comes down from the places through the levels of the pyramid to small fields,
    or its places are the corridor at once."""
    field_cells: Annotated[Int, Field(ge=1)] = 128
    """Mean size of the fields at which a descent ends, in cells."""
    step: Annotated[Float, Field(ge=1, allow_inf_nan=False)] = 8.0
    """How many times smaller the fields of each level of a descent are than those before."""
    ring: Annotated[Int, Field(ge=0, le=100)] = 1
    """Rings of fields that a descent keeps beside its route; at the top two more."""
    horizon_cells: Annotated[Int, Field(ge=0)] = 128
    """Cells that grid A* looks ahead along the last fields; 0 for one search inside them."""
    corridor: Literal["route", "joined", "neighbours"] = "joined"
    """With `levels: places`, the fields in which the refiner searches: see
    `hybridnav.route.corridor_of`."""

    needs_places: ClassVar[bool] = True


class OmplPlannerSettings(PlannerSettings):
    """Method `ompl`: a sampling-based planner of OMPL, along the path of another method.

    Examples
    --------
    >>> from hybridnav.planning import planner_settings
    >>> planner_settings("ompl", ompl={"planner": "RRTstar"}).along
    'shortest'
    """

    method: Literal["ompl"] = "ompl"
    along: Literal["shortest", "paper", "grid-astar"] = "shortest"
    """Method whose path chooses where OMPL begins; with `grid-astar` the whole map."""
    corridor: Literal["route", "neighbours"] = "route"
    """Fields in which OMPL begins: those of the path, or also their neighbours."""
    ompl: OmplSettings = OmplSettings()
    """Which planner of OMPL, in which space, for how long."""

    @property
    def sampling(self) -> OmplSettings:
        """How OMPL searches."""
        return self.ompl

    @property
    def underlying(self) -> PlannerSettings:
        """The section of the method along whose paths OMPL goes."""
        allowed = self.allow_unexplored
        if self.along == "paper":
            wide = self.corridor if self.corridor == "neighbours" else "joined"
            return PaperSettings(allow_unexplored=allowed, levels="places", corridor=wide)
        return SECTIONS[self.along](allow_unexplored=allowed)

    def refusal_of_costs(self) -> str | None:
        """Return why these settings cannot plan by costs, None if they can."""
        can = self.ompl.footprint and self.ompl.follows_discs and self.along == "shortest"
        return None if can else super().refusal_of_costs()


def _own_method(method: str) -> str:
    """Refuse what is not written like the name of a class."""
    if not _OWN.fullmatch(method):
        raise PydanticCustomError("own", "input should be a class of your own, module:Class")
    return method


class OwnSettings(PlannerSettings):
    """A method of your own, `module:Class`, which is imported when a planner is made.

    Examples
    --------
    >>> from hybridnav.planning import planner_settings
    >>> planner_settings("mine:ByGraph", settings={"weight": 2}).settings
    {'weight': 2}
    """

    method: Annotated[str, AfterValidator(_own_method)]
    settings: dict[str, Any] = {}
    """Keyword arguments of the class."""


SECTIONS: dict[str, type[PlannerSettings]] = {
    "shortest": ShortestSettings,
    "octile": OctileSettings,
    "cheapest": CheapestSettings,
    "grid-astar": GridSettings,
    "paper": PaperSettings,
    "ompl": OmplPlannerSettings,
    "own": OwnSettings,
}
"""The class of each method's section, by its tag."""
METHODS = tuple(name for name in SECTIONS if name != "own")
"""Names of the methods of the package."""


def method_of(given: Any) -> str:
    """Return the tag of a section."""
    if isinstance(given, dict):
        method = given.get("method", "paper")
    else:
        method = getattr(given, "method", "")
    if not isinstance(method, str):
        return ""
    return "own" if ":" in method else method


_GONE = {
    "coarse": f"write method, one of {', '.join(METHODS)}",
    "labels_mb": "leave it out, hub labels of single queries went; tables of distances need none",
}
"""Keys of former files, and what to do instead."""


def _without_gone(given: Any) -> Any:
    """Refuse keys of former files: the message about an unknown key says too little."""
    for key in _GONE.keys() & given if isinstance(given, dict) else ():
        known = {"key": key, "instead": _GONE[key]}
        raise PydanticCustomError("gone", "{key} is gone: {instead}", known)
    return given


AnyMethod = Annotated[
    Annotated[ShortestSettings, Tag("shortest")]
    | Annotated[OctileSettings, Tag("octile")]
    | Annotated[CheapestSettings, Tag("cheapest")]
    | Annotated[GridSettings, Tag("grid-astar")]
    | Annotated[PaperSettings, Tag("paper")]
    | Annotated[OmplPlannerSettings, Tag("ompl")]
    | Annotated[OwnSettings, Tag("own")],
    Discriminator(method_of),
    BeforeValidator(_without_gone),
]
