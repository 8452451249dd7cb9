"""The figures of the study as plain values: all that its page, its tables and its quotes hold."""

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.subjects._study_run import read_note
from hybridnav.harness.analysis import Study, load_study
from hybridnav.harness.columns import (
    CONSISTENCY_COLUMNS,
    EFFICIENCY_COLUMNS,
    consistency_row,
    figures,
    loss_columns,
)
from hybridnav.harness.names import REFERENCE
from hybridnav.harness.outcome import MapQuery, Outcome
from hybridnav.harness.output import rows_of_methods
from hybridnav.harness.records import Record
from hybridnav.harness.timing import Circumstances
from hybridnav.harness.yardstick import ANSWERED, TOO_SLOW, YARDSTICKS

LEVELS_FILE = "descent.json"
"""Loss and work of descents that end at each level, in the study's folder."""
LEAST_SOLVED = 0.99
"""Share of the pairs that a method solves which is compared over the pairs in common."""

BESIDE = ("octile", "shortest")
"""Presets whose speed-ups stand beside those of methods that solved fewer pairs."""

_DIGITS = 6
_COUNTS = (
    "pairs", "solved", "pairs in common", "nodes", "edges", "faults", "backups",
    "backups of the grid / backups",
)  # fmt: skip
_OF_PAGE = ("numpy", "scipy", "numba", "python", "hybridnav", "processor", "machine")
"""What is told of the machine: not its name."""

Data = dict[str, Any]


def collect(folder: Path, root: Path, kinds: Mapping[str, str]) -> Data:
    """Return all figures of a study.

    `folder`: the study's folder, with one of records for each part; `root`: maps are named by their
    paths from here; `kinds`: the kind of each map by that name. Returns strings, numbers, lists
    and dicts, as JSON has them: None for a missing figure, "never" for an infinite one.
    """
    noted, levels = read_note(folder), folder / LEVELS_FILE
    studies = studies_of(folder, root)
    ompl = noted["ompl"]
    return {
        "plan": noted["plan"],
        "seconds": {name: round(seconds) for name, seconds in noted["seconds"].items()},
        "missing": noted["missing"],
        "machine": _machine(studies.values()) | ({"ompl": ompl} if ompl else {}),
        "maps": _maps(studies.values(), kinds),
        "parts": {name: part_figures(study) for name, study in studies.items()},
        **({"descent": json.loads(levels.read_text("utf-8"))} if levels.exists() else {}),
    }


def studies_of(folder: Path, root: Path) -> dict[str, Study]:
    """Return the parts of a study that were run."""
    names = read_note(folder)["seconds"]
    return {name: load_study(folder / name, root=root) for name in names}


def groups(study: Study) -> tuple[list[str], list[str]]:
    """Return the methods that are compared over the pairs in common, and the others.

    The others solved fewer than `LEAST_SOLVED` of the pairs, because they could not be made on a
    map, were too slow there, or failed: their hard pairs would be missing for all.
    """
    asked = sum(len(outcome.references) for outcome in study.of_method(REFERENCE))
    solved = {
        label: sum(len(outcome.solved_keys) for outcome in study.of_method(label))
        for label in study.labels
    }
    whole = [label for label in study.labels if solved[label] >= LEAST_SOLVED * asked]
    return whole, [label for label in study.labels if label not in whole]


def common_pairs(study: Study, labels: Sequence[str]) -> set[MapQuery]:
    """Return the pairs that all of some methods solved."""
    solved = (
        {pair for outcome in study.of_method(label) for pair in outcome.solved_keys}
        for label in labels
    )
    return set.intersection(*solved)


def part_figures(study: Study) -> Data:
    """Return the figures of one part; see `collect`."""
    whole, rest = groups(study)
    common = common_pairs(study, whole)
    about = study.circumstances
    asked = sum(len(outcome.references) for outcome in study.of_method(REFERENCE))
    return {
        "metric": study.metric,
        "costs": study.costs,
        "pairs": asked,
        "pairs in common": len(common),
        "checks": study.checks,
        "checked any-angle": study.any_angle_checked,
        "contradictions": len(study.faults),
        "first contradictions": [f"{o.map_name}, {o.label}: {text}" for o, _, text in study.faults][
            :10
        ],
        "repeat": about.repeat,
        "dates": list(about.dates),
        "loads": [round(load, 2) for load in _span(about)],
        "warnings": study.warnings,
        "methods": [_row(study, label, common) for label in whole],
        "others": [_other(study, label, whole) for label in rest],
        "settings": {str(r["method"]): r["settings"] for r in rows_of_methods(study)},
        "consistency": [_consistency(study, label) for label in study.labels],
        "unanswered": _unanswered(study),
        "by map": _by_map(study, whole, common),
    }


def _span(about: Circumstances) -> tuple[float, ...]:
    """Return the load at the start, at the end, and the highest that the timing pass itself met."""
    loads = about.loads
    return (loads[0], loads[-1], about.most_load) if loads else ()


