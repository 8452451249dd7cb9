"""The timing pass: all methods of a map in one process, asked pair by pair in shuffled order.

The answers of a run come from one task for each method, which can die, hang and be resumed alone.
Times from such tasks differ by what else the machine did meanwhile, so they are measured anew:
one process prepares all methods that were made, and asks each pair of all of them, in an order
that a seed shuffles, `repeat` times. Its tasks are resumed pair by pair too.
"""

from __future__ import annotations

import hashlib
import os
import statistics
import time
from contextlib import ExitStack, closing
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.harness.methods import prepare
from hybridnav.harness.scenes import read_scene
from hybridnav.harness.task import warm_up

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav.harness.methods import MethodSpec, Prepared
    from hybridnav.harness.pairs import Pair
    from hybridnav.harness.records import Record
    from hybridnav.harness.scenes import MapSpec

_DIGITS = 12
LONG_S = 0.05
"""Median seconds of a method's queries beyond which it is asked once for each further pair: what
disturbs a short query is little beside a long one."""
_WATCHED = 2
"""Pairs that each method is asked `repeat` times, whatever it takes: a first query may prepare."""


@dataclass(frozen=True)
class TimingTask:
    """The timing of all methods on one map. Those whose queries take more than `LONG_S` are asked
    once for each pair but the first two."""

    map: MapSpec
    map_sha: str
    methods: tuple[MethodSpec, ...]
    pairs: tuple[Pair, ...]
    repeat: int
    """Queries of each method and pair."""
    seed: int = 0
    """Seed of the order of methods."""
    without: frozenset[tuple[str, str]] = frozenset()
    """Digests of methods and keys of pairs that had no answer: they are not asked again."""
    attempt: int = 0
    """Number of times that the task was lost before it began."""

    @cached_property
    def digest(self) -> str:
        """Short hash of the methods and the number of repeats: times of other methods, taken in
        another pass, are other records."""
        text = " ".join([*sorted(spec.digest for spec in self.methods), str(self.repeat)])
        return hashlib.sha256(text.encode()).hexdigest()[:_DIGITS]

    @cached_property
    def ids(self) -> tuple[str, ...]:
        """Ids of the task's records: of the beginning, then of the pairs."""
        head = f"{self.map_sha[:12]}/timing-{self.digest}"
        return f"{head}/preparation", *(f"{head}/{pair.key}" for pair in self.pairs)

    def run(self) -> Iterator[Record]:
        """Prepare the methods, and time the pairs.

        Yields
        ------
        Record
            One of the beginning, then one for each pair.
        """
        scene = read_scene(self.map)
        if scene.digest != self.map_sha:
            raise InvalidValueError(f"map {self.map.path} has changed since the run began")
        with ExitStack() as stack:
            ready: dict[str, Prepared] = {}
            for spec in self.methods:
                warm_up(spec, by_costs=scene.costs is not None)
                prepared = prepare(spec, scene.grid, scene.costs)
                ready[spec.digest] = stack.enter_context(closing(prepared))
            yield {**self._common(0), "status": "ready", **circumstances()}
            seen: dict[str, list[float]] = {digest: [] for digest in ready}
            for index, pair in enumerate(self.pairs, start=1):
                once = {
                    digest
                    for digest, before in seen.items()
                    if index > _WATCHED and before and statistics.median(before) > LONG_S
                }
                times = self._times(ready, pair, once)
                for digest, new in times.items():
                    seen[digest] += new
                yield {**self._common(index), "status": "timed", "times": times, **circumstances()}

    def _times(
        self, ready: dict[str, Prepared], pair: Pair, once: set[str]
    ) -> dict[str, list[float]]:
        """Return the seconds of each query by the digest of its method; some are asked once."""
        asked = [digest for digest in ready if (digest, pair.key) not in self.without]
        times: dict[str, list[float]] = {digest: [] for digest in asked}
        seed = hashlib.sha256(f"{self.seed} {pair.key}".encode()).digest()
        rng = np.random.default_rng(list(seed))
        for _ in range(self.repeat):
            for at in rng.permutation(len(asked)).tolist():
                if asked[at] in once and times[asked[at]]:
                    continue
                began = time.perf_counter()
                try:
                    ready[asked[at]].solve(pair.start, pair.goal)
                except Exception:  # noqa: BLE001, S112 - it had an answer, and has no time now
                    continue
                times[asked[at]].append(time.perf_counter() - began)
        return times

    def failed_record(self, index: int, status: str) -> Record:
        """Return the record of a pair, or with index 0 of the beginning, whose process was lost or
        too slow."""
        return {**self._common(index), "status": status}

    def _common(self, index: int) -> Record:
        return {
            "id": self.ids[index],
            "type": "timed pair" if index else "timing",
            "map": Path(self.map.path).stem,
            "map_sha": self.map_sha,
            "method": "all",
            "method_sha": self.digest,
            "repeat": self.repeat,
            **({} if index else {"methods": sorted(spec.digest for spec in self.methods)}),
            **(_of_pair(self.pairs[index - 1]) if index else {}),
            "faults": [],
        }


def _of_pair(pair: Pair) -> Record:
    return {"kind": pair.kind, "start": list(pair.start), "goal": list(pair.goal)}


def circumstances() -> Record:
    """Return the date and the load of the machine, the mean of the last minute of processes that
    run or wait."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {"date": datetime.now(UTC).isoformat(timespec="seconds"), "load": load}
