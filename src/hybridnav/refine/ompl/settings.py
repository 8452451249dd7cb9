"""Section `planner.ompl` of a preset: which OMPL planner, in which state space, for how long."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator
from pydantic_core import PydanticCustomError
from typing_extensions import Self

if TYPE_CHECKING:
    from hybridnav.refine.footprint import Footprint

PARAMETERS: dict[str, dict[str, str]] = {
    "RRTConnect": {"intermediate_states": "setIntermediateStates", "range": "setRange"},
    "RRTstar": {
        "delay_collision_checking": "setDelayCC",
        "focus_search": "setFocusSearch",
        "goal_bias": "setGoalBias",
        "informed_sampling": "setInformedSampling",
        "new_state_rejection": "setNewStateRejection",
        "number_sampling_attempts": "setNumSamplingAttempts",
        "ordered_sampling": "setOrderedSampling",
        "ordering_batch_size": "setBatchSize",
        "prune_threshold": "setPruneThreshold",
        "pruned_measure": "setPrunedMeasure",
        "range": "setRange",
        "rewire_factor": "setRewireFactor",
        "sample_rejection": "setSampleRejection",
        "tree_pruning": "setTreePruning",
        "use_admissible_heuristic": "setAdmissibleCostToCome",
        "use_k_nearest": "setKNearest",
    },
    "InformedRRTstar": {
        "delay_collision_checking": "setDelayCC",
        "goal_bias": "setGoalBias",
        "number_sampling_attempts": "setNumSamplingAttempts",
        "ordered_sampling": "setOrderedSampling",
        "ordering_batch_size": "setBatchSize",
        "prune_threshold": "setPruneThreshold",
        "range": "setRange",
        "rewire_factor": "setRewireFactor",
        "use_k_nearest": "setKNearest",
    },
    "BITstar": {
        "delay_rewiring_to_first_solution": "setDelayRewiringUntilInitialSolution",
        "drop_unconnected_samples_on_prune": "setDropSamplesOnPrune",
        "find_approximate_solutions": "setConsiderApproximateSolutions",
        "prune_threshold_as_fractional_cost_change": "setPruneThresholdFraction",
        "rewire_factor": "setRewireFactor",
        "samples_per_batch": "setSamplesPerBatch",
        "stop_on_each_solution_improvement": "setStopOnSolnImprovement",
        "use_graph_pruning": "setPruning",
        "use_just_in_time_sampling": "setJustInTimeSampling",
        "use_k_nearest": "setUseKNearest",
        "use_strict_queue_ordering": "setStrictQueueOrdering",
    },
    "PRM": {"max_nearest_neighbors": "setMaxNearestNeighbors"},
    "PRMstar": {},
    "RRT": {
        "goal_bias": "setGoalBias",
        "intermediate_states": "setIntermediateStates",
        "range": "setRange",
    },
}
"""For each planner the parameters by OMPL's names, with the methods that set them; the bindings
have no parameter sets."""

ROADMAPS = frozenset({"PRM", "PRMstar"})
"""Planners that grow a roadmap, in both directions of travel."""
WHOLE = {
    "max_nearest_neighbors",
    "number_sampling_attempts",
    "ordering_batch_size",
    "samples_per_batch",
}
"""Parameters whose values are counts."""
REAL = {
    "goal_bias",
    "prune_threshold",
    "prune_threshold_as_fractional_cost_change",
    "range",
    "rewire_factor",
}
"""Parameters that are real numbers; all others are switches."""
_LIMITS = {"goal_bias": (0.0, 1.0), "prune_threshold": (0.0, 1.0), "rewire_factor": (1.0, 100.0)}
_MOST = 1_000_000

DIRECTED = frozenset({"BITstar", "RRT", "RRTConnect"})
"""Planners that check each motion in its own direction in every state space; the others assume that
a motion valid one way is valid the other."""
Space = Literal["r2", "se2", "differential", "dubins", "reeds-shepp"]
Confinement = Literal["chain", "mask"]


def _no_boolean(value: Any) -> Any:
    """Refuse a YAML `yes` or `on` where a number belongs; Python would call it 1."""
    if isinstance(value, bool):
        raise PydanticCustomError("number_type", "input should be a number")
    return value


def _corners(value: Any) -> Any:
    """Return the corners of a footprint given as a shapely polygon or in Nav2's form, a string of a
    list."""
    exterior = getattr(value, "exterior", None)
    if exterior is not None:
        if len(value.interiors):
            raise PydanticCustomError("footprint", "a footprint must have no holes")
        return [list(map(float, corner)) for corner in exterior.coords[:-1]]
    if isinstance(value, str) and value.strip().startswith("["):
        try:
            return json.loads(value)
        except (ValueError, RecursionError):
            raise PydanticCustomError(
                "footprint", "expected corners as [[x, y], ...] in metres"
            ) from None
    if isinstance(value, str):
        from shapely import Polygon, wkt  # noqa: PLC0415 - half a second, rarely needed

        try:
            shape = wkt.loads(value)
        except Exception:  # noqa: BLE001 - arcs raise what no page of shapely's names
            shape = None
        if isinstance(shape, Polygon):
            return _corners(shape)
        raise PydanticCustomError(
            "footprint", "expected corners as [[x, y], ...] in metres, or POLYGON ((x y, ...))"
        )
    return value


Float = Annotated[float, BeforeValidator(_no_boolean)]
"""A number, also of the other sections of a preset."""
Int = Annotated[int, BeforeValidator(_no_boolean)]
"""A whole number."""
_Coordinate = Annotated[Float, Field(allow_inf_nan=False, ge=-1e4, le=1e4)]


class OmplSettings(BaseModel):
    """Section `ompl` of the planner: sampling-based search inside the corridor.

    Examples
    --------
    >>> from hybridnav.refine.ompl import OmplSettings
    >>> OmplSettings(planner="RRTstar").space
    'r2'
    """

    model_config = ConfigDict(defer_build=True, extra="forbid", frozen=True)

    planner: str = "RRTConnect"
    """OMPL's name of the planner, one of `PARAMETERS`."""
    parameters: dict[str, bool | int | float] = Field(default_factory=dict)
    """Its parameters by OMPL's names; missing ones have OMPL's own values."""
    space: Space = "r2"
    """State space. `r2`: a disc that moves in any direction. `se2`: a footprint that moves in any
    direction, sideways too, while it turns (a holonomic robot). `differential`: one that turns on
    the spot, drives straight ahead, and turns again. `dubins`: one that drives curves forwards.
    `reeds-shepp`: one that drives curves both ways."""
    footprint: Annotated[
        tuple[tuple[_Coordinate, _Coordinate], ...] | None, BeforeValidator(_corners)
    ] = Field(default=None, min_length=3, max_length=1000)
    """Corners in metres in the robot's frame, x ahead: a list, Nav2's string of it, or a shapely
    polygon or its WKT. Null for the disc that the map was inflated for."""
    footprint_padding_m: Annotated[Float, Field(ge=0, le=1e3)] = 0.0
    """Metres by which each side of the footprint is moved outwards, as Nav2's `footprint_padding`:
    no point of the robot comes nearer to an obstacle."""
    turning_radius_m: Annotated[Float, Field(gt=0, le=1e4)] | None = None
    """Turning radius of `dubins` and `reeds-shepp`."""
    reverses: bool = False
    """With `differential`: whether the robot may also drive backwards if it cannot drive ahead."""
    budget_s: Annotated[Float, Field(ge=0.01, le=3600)] = 1.0
    """Seconds that a query may take; kept to within 10 %."""
    iterations: Annotated[Int, Field(ge=1, le=1_000_000_000)] | None = None
    """Iterations of planners and of simplification that a query may take, instead of the seconds,
    which stay as a limit. Results before that limit repeat for equal seeds."""
    seed: Annotated[Int, Field(ge=1, lt=2**31)] = 1
    """Seed of OMPL's random numbers."""
    confine: Confinement = "chain"
    """Confinement to the corridor. `chain`: a chain of small problems, field by field. `mask`: one
    problem that refuses states and motions outside."""
    simplify: bool = True
    """Whether paths are shortened by OMPL's PathSimplifier."""

    @model_validator(mode="after")
    def _planner_is_known(self) -> Self:
        known = PARAMETERS.get(self.planner)
        if known is None:
            raise PydanticCustomError(
                "planner",
                "unknown OMPL planner {planner}; known are {known}",
                {"planner": repr(self.planner)[:80], "known": ", ".join(sorted(PARAMETERS))},
            )
        for name, value in self.parameters.items():
            if name not in known:
                text = "unknown parameter {name} of {planner}; " + (
                    "known are {known}" if known else "it has none"
                )
                raise PydanticCustomError(
                    "parameter",
                    text,
                    {
                        "name": repr(name)[:80],
                        "planner": self.planner,
                        "known": ", ".join(sorted(known)),
                    },
                )
            _check_parameter(name, value)
        return self

    @model_validator(mode="after")
    def _space_is_whole(self) -> Self:
        curved = self.space in {"dubins", "reeds-shepp"}
        if curved and self.turning_radius_m is None:
            raise PydanticCustomError(
                "turning_radius", "space: dubins or reeds-shepp needs turning_radius_m"
            )
        if not curved and self.turning_radius_m is not None:
            raise PydanticCustomError(
                "turning_radius", "turning_radius_m goes with space: dubins or reeds-shepp"
            )
        if self.space == "dubins" and self.planner in ROADMAPS:
            # Their roadmap is undirected: a motion checked one way would be driven the other.
            raise PydanticCustomError(
                "roadmap", "PRM and PRMstar refuse space: dubins, whose curves run one way"
            )
        if self.footprint is not None:
            if self.space == "r2":
                raise PydanticCustomError(
                    "footprint",
                    "a footprint needs a space with headings: se2, differential, dubins or "
                    "reeds-shepp",
                )
            _check_base(self.footprint)
        elif self.footprint_padding_m:
            raise PydanticCustomError("padding", "footprint_padding_m goes with a footprint")
        return self

    @model_validator(mode="after")
    def _planner_bears_differential(self) -> Self:
        if self.space != "differential":
            if self.reverses:
                raise PydanticCustomError(
                    "reverses", "reverses: true goes with space: differential"
                )
            return self
        if not self.reverses and self.planner not in DIRECTED:
            raise PydanticCustomError(
                "planner",
                "space: differential, whose motions run one way, goes with planner {directed}; "
                "with {planner} it needs reverses: true",
                {"directed": ", ".join(sorted(DIRECTED)), "planner": self.planner},
            )
        if self.parameters.get("intermediate_states"):
            # OMPL puts them on the straight interpolation, which the robot does not drive.
            raise PydanticCustomError(
                "parameter", "space: differential refuses intermediate_states: true"
            )
        return self

    @property
    def has_heading(self) -> bool:
        """Whether states have a heading."""
        return self.space != "r2"

    @property
    def follows_discs(self) -> bool:
        """Whether the robot can follow a path of a disc, with turns on the spot."""
        return self.space in {"se2", "differential"}

    @property
    def body(self) -> Footprint | None:
        """The footprint with its padding, which every check takes; None for a disc."""
        if self.footprint is None:
            return None
        from hybridnav.refine.footprint import Footprint  # noqa: PLC0415 - loads shapely

        return Footprint.of(self.footprint).padded(self.footprint_padding_m)


