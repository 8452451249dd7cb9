"""Times of a run and their circumstances: the timing pass, its repeats, the load of the machine."""

from __future__ import annotations

import math
import statistics
from dataclasses import dataclass, field
from datetime import datetime
from typing import TYPE_CHECKING

from hybridnav.harness.outcome import query_key

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hybridnav.harness.outcome import Outcome
    from hybridnav.harness.records import Record

BUSY = 1.5
"""Load above which a machine is busy in the timing pass, whose one process is a load of 1."""

_MEMORY_S = 60.0
"""Seconds after which a reading of the load remembers what came before to the share 1 / e."""

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
                text += " in the pass, without what was before it"
            facts.append(("load of the machine", text))
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
        found = []
        if self.is_busy:
            found.append(
                f"The machine was busy: a load of up to {self.most_load:.2f}, of which this run "
                "made 1. Measure again on a quiet machine."
            )
        if self.apart:
            found.append(
                f"Times of {', '.join(self.apart)} were not taken beside those of the others."
            )
        return found


def lay_times(
    timed: Sequence[Record], pairs: Mapping[Key, Sequence[Record]]
) -> dict[str, set[str]]:
    """Lay the times of the timing pass over the seconds of the answers.

    The pass with the most methods on a map counts, the last one of equals.

    Parameters
    ----------
    timed
        Records of timing passes.
    pairs
        Records of answers, by hashes of map and method; their `seconds` become the medians, the
        times themselves their `repeats`, and `asked_seconds` keep what the answer took.

    Returns
    -------
    dict
        By the hash of a map the hashes of the methods in its pass.
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
) -> Circumstances:
    """Return the circumstances of the times of a study.

    Parameters
    ----------
    timed
        Records of timing passes.
    outcomes
        Outcomes of the study.
    together
        What `lay_times` returned.
    commands
        Command lines of the runs.
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
    found = []
    for record in loaded:
        passed_s = (datetime.fromisoformat(record["date"]) - began).total_seconds()
        if passed_s >= _MEMORY_S:
            share = math.exp(-passed_s / _MEMORY_S)
            found.append((record["load"] - share * before) / (1 - share))
    return tuple(found or (record["load"] for record in loaded))
