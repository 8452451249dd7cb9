"""Figures of a replay: times, events, flips, and a check of its last version."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.pyramid.cracks import endpoints_of, find_cracks

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav.ext.live.identities import Flips
    from hybridnav.ext.live.replay import ReplayStep
    from hybridnav.pyramid import Level

_EVENTS = ("born", "died", "merged", "split")
_OF_DOORS = (*_EVENTS, "changed")


class Identities:
    """Events and flips of places, of rooms or of regions, over a replay."""

    def __init__(self) -> None:
        self.seconds: list[float] = []
        self.events: Counter[str] = Counter()
        self._cells: Counter[str] = Counter()
        self._flips = {kind: _Flipped() for kind in ("untouched", "apart", "far")}

    def add(self, update: object, flips: Flips, seconds: float) -> None:
        """Count an update."""
        self.seconds.append(seconds)
        for event in _EVENTS:
            self.events[event] += len(getattr(update, event))
        for name in ("cells", "merged", "cut_off", "free"):
            self._cells[name] += getattr(flips, name)
        for kind, flipped in self._flips.items():
            flipped.add(getattr(flips, kind), flips.flipped)

    def figures(self) -> dict[str, Any]:
        """Return plain values; None where there was no update."""
        n_updates, cells = len(self.seconds), self._cells
        median, high = np.percentile(self.seconds, [50, 95]) if n_updates else (None, None)
        return {
            "updates": n_updates,
            "median_ms": None if median is None else round(1000 * median, 3),
            "p95_ms": None if high is None else round(1000 * high, 3),
            **{event: self.events[event] for event in _EVENTS},
            "flipped_cells": round(cells["cells"] / n_updates, 3) if n_updates else None,
            "flipped_share": round(cells["cells"] / max(cells["free"], 1), 8),
            "flipped_by_merging": round(cells["merged"] / max(cells["cells"], 1), 8),
            "flipped_by_cutting_off": round(cells["cut_off"] / max(cells["cells"], 1), 8),
            **{kind: flipped.figures() for kind, flipped in self._flips.items()},
        }


class _Flipped:
    """Places of a kind, and those of them that flip."""

    def __init__(self) -> None:
        self._ever: set[int] = set()
        self._ever_flipped: set[int] = set()
        self._seen = self._n_flips = 0

    def add(self, places: frozenset[int], flipped: frozenset[int]) -> None:
        """Count the places of an update."""
        self._ever |= places
        self._ever_flipped |= places & flipped
        self._seen += len(places)
        self._n_flips += len(places & flipped)

    def figures(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "places": len(self._ever),
            "flipped": len(self._ever_flipped),
            "flips": self._n_flips,
            "share_an_update": round(self._n_flips / max(self._seen, 1), 8),
        }


class ReplayFigures:
    """What a replay did: times, what became of places, regions, rooms and doors, flips of numbers.

    Examples
    --------
    >>> from hybridnav.ext.live import ReplayFigures, replay
    >>> cells = np.zeros((9, 21))
    >>> first = hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)
    >>> cells[4, 10] = 1.0
    >>> figures = ReplayFigures()
    >>> for step in replay([first, hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)]):
    ...     figures.add(step)
    >>> figures.figures()["places"]["apart"]["flipped"], figures.figures()["faults"]
    (0, [])
    """

    def __init__(self) -> None:
        self._places, self._regions, self._rooms = Identities(), Identities(), Identities()
        self._last: ReplayStep | None = None
        self._n_doors: Counter[str] = Counter()
        self._lost_names: list[str] = []

    def add(self, step: ReplayStep) -> None:
        """Count a step."""
        self._last = step
        if step.place_flips is not None:
            self._places.add(step.update, step.place_flips, step.seconds)
        if step.rooms_update is not None and step.room_flips is not None:
            self._rooms.add(step.rooms_update, step.room_flips, step.rooms_seconds)
            for event in _OF_DOORS:
                self._n_doors[event] += len(getattr(step.rooms_update.doors, event))
            self._lost_names += step.rooms_update.lost_names.values()
        if step.region_flips is not None:
            self._regions.add(step.regions_update, step.region_flips, step.regions_seconds)

    def figures(self) -> dict[str, Any]:
        """Return the figures as plain values for JSON.

        Returns
        -------
        dict
            `places` and `rooms` with `updates`, `median_ms` and `p95_ms` of an update, counts of
            events, `flipped_cells` an update, `flipped_share`, their share of the cells that stayed
            free, and the shares of them that flip by merging and by cutting off; for the places
            that are `untouched`, `apart` and `far` in some update (see `Flips`) how many there are,
            how many of them flip then, the number of flips, and the share that flips in an update;
            `regions` with the same, if they are followed; `doors` with events, and `lost_names` of
            rooms that died; counts of the last map; `faults` of its levels, see `faults_of`.
        """
        last = self._last
        if last is None:
            return {}
        regions = last.regions
        pyramid = last.places.pyramid if regions is None else regions.pyramid
        of_regions = {} if regions is None else {"regions": self._regions.figures()}
        return {
            "maps": last.number + 1,
            "cells": list(last.places.grid.shape),
            "n_places": last.places.n_places,
            "n_regions": None if regions is None else regions.n_regions,
            "n_rooms": len(last.rooms.numbers),
            "n_doors": sum(not door.is_gap for door in last.rooms.doors.values()),
            "places": self._places.figures(),
            **of_regions,
            "rooms": self._rooms.figures(),
            "doors": {event: self._n_doors[event] for event in _OF_DOORS},
            "lost_names": list(self._lost_names),
            "levels": len(pyramid),
            "faults": faults_of(pyramid),
        }


def faults_of(levels: Iterable[Level]) -> list[str]:
    """Compare the arcs of every level with boundaries that are read from the fields alone.

    A boundary is a set of cracks that are joined in 2 x 2 blocks with exactly two of them. Two
    fields have as many arcs as boundaries.

    Parameters
    ----------
    levels
        Levels, such as those of a pyramid.

    Returns
    -------
    list of str
        A line on each level whose arcs are others; none if all is well.
    """
    return [fault for level in levels for fault in _faults(level)]


def _faults(level: Level) -> Iterable[str]:
    rows, cols = level.grid.shape
    edges, classes = find_cracks(level.field_of.ravel(), rows, cols)
    _, first = np.unique(classes, return_index=True)
    one, other = endpoints_of(edges[first], cols)
    fields = level.field_of.ravel()
    read = np.sort(np.stack([fields[one], fields[other]], axis=1), axis=1)
    arcs = np.sort(level.arcs[~level.is_self_loop], axis=1)
    if not np.array_equal(read[np.lexsort(read.T)], arcs[np.lexsort(arcs.T)]):
        yield f"level {level.index} has {len(arcs)} arcs, its fields have {len(read)} boundaries"
