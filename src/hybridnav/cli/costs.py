"""The option `--costs`: clearance, and masks of Nav2."""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated

import typer

from hybridnav.cli.errors import UsageError
from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    import hybridnav as hn
    from hybridnav.maps.costs.files import CostSpec

CostsOption = Annotated[
    list[str] | None,
    typer.Option(
        "--costs",
        metavar="WHAT",
        help="Plan the cheapest path, by clearance[:KEY=VALUE,...], speed:FILE[,KEY=VALUE,...] or "
        "keepout:FILE[,KEY=VALUE,...] (masks of Nav2); may be repeated.",
    ),
]

PRESET = "grid-astar"
"""The preset that plans by costs unless another is named."""


@dataclass(frozen=True)
class Costs:
    """What a command line states about costs."""

    overrides: tuple[str, ...] = ()
    """Settings of the preset."""
    masks: tuple[CostSpec, ...] = ()
    """Masks."""

    def __bool__(self) -> bool:
        """Return whether there are any."""
        return bool(self.overrides or self.masks)

    def read(self, grid: hn.OccupancyGrid) -> hn.CostLayer | None:
        """Read the masks, on the cells of a map; None for no masks."""
        layers = [mask.layer(grid) for mask in self.masks]
        return reduce(or_, layers) if layers else None


def parsed_costs(specs: list[str] | None) -> Costs:
    """Return what the options `--costs` state.

    Raises
    ------
    UsageError
        When one of them has another form.
    """
    from hybridnav.maps.costs.files import parse_costs  # noqa: PLC0415 - loads numpy

    try:
        found = parse_costs(specs or ())
    except InvalidValueError as error:
        raise UsageError(f"--{error}") from None
    overrides: list[str] = []
    for spec in found:
        if spec.kind == "clearance":
            overrides.append("planner.costs.clearance={}")
            overrides += [
                f"planner.costs.clearance.{key}={spec.settings[key]!r}" for key in spec.settings
            ]
    return Costs(tuple(overrides), tuple(spec for spec in found if spec.kind != "clearance"))
