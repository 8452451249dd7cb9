"""The file of `hybridnav plan --poses`: a path as poses for a controller."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import hybridnav as hn
from hybridnav._files import replace_file

if TYPE_CHECKING:
    from pathlib import Path

ENDINGS = (".csv", ".json")
_SPACING_M = 0.05


def write_poses(path: Path, outcome: hn.PlanResult | hn.Tour) -> None:
    """Write the poses of a plan, or of all plans of a tour one after the other.

    In CSV, a line of names and a line for each pose: x, y in metres, yaw in radians, and the
    direction in which the robot leaves it, 1 for ahead, -1 for backwards. In JSON one object, with
    a list of the same four numbers for each pose. Without a path there are no poses.

    Parameters
    ----------
    path
        A file that ends in .csv or .json; it is replaced.
    outcome
        What was planned.
    """
    results = [outcome] if isinstance(outcome, hn.PlanResult) else outcome.results
    rows = [
        [*(round(value, 6) for value in pose), direction]
        for result in results
        if result.path is not None
        for pose, direction in zip(
            result.path.poses(_SPACING_M).tolist(),
            result.path.directions(_SPACING_M).tolist(),
            strict=True,
        )
    ]
    names = ["x", "y", "yaw", "direction"]
    if path.suffix.lower() == ".json":
        text = json.dumps({"names": names, "poses": rows}, allow_nan=False)
    else:
        text = "\n".join(",".join(map(str, row)) for row in [names, *rows])
    replace_file(path, f"{text}\n".encode())
