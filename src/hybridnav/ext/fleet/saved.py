"""Models of buildings: the models of their maps in one file, with links and what is known."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet.floors import Floor, Known
from hybridnav.ext.fleet.links import Link  # noqa: TC001 - pydantic reads it
from hybridnav.planner.saved.container import buffers_of
from hybridnav.planner.saved.parts import plain
from hybridnav.planner.saved.structures import BUILDING, FLOOR

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from hybridnav.planner import HybridPlanner
    from hybridnav.planner.saved.container import Part

_MOST_MAPS = 99
"""Most different maps of a building in a file."""


class _Values(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class _FloorValues(_Values):
    name: str
    elevation_m: float
    map: Annotated[int, Field(ge=0, lt=_MOST_MAPS)]


class BuildingValues(_Values):
    """A building, as a model states it."""

    speed_m_s: float
    floors: Annotated[list[_FloorValues], Field(min_length=1, max_length=10_000)]
    links: Annotated[list[Link], Field(max_length=10_000)]


def building_parts(  # noqa: PLR0913 - a building, taken apart
    floors: Sequence[Floor],
    links: Sequence[Link],
    known: Sequence[Known],
    speed_m_s: float,
    parts_of: Callable[[HybridPlanner], Iterable[Part]],
    *,
    compress: bool,
) -> list[Part]:
    """Describe a building; planners that several floors share are described once.

    Parameters
    ----------
    floors, links, known, speed_m_s
        Of the building; what is known of the costs between links, floor by floor.
    parts_of
        Returns the parts of the model of a planner.
    compress
        Whether the arrays of its maps are deflated.

    Raises
    ------
    InvalidValueError
        When it has too many maps.
    """
    planners = list({id(floor.planner): floor.planner for floor in floors}.values())
    if len(planners) > _MOST_MAPS:
        raise InvalidValueError(
            f"a model holds a building of at most {_MOST_MAPS} maps, this one has {len(planners)}"
        )
    values = {
        "speed_m_s": speed_m_s,
        "floors": [
            {
                "name": floor.name,
                "elevation_m": floor.elevation_m,
                "map": next(i for i, one in enumerate(planners) if one is floor.planner),
            }
            for floor in floors
        ],
        "links": [plain(asdict(link)) for link in links],
    }
    written = [
        # A model has no costs of cells, and what is known by them does not hold without.
        one if floor.planner.costs is None else Known(np.zeros_like(one.lower), one.cost * np.nan)
        for floor, one in zip(floors, known, strict=True)
    ]
    arrays = {
        name: np.concatenate([getattr(one, name).ravel() for one in written])
        for name in ("lower", "cost")
    }
    parts = [BUILDING.part(arrays, {"pairs": len(arrays["lower"])}, values)]
    for planner in planners:
        content = np.frombuffer(
            b"".join(buffers_of(parts_of(planner), compress=compress)), dtype=np.uint8
        )
        parts.append(FLOOR.part({"model": content}, {"bytes": len(content)}))
    return parts
