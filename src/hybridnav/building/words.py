"""Instructions for a person on a route over floors."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from hybridnav.planner.itinerary import heading_of
from hybridnav.sentences import FloorChange, Instruction, Space

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav.building.plan import Ride
    from hybridnav.planner.itinerary import Guide
    from hybridnav.result import Path, PlanResult


@dataclass(frozen=True, eq=False)
class GuidedRoute:
    """A route over floors whose instructions are found when somebody reads them."""

    guides: Sequence[Guide | None]
    """The source of descriptions on each floor that is visited; None on one without rooms."""
    results: Sequence[PlanResult]
    rides: Sequence[Ride]
    goal: str
    """What words call the goal."""

    def instructions(self) -> tuple[Instruction, ...]:
        """Find the instructions; none if no floor has rooms."""
        if all(guide is None for guide in self.guides):
            return ()
        found: list[Instruction] = []
        driven_m = 0.0
        for number, (guide, result) in enumerate(zip(self.guides, self.results, strict=True)):
            path, ride = result.path, self.rides[number] if number < len(self.rides) else None
            assert path is not None  # noqa: S101 - a route is solved
            before = self.rides[number - 1] if number else None
            here = self._on_floor(guide, path, before, heading_of(result.start))
            here = [replace(one, at_m=one.at_m + driven_m) for one in here]
            if before is not None and here[0].kind == "start" and len(here) > 1:
                here = self._joined(found, here)
            if ride is not None:
                change = self._change(ride, self.guides[number + 1])
                last = replace(here[-1], waypoint=None, landmark=None)
                here[-1] = replace(last, kind="ride", change=change)
            found += here
            driven_m += path.length_m
        return tuple(found)

    def _joined(self, found: list[Instruction], here: list[Instruction]) -> list[Instruction]:
        """Return the instructions on a floor behind a ride, the last one of `found`: the turn of
        the first step belongs to the sentence of the ride, and a start that shows no direction
        needs none."""
        change, start = found[-1].change, here[0]
        if change is not None and change.has_exit:
            found[-1] = replace(found[-1], turn=start.turn)
            return here[1:]
        is_needed = start.landmark is not None or start.heading_rad is not None
        return here if is_needed else here[1:]

    def _change(self, ride: Ride, guide: Guide | None) -> FloorChange:
        """Return what words say of a ride; `guide` is that of the floor where it ends."""
        end = ride.link.end_on(ride.to_floor)
        has_exit = guide is not None and end is not None and end.yaw_rad is not None
        return FloorChange(ride.link.name, ride.link.kind, ride.to_floor, has_exit=has_exit)

    def _on_floor(
        self, guide: Guide | None, path: Path, before: Ride | None, heading_rad: float | None
    ) -> list[Instruction]:
        """Return the instructions on one floor, from a start to an arrival."""
        if guide is None:
            x, y = path.points[-1].tolist()
            storey = Space(None, "storey")
            length_m = path.length_m
            return [Instruction("arrive", (x, y), length_m, length_m, storey, waypoint=self.goal)]
        if before is not None:
            end = before.link.end_on(before.to_floor)
            heading_rad = None if end is None else end.yaw_rad
        legs = guide.legs(path, waypoint=self.goal)
        return list(guide.instructions([path], [legs], heading_rad=heading_rad))
