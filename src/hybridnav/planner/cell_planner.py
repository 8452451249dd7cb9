"""The planner of cell paths for a preset."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from hybridnav import jumps, mesh, portals
from hybridnav.errors import InvalidValueError
from hybridnav.planner.cell_plans import MaxDistance, OverPortals, WholeMap
from hybridnav.planner.mesh_plans import OverMesh

if TYPE_CHECKING:
    from hybridnav.config import PlannerSettings
    from hybridnav.planner.cell_plans import CellPlanner, Prepared
    from hybridnav.refine import GridRefiner
    from hybridnav.topology import TopologicalMap

_T = TypeVar("_T")


def cell_planner(
    topology: TopologicalMap,
    refiner: GridRefiner,
    settings: PlannerSettings,
    prepared: Prepared | None,
) -> CellPlanner:
    """Make the planner of cell paths for some settings.

    Parameters
    ----------
    topology
        The map.
    refiner
        Search of cell paths.
    settings
        Section `planner` of a preset.
    prepared
        Structures that another planner of the same map and settings has built; None for none.

    Raises
    ------
    InvalidValueError
        When these settings do not use structures of the given kind.
    """
    grid, coarse = topology.grid, settings.coarse
    if coarse == "portals":
        built = _taken(portals.BuiltPortals, prepared, coarse)
        return OverPortals(topology, refiner, settings, built)
    if coarse == "mesh":
        return OverMesh(grid, refiner, settings, _taken(mesh.MeshSearch, prepared, coarse))
    if coarse == "jumps":
        from hybridnav.planner.jump_plans import OverJumps  # noqa: PLC0415 - one preset needs it

        return OverJumps(grid, refiner, settings, _taken(jumps.JumpSearch, prepared, coarse))
    _taken(type(None), prepared, coarse)
    return MaxDistance(topology, refiner, settings) if coarse != "none" else WholeMap(refiner)


def _taken(kind: type[_T], prepared: Prepared | None, coarse: str) -> _T | None:
    if prepared is None or isinstance(prepared, kind):
        return prepared
    raise InvalidValueError(
        f"coarse: {coarse} plans on nothing like a {type(prepared).__name__}: prepared must come "
        "from a planner of the same preset"
    )