def _row(study: Study, label: str, common: set[MapQuery]) -> Data:
    outcomes = study.of_method(label)
    row = figures(outcomes, _references(study, outcomes), common)
    losses = [column for optimum in YARDSTICKS[study.metric] for column in loss_columns(optimum)]
    columns = dict.fromkeys([*_COUNTS, *losses, *EFFICIENCY_COLUMNS])
    return {"method": label} | {c: plain(row[c]) for c in columns if c in row}


def _other(study: Study, label: str, whole: Sequence[str]) -> Data:
    """Return the figures of a method over the pairs that it and all of `whole` solved, and the
    speed-ups of our presets over the same pairs."""
    common = common_pairs(study, [*whole, label])
    row = _row(study, label, common) if _has_solved(study, label) else {"method": label}
    beside = [own for own in BESIDE if own in whole]
    return row | {
        "maps": sum(bool(outcome.solved_keys) for outcome in study.of_method(label)),
        **{f"speed-up of {own}": _row(study, own, common)["speed-up"] for own in beside},
    }


def _has_solved(study: Study, label: str) -> bool:
    """Return whether a method solved a pair."""
    return any(outcome.solved_keys for outcome in study.of_method(label))


def _references(study: Study, outcomes: Sequence[Outcome]) -> list[Outcome]:
    of_map = {outcome.map_name: outcome for outcome in study.of_method(REFERENCE)}
    return [of_map[outcome.map_name] for outcome in outcomes if outcome.map_name in of_map]


def _consistency(study: Study, label: str) -> Data:
    row = consistency_row(study.of_method(label))
    return {"method": label} | {column: plain(row[column]) for column in CONSISTENCY_COLUMNS}


def _unanswered(study: Study) -> list[Data]:
    """Return for each method and kind of failure the queries without an answer, their maps, and the
    reason of the first."""
    found: dict[tuple[str, str], Data] = {}
    for outcome in study.outcomes:
        about = outcome.preparation
        for record in outcome.records:
            if record["status"] in ANSWERED:
                continue
            what = _what(about if about["status"] != "ready" else record)
            reason = about.get("error") or record.get("error") or record["status"]
            new = {"method": outcome.label, "what": what, "queries": 0, "maps": {}, "first": reason}
            entry = found.setdefault((outcome.label, what), new)
            entry["queries"] += 1
            entry["maps"][outcome.map_name] = None
    return [{**entry, "maps": list(entry["maps"])} for entry in found.values()]


def _what(record: Record) -> str:
    """Return what happened, by the record of a query, or of a preparation that failed."""
    failed = "not made" if record["type"] == "preparation" else "failed"
    known = {TOO_SLOW: TOO_SLOW, "timeout": TOO_SLOW, "lost": "crashed", "error": failed}
    return known.get(record["status"], _REFUSED if failed == "not made" else "gave up")


_REFUSED = "not asked"
"""What happened to a method that takes no such map."""


def _by_map(study: Study, whole: Sequence[str], common: set[MapQuery]) -> list[Data]:
    rows = []
    optimum = YARDSTICKS[study.metric][0]
    for name in study.maps:
        of_map = {outcome.label: outcome for outcome in study.of_map(name)}
        row: Data = {"map": name}
        for label in whole:
            found = figures([of_map[label]], [of_map[REFERENCE]], common)
            row[label] = {
                "loss": plain(found.get(f"{optimum} loss mean %", math.nan)),
                "ms": plain(found["query ms, median"]),
                "preparation s": plain(found["preparation s"]),
            }
        rows.append(row)
    return rows


def _machine(studies: Iterable[Study]) -> Data:
    """Return versions and processors, as recorded; several if they differ."""
    found: dict[str, dict[str, None]] = {}
    for study in studies:
        for outcome in study.outcomes:
            about = outcome.preparation
            for key, value in about.get("environment", {}).items():
                if key in _OF_PAGE:
                    found.setdefault(key, {})[value] = None
            if about.get("version"):
                found.setdefault("planners of others", {})[about["version"]] = None
    return {key: ", ".join(values) for key, values in found.items()}


def _maps(studies: Iterable[Study], kinds: Mapping[str, str]) -> list[Data]:
    found: dict[str, Data] = {}
    for study in studies:
        for outcome in study.of_method(REFERENCE):
            about = outcome.preparation
            found.setdefault(
                outcome.map_name,
                {
                    "map": outcome.map_name,
                    "kind": kinds.get(outcome.map_name, ""),
                    "cells": about["shape"][0] * about["shape"][1],
                    "free cells": about["free_cells"],
                    "cell m": about["resolution_m"],
                    "robot radius m": about["robot_radius_m"],
                },
            )
    return list(found.values())


def plain(value: str | float) -> str | float | None:
    """Return a figure as JSON has it, with six digits."""
    if isinstance(value, str | int):
        return value
    if math.isnan(value):
        return None
    return "never" if math.isinf(value) else float(f"{value:.{_DIGITS}g}")
