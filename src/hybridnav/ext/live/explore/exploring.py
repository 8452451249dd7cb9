"""Exploration of a floor plan by a simulated robot, until nothing in its reach is unknown. Public:
`By`, `MOST_GOALS` and `Step`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal, get_args

import numpy as np

from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.explore.goals import Goals
from hybridnav.ext.live.explore.robot import Robot, laser_all_round
from hybridnav.ext.live.mapping import SimulatedLaser
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.checks import checked_whole
from hybridnav.topology import TopologicalMap

By = Literal["path", "frontier", "room"]
"""How goals are ranked."""
MOST_GOALS = 10_000
"""Choices after which an exploration ends, whatever is left."""
_LEAVES_M = 3.0
"""Cost of the nearest goal from which the robot leaves where it is, and first looks round there for
doors that its map may have closed."""


@dataclass(frozen=True, eq=False)
class Step:
    """Knowledge of the robot when it chose a goal.

    Examples
    --------
    >>> from hybridnav.ext.live.explore import Step, explore
    >>> room = np.ones((20, 30), dtype=np.float32)
    >>> room[2:-2, 2:-2] = 0.0
    >>> steps: list[Step] = []
    >>> plan = hn.OccupancyGrid(room, hn.Frame(0.1), robot_radius_m=0.1)
    >>> done = explore(plan, watch=steps.append)
    >>> steps[-1].chosen
    -1
    """

    topology: TopologicalMap
    pose: tuple[float, float, float]
    goals: Goals
    chosen: int
    """Index of the goal, -1 where none is left: at the end, and before the robot drives back or
    looks again. If the goal is far, the robot may look again nearer by first."""


@dataclass(frozen=True, eq=False)
class Exploration:
    """The map that a robot made of a floor plan.

    Examples
    --------
    >>> from hybridnav.ext.live.explore import explore
    >>> room = np.ones((20, 30), dtype=np.float32)
    >>> room[2:-2, 2:-2] = 0.0
    >>> done = explore(hn.OccupancyGrid(room, hn.Frame(0.1), robot_radius_m=0.1), (1.0, 1.0))
    >>> done.n_given_up, done.share_known
    (0, 1.0)
    """

    grid: OccupancyGrid
    """The map that the robot made."""
    topology: TopologicalMap
    points: FloatArray = field(repr=False)
    """float64 (n, 2), where the robot took scans, in metres."""
    driven_m: float
    """Metres driven."""
    n_goals: int
    """Goals that the robot drove to; a look again on the way there is none."""
    n_given_up: int
    """Unexplored cells given up: they stayed so on three visits, or no path led there."""
    n_looks_again: int
    """Spots from which the robot scanned doubtful cells and narrow gaps again."""
    share_known: float
    """Share of the floor plan's free cells in the robot's reach that its map knows."""
    is_complete: bool
    """Whether no goal was left; False where the number of choices ended it. A door that is closed
    in the map may still hide the rest of `share_known`."""
    seconds: dict[str, float] = field(repr=False)
    """Seconds of computing: mapping, pyramid, goals, rooms, planning."""


def explore(  # noqa: PLR0913 - all but the first have defaults
    world: OccupancyGrid,
    start: tuple[float, float] | None = None,
    *,
    sensor: SimulatedLaser | None = None,
    seed: int = 0,
    by: By = "path",
    most_goals: int = MOST_GOALS,
    watch: Callable[[Step], None] | None = None,
    progress: Progress = no_progress,
) -> Exploration:
    """Explore a floor plan from a point until nothing in the robot's reach is unknown.

    The robot scans, makes its map and follows it with its pyramid. The unexplored places that it
    can drive to are its goals. It plans to the nearest one by the cost of the path (Yamauchi 1997),
    on the places that it knows, by the preset `paper`. It scans on the way, and chooses again when
    it is there or the goal has become known from afar. An unexplored cell that stays unexplored on
    three visits, or that no path leads to, is given up.

    Noise can close a door or a gap in the map. So when no goal is left, the robot drives back the
    way it came if that leads to a part of its map with goals. Else it takes the occupied cells away
    whose probability is below 0.9, and takes itself to be a cell thinner. Where it could then go
    on, it drives near, scans again and starts anew, at most three times at a spot. Before it leaves
    for a goal that is farther than 3 m, it does this where such a spot is nearer.

    Parameters
    ----------
    world
        The floor plan, with the robot's radius. Cells that are not free count as walls, and so does
        everything outside.
    start
        `(x, y)` in metres, map frame, in a free cell of the plan; None for the one farthest from
        walls.
    sensor
        By default a laser of 360 beams all round with a range of 8 m and a noise of 1 cm.
    seed
        Seed of the sensor's noise and of the pyramid, a whole number >= 0.
    by
        How goals are ranked. `"path"`: by the cost of the path alone. `"frontier"`: by the same,
        the robot drives to each goal although it has become known, as Yamauchi's does, and it
        looks again only when no goal is left.
        `"room"`: as `"path"`, but goals in the room that the robot is in come first.
    most_goals
        Choices after which the exploration ends, from 1 to 10,000: of goals, and of drives back and
        looks again, which count alike.
    watch
        Called with a `Step` at each choice, and at the end.
    progress
        Called with known and all cells in reach.

    Raises
    ------
    InvalidValueError
        When the start is not in a free cell, or noise leaves no free cell round the robot. When the
        number of goals or the seed is out of range, or there is no such ranking.

    Examples
    --------
    >>> from hybridnav.ext.live.explore import explore
    >>> room = np.ones((20, 30), dtype=np.float32)
    >>> room[2:-2, 2:-2] = 0.0
    >>> plan = hn.OccupancyGrid(room, hn.Frame(0.1), robot_radius_m=0.1)
    >>> explore(plan, most_goals=1).n_goals <= 1
    True
    """
    most_goals = checked_whole("most_goals", most_goals, 1, MOST_GOALS)
    seed = checked_whole("seed", seed, 0, 2**63 - 1)
    if by not in get_args(By):
        raise InvalidValueError(f"by must be one of {', '.join(get_args(By))}, got {by!r:.40}")
    robot = Robot(world, start, laser_all_round() if sensor is None else sensor, seed)
    is_complete = False
    for _ in range(most_goals):
        goals = robot.look()
        progress(robot.known_cells(), robot.reach_cells)
        first = robot.in_its_room(goals) if by == "room" else np.ones(len(goals), np.bool_)
        chosen = int(np.lexsort((goals.costs_m, ~first))[0]) if len(goals) else -1
        if watch is not None:
            watch(Step(robot.topology, robot.pose, goals, chosen))
        if chosen < 0:
            is_complete = not (robot.go_back() or robot.look_again())
            if is_complete:
                break
            continue
        cost_m = float(goals.costs_m[chosen])
        leaves = by != "frontier" and cost_m > _LEAVES_M
        if not (leaves and robot.look_again(within_m=cost_m)):
            robot.visit(goals, chosen, arrives=by == "frontier")
    return Exploration(
        robot.topology.grid,
        robot.topology,
        np.array(robot.points),
        robot.driven_m,
        robot.n_goals,
        robot.n_given_up,
        robot.n_looks_again,
        robot.known_cells() / robot.reach_cells,
        is_complete,
        dict(robot.seconds),
    )