def _check_base(footprint: tuple[tuple[float, float], ...]) -> None:
    """Refuse a footprint without the robot's base, the origin: the plan would be for a body that
    drives beside its own path. The base may lie on the outline."""
    from shapely import Point, Polygon  # noqa: PLC0415 - half a second, rarely needed

    outline = Polygon(footprint)
    if outline.is_valid and not outline.covers(Point(0.0, 0.0)):
        raise PydanticCustomError(
            "footprint",
            "a footprint must hold the robot's base, (0, 0) of its frame; "
            "give corners relative to the base",
        )


def _check_parameter(name: str, value: Any) -> None:
    """Refuse what OMPL would take and hang or crash on."""
    if name in WHOLE:
        good = type(value) is int and 1 <= value <= _MOST
        expected = f"a whole number from 1 to {_MOST}"
    elif name in REAL:
        low, high = _LIMITS.get(name, (0.0, 1e6))
        good = type(value) in {int, float} and low <= value <= high
        expected = f"a number from {low:g} to {high:g}"
    else:
        good, expected = type(value) is bool, "true or false"
    if not good:
        raise PydanticCustomError(
            "parameter",
            "parameter {name}: expected {expected}, not {value}",
            {"name": name, "expected": expected, "value": repr(value)[:80]},
        )
