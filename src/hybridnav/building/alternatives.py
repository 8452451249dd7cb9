"""Routes over floors by different links, and whether there may be more."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

if TYPE_CHECKING:
    from hybridnav.building.plan import BuildingPlan


@dataclass(frozen=True, eq=False)
class BuildingAlternatives(Sequence["BuildingPlan"]):
    """The routes that `Building.alternatives` has found, the cheapest first: a sequence of them.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = hn.Building([hn.Floor("1", hn.HybridPlanner(topology))])
    >>> found = house.alternatives(("1", (0.5, 0.5)), ("1", (2.0, 2.5)), 2)
    >>> len(found), found[0].solved, found.complete
    (1, True, True)
    """

    found: tuple[BuildingPlan, ...]
    """The plans; one that is not solved if there is no route."""
    complete: bool
    """Whether there are as many as requested, or all that keep to the limits: False where the
    search stopped before."""
    note: str = ""
    """The reason why there are fewer than requested, one line; empty if there are not."""

    @overload
    def __getitem__(self, index: int) -> BuildingPlan: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[BuildingPlan, ...]: ...

    def __getitem__(self, index: int | slice) -> BuildingPlan | tuple[BuildingPlan, ...]:
        """Return one plan, or some."""
        return self.found[index]

    def __len__(self) -> int:
        """Return the number of plans."""
        return len(self.found)

    @classmethod
    def of(
        cls, found: tuple[BuildingPlan, ...], limits: tuple[int, float], *, complete: bool
    ) -> BuildingAlternatives:
        """Return the alternatives of a query, with the reason why there are no more.

        Parameters
        ----------
        found
            The plans.
        limits
            Most routes, and cost of one over that of the first, at most.
        complete
            Whether the search has looked at all sequences of links that keep to the limits.
        """
        count, stretch = limits
        if not found[0].solved:
            return cls(found, complete=True, note=f"no route was planned: {found[0].status}")
        if len(found) >= count:
            return cls(found, complete=True)
        if not complete:
            note = f"the search stopped after {len(found)} of {count} routes: there may be more"
            return cls(found, complete=False, note=note)
        reason = f"no other sequence of links is at most {stretch:g} times as dear as the first"
        return cls(found, complete=True, note=f"{len(found)} of {count}: {reason}")
