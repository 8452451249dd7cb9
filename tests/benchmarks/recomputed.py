"""The figures of a study, computed from the lines of its records by plain Python alone."""

import json
import math
import statistics
from typing import Any

REFERENCE = "grid-astar"
COUNTS = ("expanded", "expanded_nodes", "expanded_intervals")
LEAST = 0.99


def quantile(values, share):
    """Return a quantile by linear interpolation."""
    values = sorted(values)
    at = share * (len(values) - 1)
    low = math.floor(at)
    high = min(low + 1, len(values) - 1)
    return values[low] + (at - low) * (values[high] - values[low])


class Recomputed:
    """What the records of one part hold."""

    def __init__(self, folder):
        lines = (folder / "records.jsonl").read_text(encoding="utf-8").splitlines()
        records = [json.loads(line) for line in lines]
        self.ready = {}
        self.answers: dict[str, dict[tuple[str, str], dict[str, Any]]] = {}
        self.times = {}
        for record in records:
            key = record["map_sha"], json.dumps([record.get(k) for k in ("kind", "start", "goal")])
            if record["type"] == "preparation":
                self.ready[record["map_sha"], record["method"]] = record
            elif record["type"] == "pair":
                self.answers.setdefault(record["method"], {})[key] = record
            elif record["type"] == "timed pair":
                self.times[key] = record["times"]
        self.methods = list(self.answers)
        reference = self.answers[REFERENCE]
        self.asked = [key for key, r in reference.items() if (r.get("length_m") or 0) > 0]
        solved = {name: self.solved(name) for name in self.methods}
        self.whole = [n for n in self.methods if len(solved[n]) >= LEAST * len(self.asked)]
        self.common = set.intersection(*(solved[name] for name in self.whole))

    def solved(self, name):
        """Return the pairs that a method solved itself, without a fault."""
        found = set()
        for key in self.asked:
            record = self.answers[name].get(key, {})
            fine = record.get("status") == "solved" and not record["faults"]
            if fine and not record.get("by_grid"):
                found.add(key)
        return found

    def pairs(self, name):
        """Return the pairs on the maps that a method takes."""
        refused = {
            s for (s, n), r in self.ready.items() if n == name and r["status"] == "not asked"
        }
        return [key for key in self.asked if key[0] not in refused]

    def shared(self, name):
        """Return the pairs over which a method is compared, in a fixed order."""
        common = self.common if name in self.whole else self.common & self.solved(name)
        return [key for key in self.asked if key in common]

    def losses(self, name, optimum):
        found = []
        for key in self.shared(name):
            own, best = self.answers[name][key], self.answers[REFERENCE][key]
            if optimum == "weighted":
                loss = own["cost_m"] / best["weighted_m"] - 1
            elif optimum == "any-angle":
                loss = own["length_m"] / best["any_angle_m"] - 1
            elif own.get("metric") == "any-angle":
                continue
            else:
                loss = own["length_m"] / best["length_m"] - 1
            found.append(0.0 if -1e-6 <= loss <= 1e-9 else loss)
        return found

    def loss_figures(self, name, optimum):
        """Return the figures of the table of losses over one optimum."""
        losses = self.losses(name, optimum)
        if not losses:
            return {}
        figures = {
            "mean %": statistics.fmean(losses),
            "median %": statistics.median(losses),
            "p95 %": quantile(losses, 0.95),
            "max %": max(losses),
            "without loss %": sum(loss <= 1e-9 for loss in losses) / len(losses),
        }
        return {f"{optimum} loss {what}": 100 * value for what, value in figures.items()}

    def seconds(self, name, key):
        """Return the times of a pair, one if it was asked once."""
        record = self.answers[name][key]
        digest = record["method_sha"]
        return self.times.get(key, {}).get(digest) or [record["seconds"]]

    def efficiency(self, name):
        """Return the figures of time, work and memory."""
        keys = self.shared(name)
        own = [statistics.median(self.seconds(name, key)) for key in keys]
        grid = [statistics.median(self.seconds(REFERENCE, key)) for key in keys]
        ready = [r for (_, n), r in self.ready.items() if n == name and r["status"] == "ready"]
        spent = [r["pyramid_seconds"] + r["method_seconds"] for r in ready]
        memory = [r["memory_bytes"] for r in ready]
        cells = [self._expanded(REFERENCE, key) for key in keys]
        things = [self._expanded(name, key) for key in keys]
        of_cell = sum(grid) / sum(cells)
        spreads = [
            (max(t) - min(t)) / statistics.median(t)
            for t in (self.seconds(name, key) for key in keys)
            if len(t) > 1
        ]
        return {
            "query ms, median": 1e3 * statistics.median(own),
            "query ms, p95": 1e3 * quantile(own, 0.95),
            "speed-up": statistics.median(g / o for g, o in zip(grid, own, strict=True)),
            "speed-up of means": sum(grid) / sum(own),
            "preparation s": statistics.fmean(spent),
            "memory MB": statistics.fmean(memory) / 1e6,
            "nodes": statistics.fmean(r["n_nodes"] for r in ready),
            "edges": statistics.fmean(r["n_edges"] for r in ready),
            "work in cells": statistics.fmean(own) / of_cell,
            **({"spread %": 100 * statistics.median(spreads)} if spreads else {}),
            **({"expansions": statistics.fmean(things)} if sum(things) else {}),
        }

    def _expanded(self, name, key):
        return sum(self.answers[name][key].get(count) or 0 for count in COUNTS)

    def counts(self, name):
        """Return how many pairs there are, and how many of them are solved."""
        solved = self.solved(name)
        return {
            "pairs": len(self.pairs(name)),
            "solved": len(solved),
            "solved %": 100 * len(solved) / len(self.pairs(name)),
            "pairs in common": len(self.shared(name)),
        }

    def gaps(self, name):
        """Return the mean and the largest gap to the proved bound on costs."""
        gaps = []
        for key in self.shared(name):
            record = self.answers[name][key]
            if record.get("cost_lower_bound_m"):
                gap = record["cost_m"] / record["cost_lower_bound_m"] - 1
                gaps.append(0.0 if gap <= 1e-9 else gap)
        if not gaps:
            return {}
        return {"gap mean %": 100 * statistics.fmean(gaps), "gap max %": 100 * max(gaps)}

    def checked(self, name):
        """Return the numbers of checks by kind, and of pairs rightly without a path."""
        found = dict.fromkeys(("regions", "plan to path", "path to plan", "paths", "bounds"), 0)
        rightly = answered = 0
        for (_, method), record in self.ready.items():
            if method == name:
                found["regions"] += "regions" in record.get("checked", ())
        for key, record in self.answers[name].items():
            best = self.answers[REFERENCE][key]
            for kind in ("plan to path", "path to plan"):
                found[kind] += kind in record.get("checked", ())
            found["paths"] += record["status"] == "solved"
            found["bounds"] += record["status"] == best["status"] == "solved"
            rightly += record["status"] == best["status"] == "no path"
            answered += record["status"] in {"solved", "no path"}
        return found, rightly, answered
