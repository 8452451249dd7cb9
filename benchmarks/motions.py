"""Time of a motion check, call included: `python -m benchmarks.motions`.

Two rooms of 10 x 20 m with a door of 0.9 m, cells of 0.05 m; a disc of 0.3 m, and a footprint of
0.6 x 1.8 m. The last column is the time over that of a state of the disc, the cheapest call.
"""

from __future__ import annotations

import math
import timeit
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.refine import MotionCheck

if TYPE_CHECKING:
    from collections.abc import Callable

_FOOTPRINT = [[0.9, 0.3], [0.9, -0.3], [-0.9, -0.3], [-0.9, 0.3]]
_CALLS, _REPEATS = 20_000, 7


def _map() -> OccupancyGrid:
    occupied = np.zeros((400, 400), dtype=np.float32)
    occupied[:, 200] = 1
    occupied[191:209, 200] = 0
    return OccupancyGrid(occupied, frame=Frame(0.05), robot_radius_m=0.3)


def main() -> None:
    """Print a table of calls."""
    disc, truck = MotionCheck(_map()), MotionCheck(_map(), footprint=_FOOTPRINT)
    rows: list[tuple[str, Callable[..., bool], tuple[float, ...]]] = [
        ("state, disc", disc.state_valid, (5.0, 5.0)),
        ("1 m straight, disc", disc.motion_valid, (5.0, 5.0, 6.0, 5.1)),
        ("5 m straight, disc", disc.motion_valid, (3.0, 5.0, 8.0, 6.0)),
        ("state in the open", truck.state_valid, (5.0, 5.0, 0.3)),
        ("state in the door", truck.state_valid, (10.0, 10.0, 0.05)),
        ("state beside the wall", truck.state_valid, (9.6, 5.0, 1.5)),
        ("1 m with a turn in the open", truck.turn_valid, (5.0, 5.0, 0.3, 6.0, 5.5, 0.5)),
        ("4 m straight through the door", truck.turn_valid, (8.0, 10.0, 0.0, 12.0, 10.0, 0.0)),
        ("4 m with a turn through it", truck.turn_valid, (8.0, 10.0, 0.04, 12.0, 10.0, -0.04)),
        ("4 m with a turn into the wall", truck.turn_valid, (8.0, 7.0, 0.0, 12.0, 7.0, 0.5)),
        ("half a turn 5 cm beside the wall", truck.turn_valid, (9.0, 5.0, 0.0, 9.0, 5.0, math.pi)),
        ("Dubins, 5 m in the open", truck.dubins_valid, (3.0, 5.0, 0.0, 7.0, 7.0, 0.0, 1.5)),
        ("Dubins, 6 m through the door", truck.dubins_valid, (7.0, 9.8, 0.0, 13.0, 10.0, 0.0, 1.5)),
        ("Reeds-Shepp, 5 m", truck.reeds_shepp_valid, (3.0, 5.0, 0.0, 4.0, 7.0, 0.0, 1.5)),
    ]
    print(f"{'motion':34}{'valid':>7}{'us':>8}{'ratio':>8}")
    least = math.inf
    for name, check, where in rows:
        valid = check(*where)
        timer = timeit.Timer(lambda check=check, where=where: check(*where))  # type: ignore[misc]
        taken = min(timer.repeat(_REPEATS, _CALLS)) / _CALLS * 1e6
        least = min(least, taken)
        print(f"{name:34}{valid!s:>7}{taken:8.2f}{taken / least:8.1f}")


if __name__ == "__main__":
    main()
