"""The timing pass: all methods of a map in one process, asked pair by pair in shuffled order.

The answers of a run come from one task for each method, which can die, hang and be resumed alone.
Times from such tasks differ by what else the machine did meanwhile, so they are measured anew:
one process prepares all methods that were made, and asks each pair of all of them, in an order
that a seed shuffles, `repeat` times. Its tasks are resumed pair by pair too.
"""

import hashlib
import math
import os
import statistics
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import cached_property
from pathlib import Path

import numpy as np

from hybridnav._base.clock import clock
from hybridnav.errors import InvalidValueError
from hybridnav.harness.judging import warm_up
from hybridnav.harness.methods import Prepared, prepare
from hybridnav.harness.names import MethodSpec
from hybridnav.harness.outcome import Outcome
from hybridnav.harness.records import Record, query_key
from hybridnav.harness.scenes import MapSpec, Pair, read_scene

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

        Yields one of the beginning, then one for each pair.
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
                began = clock()
                try:
                    ready[asked[at]].ask(pair.start, pair.goal)
                except Exception:  # noqa: BLE001, S112 - it had an answer, and has no time now
                    continue
                times[asked[at]].append(clock() - began)
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
            **(self.pairs[index - 1].fields if index else {}),
            "faults": [],
        }


def circumstances() -> Record:
    """Return the date and the load of the machine, the mean of the last minute of processes that
    run or wait."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {"date": datetime.now(timezone.utc).isoformat(timespec="seconds"), "load": load}


BUSY = 1.5
"""Load above which a machine is busy in the timing pass, whose one process is a load of 1."""

_MEMORY_S = 60.0
"""Seconds after which earlier load has the share 1 / e of a reading."""

Key = tuple[str, str]
"""Hashes of a map and a method."""


@dataclass(frozen=True)
class Circumstances:
    """The circumstances of the times of a study."""

    repeat: int = 0
    """Queries of each method and pair in the timing pass, 0 without one."""
    dates: tuple[str, str] = ("", "")
    """First and last, UTC."""
    loads: tuple[float, ...] = ()
    """Loads of the machine in the timing pass, in the order of the records. The first ones remember
    the minute before, in which the run answered all pairs with all its processes."""
    own_loads: tuple[float, ...] = ()
    """The same without what was before the pass, from its second minute on; of a shorter pass all
    loads, as they are."""
    began: tuple[float, ...] = ()
    """Loads when the runs began."""
    apart: tuple[str, ...] = ()
    """Methods whose times are not of the timing pass of the others."""
    commands: tuple[str, ...] = field(default=())
    """Command lines of the runs."""

    @property
    def is_busy(self) -> bool:
        """Whether other processes ran during the timing pass."""
        return self.most_load > BUSY

    @property
    def most_load(self) -> float:
        """The highest load that the pass itself met."""
        return max(self.own_loads, default=0.0)

    @property
    def facts(self) -> list[tuple[str, str]]:
        """The circumstances in words."""
        facts = [("times", self._how)]
        if self.dates[0]:
            facts.append(("measured", " to ".join(dict.fromkeys(self.dates))))
        if self.loads:
            start, end = self.loads[0], self.loads[-1]
            text = f"{start:.2f} at the start, {end:.2f} at the end, {self.most_load:.2f} at most"
            if self.own_loads != self.loads:
                text += " in the pass, without earlier load"
            facts.append(("load of the machine", text))
        elif self.began:
            facts.append(("load of the machine", f"{self.began[-1]:.2f} when the last run began"))
        facts += [("command", command) for command in self.commands]
        return facts

    @property
    def _how(self) -> str:
        if not self.repeat:
            return (
                "of single queries, one method after the other: --repeat 5 interleaves the methods "
                "pair by pair"
            )
        return (
            f"medians of {self.repeat} queries of each pair, all methods in one process in an "
            "order shuffled for each pair"
        )

    @property
    def warnings(self) -> list[str]:
        """What speaks against the times, a sentence each."""
        notes = []
        if self.is_busy:
            notes.append(
                f"The machine was busy: a load of up to {self.most_load:.2f}; this run made 1 "
                "of it. Measure again on a quiet machine."
            )
        if self.apart:
            notes.append(
                f"Times of {', '.join(self.apart)} were not taken beside those of the others."
            )
        return notes


def lay_times(
    timed: Sequence[Record], pairs: Mapping[Key, Sequence[Record]]
) -> dict[str, set[str]]:
    """Lay the times of the timing pass over the seconds of the answers.

    The pass with the most methods on a map counts, the last one of equals.

    `timed`: records of timing passes; `pairs`: records of answers, by hashes of map and method;
    their `seconds` become the medians, the times themselves their `repeats`, and `asked_seconds`
    keep what the answer took. Result: by the hash of a map the hashes of the methods in its pass.
    """
    heads = [record for record in timed if record["type"] == "timing" and "methods" in record]
    best: dict[str, Record] = {}
    for head in heads:
        other = best.get(head["map_sha"])
        if other is None or len(head["methods"]) >= len(other["methods"]):
            best[head["map_sha"]] = head
    of_pair: dict[tuple[str, str], dict[object, Record]] = {
        key: {query_key(record): record for record in records} for key, records in pairs.items()
    }
    for record in timed:
        sha = record["map_sha"]
        if record["status"] != "timed" or best[sha]["method_sha"] != record["method_sha"]:
            continue
        for digest, times in record["times"].items():
            answer = of_pair.get((sha, digest), {}).get(query_key(record))
            if answer is not None and times:
                answer["asked_seconds"] = answer["seconds"]
                answer["seconds"], answer["repeats"] = statistics.median(times), times
    return {sha: set(head["methods"]) for sha, head in best.items()}


def circumstances_of(
    timed: Sequence[Record],
    outcomes: Sequence[Outcome],
    together: Mapping[str, set[str]],
    commands: Sequence[str],
    began: Sequence[float] = (),
) -> Circumstances:
    """Return the circumstances of the times of a study.

    `timed`: records of timing passes; `together`: what `lay_times` returned; `commands`: command
    lines of the runs; `began`: loads when they began.
    """
    used = [record for record in timed if record["status"] in {"ready", "timed"}]
    dates = [record["date"] for record in used if "date" in record]
    loaded = [record for record in used if record.get("load") is not None]
    apart = [
        outcome.label
        for outcome in outcomes
        if together
        and outcome.preparation["status"] == "ready"
        and outcome.preparation["method_sha"]
        not in together.get(outcome.preparation["map_sha"], set())
    ]
    return Circumstances(
        repeat=max((record["repeat"] for record in used), default=0),
        dates=(min(dates), max(dates)) if dates else ("", ""),
        loads=tuple(record["load"] for record in loaded),
        own_loads=_own_loads(loaded),
        began=tuple(began),
        apart=tuple(dict.fromkeys(apart)),
        commands=tuple(dict.fromkeys(commands)),
    )


def _own_loads(loaded: Sequence[Record]) -> tuple[float, ...]:
    """Return the loads that a timing pass itself met.

    A load is a mean over the past that forgets: after t seconds the share exp(-t / 60) of it is
    what was before the first reading. That share is taken out, where it is small enough: from the
    second minute on.
    """
    if not loaded:
        return ()
    began, before = datetime.fromisoformat(loaded[0]["date"]), loaded[0]["load"]
    loads = []
    for record in loaded:
        passed_s = (datetime.fromisoformat(record["date"]) - began).total_seconds()
        if passed_s >= _MEMORY_S:
            share = math.exp(-passed_s / _MEMORY_S)
            loads.append((record["load"] - share * before) / (1 - share))
    return tuple(loads or (record["load"] for record in loaded))
