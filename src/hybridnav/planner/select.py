"""The planner of cell paths that the settings of a preset select."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from hybridnav.errors import InvalidValueError
from hybridnav.planner.own import is_own, own_refiner
from hybridnav.refine import GridRefiner

if TYPE_CHECKING:
    from hybridnav.config import PlannerSettings
    from hybridnav.costs import CostLayer
    from hybridnav.planner.cell_planner import CellPlanner, Prepared
    from hybridnav.topology import TopologicalMap

_T = TypeVar("_T")


def cell_planner(
    topology: TopologicalMap,
    settings: PlannerSettings,
    prepared: Prepared | None,
    costs: CostLayer | None = None,
) -> CellPlanner:
    """Make the planner of cell paths for some settings.

    The modules of the other methods are not loaded.

    Parameters
    ----------
    topology
        The map.
    settings
        Section `planner` of a preset.
    prepared
        Structures that another planner of the same map and settings has built; None for none.
    costs
        Costs of the cells, with settings that can plan by them; None for lengths.

    Raises
    ------
    InvalidValueError
        When these settings do not use structures of the given kind.
    PresetError
        When the settings name a refiner of the user's own that cannot be used.
    """
    grid, coarse = topology.grid, settings.coarse
    refiner = GridRefiner(grid, allow_unexplored=settings.allow_unexplored, costs=costs)
    if coarse == "overlay":
        from hybridnav.planner.overlay_plans import OverOverlay  # noqa: PLC0415

        _taken(type(None), prepared, coarse)
        return OverOverlay(topology, refiner, settings)
    if coarse == "mesh":
        from hybridnav.mesh import MeshSearch  # noqa: PLC0415
        from hybridnav.planner.mesh_plans import OverMesh  # noqa: PLC0415

        return OverMesh(grid, refiner, settings, _taken(MeshSearch, prepared, coarse))
    if coarse == "jumps":
        from hybridnav.jumps import JumpSearch  # noqa: PLC0415
        from hybridnav.planner.jump_plans import OverJumps  # noqa: PLC0415

        return OverJumps(grid, refiner, settings, _taken(JumpSearch, prepared, coarse))
    from hybridnav.planner.cell_plans import MaxDistance, WholeMap  # noqa: PLC0415

    _taken(type(None), prepared, coarse)
    own = None
    if is_own(settings.refine):
        own = own_refiner(settings.refine, grid, allow_unexplored=settings.allow_unexplored)
    if coarse == "none":
        return WholeMap(refiner, own)
    return MaxDistance(topology, refiner, settings, own)


def _taken(kind: type[_T], prepared: Prepared | None, coarse: str) -> _T | None:
    if prepared is None or isinstance(prepared, kind):
        return prepared
    raise InvalidValueError(
        f"coarse: {coarse} plans on nothing like a {type(prepared).__name__}: prepared must come "
        "from a planner of the same preset"
    )
