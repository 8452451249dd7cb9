"""Counter-examples and worst cases: where they are, in metres, and their pictures."""

from __future__ import annotations

import shlex
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import MapError
from hybridnav.harness.judges import chords_of
from hybridnav.harness.methods import REFERENCE
from hybridnav.harness.outcome import Outcome, query_key
from hybridnav.harness.records import decode_path
from hybridnav.harness.report import CounterExample, WorstCase
from hybridnav.harness.scenes import MapSpec, map_digest, read_map
from hybridnav.maps import MAX_CELLS, Frame

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray
    from hybridnav.harness.analysis import Study
    from hybridnav.harness.records import Record
    from hybridnav.maps import OccupancyGrid

MAX_FAULTS_SHOWN = 50
WORST_CASES = 2

CaseKey = tuple[str, str, str]
"""Method, id of the record and text of a case, which its picture and its line share."""


def counter_examples(study: Study, drawn: dict[CaseKey, str]) -> list[CounterExample]:
    """Return the contradictions of a study, up to `MAX_FAULTS_SHOWN` of them.

    Parameters
    ----------
    study
        The study.
    drawn
        Anchors of the pictures of those that are drawn.

    Returns
    -------
    list of CounterExample
        The first of each method, then the second of each, and so on; a line about the number of
        others last.
    """
    ranked = [
        (rank, outcome, record, text)
        for outcome in study.outcomes
        for rank, (record, text) in enumerate(outcome.faults)
    ]
    ranked.sort(key=lambda fault: fault[0])
    found = [(outcome, record, text) for _, outcome, record, text in ranked]
    lines = [
        CounterExample(
            f"{outcome.map_name}, {outcome.label}, {_pair_text(record)}: {text}",
            command=command_of(outcome, record),
            anchor=drawn.get((outcome.label, record["id"], text), ""),
        )
        for outcome, record, text in found[:MAX_FAULTS_SHOWN]
    ]
    if len(found) > MAX_FAULTS_SHOWN:
        others = f"and {len(found) - MAX_FAULTS_SHOWN} more, see records.jsonl"
        lines.append(CounterExample(others))
    return lines


def command_of(outcome: Outcome, record: Record) -> str:
    """Return the command that plans the pair of a record, in metres, by the preset, or by the
    reference for other methods; empty for other records, and for those of older versions, which
    hold no frame."""
    about = outcome.preparation
    if record["type"] != "pair" or "origin" not in about:
        return ""
    x, y, yaw = about["origin"]
    frame = Frame(about["resolution_m"], (x, y), yaw)
    (start, goal) = frame.points_of([record["start"], record["goal"]]).tolist()
    ends = [
        f"--{name}={point[0]:.6g},{point[1]:.6g}"
        for name, point in (("start", start), ("goal", goal))
    ]
    words = ["hybridnav", "plan", about["file"], *ends]
    words.append(f"--robot-radius={about['robot_radius_m']:g}")
    words.append(f"--preset={(about.get('preset') or {}).get('name', REFERENCE)}")
    return shlex.join(words)


def _pair_text(record: Record) -> str:
    if record["type"] != "pair":
        return "all pairs"
    return f"cells {tuple(record['start'])} to {tuple(record['goal'])}"


def cases_of(outcome: Outcome) -> list[tuple[CaseKey, WorstCase]]:
    """Return counter-examples, and the pairs with the largest losses, two of presets and one of
    others, with their pictures; none where the map is no longer there."""
    cases = [(record, fault) for record, fault in outcome.faults[:WORST_CASES]]
    if outcome.label != REFERENCE:
        shown = WORST_CASES if outcome.preparation.get("preset") is not None else 1
        own = {query_key(record): record for record in outcome.records}
        how = "dear" if outcome.yardstick == "weighted" else "long"
        order = np.argsort(-np.nan_to_num(outcome.losses, nan=0.0), kind="stable")[:shown]
        for at in order[outcome.losses[order] > 0]:
            record = own[query_key(outcome.references[at])]
            cases.append((record, f"{100 * outcome.losses[at]:.1f} % too {how}"))
    drawn = []
    for record, text in cases:
        case = _case(outcome, record, text)
        if case is not None:
            drawn.append(((outcome.label, record["id"], text), case))
    return drawn


def _case(outcome: Outcome, record: Record, text: str) -> WorstCase | None:
    from hybridnav.harness.report import paths_uri  # noqa: PLC0415 - loads matplotlib

    about = outcome.preparation
    if "file" not in about:
        return None
    try:
        # As large as it may be: the run has read it.
        spec = MapSpec(about["file"], about["robot_radius_m"], about["corner_cutting"], MAX_CELLS)
        grid = read_map(spec)
    except MapError:  # it is no longer there
        return None
    if map_digest(grid) != about.get("grid_sha", about["map_sha"]):
        return None
    optimum = None
    if record["type"] == "pair":
        path = _path(record, grid)
        reference = outcome.optimum.get(query_key(record))
        if reference is not None and reference.get("path"):
            optimum = _path(reference, grid)
    else:  # a fault of the regions: the two cells that show it
        path = grid.frame.points_of(record["fault_cells"][record["faults"].index(text)])
    title = f"{outcome.label}, {_pair_text(record)}: {text}"
    return WorstCase(title, paths_uri(grid, path, optimum), command=command_of(outcome, record))


def _path(record: Record, grid: OccupancyGrid) -> FloatArray:
    """Return the points to draw for an answer: its path, or its endpoints if it has none."""
    start, goal = record["start"], record["goal"]
    if record.get("points"):
        points = np.array(record["points"], dtype=np.float64)
        if record.get("headings_rad") and np.isfinite(points).all():
            points = chords_of(grid, points, record["headings_rad"]).points
        return points[np.isfinite(points).all(axis=1)]
    if record.get("path"):
        return grid.frame.points_of(decode_path((start[0], start[1]), record["path"]))
    return grid.frame.points_of([start, goal])
