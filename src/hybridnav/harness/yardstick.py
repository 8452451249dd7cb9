"""What answers are held against: the reference of losses, and the answers of other methods. Public:
`AnyAngleOptimum`.
"""

from typing import Any, Literal, NamedTuple, get_args

from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.search.mesh import MeshSearch, build_mesh

Cell = tuple[int, int]
Record = dict[str, Any]

REGIONS = "regions"
"""Metric of methods that have plans alone."""

Yardstick = Literal["both", "any-angle", "octile", "weighted"]
"""What losses refer to: each path's own metric, in a run with costs `weighted`; for all paths the
any-angle optimum; the octile optimum, which any-angle paths have no loss over; the least cost of
paths of cells, for the costs of all paths."""


Optimum = Literal["any-angle", "octile", "weighted"]
"""What the losses of one table refer to."""


YARDSTICKS: dict[Yardstick, tuple[Optimum, ...]] = {
    "both": ("any-angle", "octile"),
    "any-angle": ("any-angle",),
    "octile": ("octile",),
    "weighted": ("weighted",),
}
"""The optima that losses refer to, one table each, by the metric that is asked for."""

OPTIMA: dict[Optimum, str] = {
    "any-angle": "the any-angle optimum",
    "octile": "the octile optimum",
    "weighted": "the least cost of paths of cells",
}
"""The name of each optimum in captions."""

REFERS_TO: dict[Yardstick, str] = {
    "both": "the any-angle optimum in one table, the octile optimum in another, which any-angle "
    "paths are not in",
    "any-angle": "the any-angle optimum, for all paths",
    "octile": "the octile optimum; any-angle paths have none",
    "weighted": "the least cost of paths of cells, for the costs of all paths",
}
"""What losses refer to, in words."""


def check_yardstick(metric: str) -> None:
    """Raise `InvalidValueError` if there is no such yardstick."""
    if metric not in get_args(Yardstick):
        known = ", ".join(get_args(Yardstick))
        raise InvalidValueError(f"losses refer to one of {known}, got metric {brief(metric)}")


class AnyAngleOptimum:
    """Lengths of shortest any-angle paths between the centres of cells, by the convex mesh.

    Every legal path of the octile grid is an any-angle path between the same two centres, so no
    method's path is shorter, whatever its metric.

    Parameters
    ----------
    grid
        The map. Without corner cutting: an any-angle path never passes between two blocked cells
        that meet at a corner.

    Examples
    --------
    >>> from hybridnav.harness import AnyAngleOptimum
    >>> optimum = AnyAngleOptimum(hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0))
    >>> optimum.length_m((0, 0), (0, 3))
    3.0
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self._search = MeshSearch(build_mesh(grid.classes == CellClass.FREE))
        self._resolution_m = grid.resolution_m

    def length_m(self, start: Cell, goal: Cell) -> float:
        """Return the length between the centres of two free cells, infinite for no path.

        Parameters
        ----------
        start, goal
            (row, col) of free cells.
        """
        centres = (start[0] + 0.5, start[1] + 0.5), (goal[0] + 0.5, goal[1] + 0.5)
        return self._search.path((start, goal), centres).length_cells * self._resolution_m


# Contradictions of an answer by the answers of other methods, and above all by the optimum.

SLACK = 1e-9
"""Relative difference of lengths that is rounding."""

ANY_ANGLE_SLACK = 1e-6
"""That of any-angle lengths: the judge of segments rounds points to 2^-24 of a cell, so a path may
cut each corner by as much."""

ARC_SLACK = 1e-5
"""That of costs of arcs, which judges read by chords."""

PLANNED = "planned"
"""Status of records whose answer is a plan of regions, without a path."""

ANSWERED = ("solved", PLANNED, "no path")
"""Statuses of records that hold an answer."""

NOT_ASKED = "not asked"
"""Status of all records of a method that cannot take the map, by a limit of its own."""
TOO_SLOW = "too slow"
"""Status of a query that is not asked, because the time of its method on the map is spent."""


Kind = Literal["regions", "plan to path", "path to plan", "paths", "no path", "bounds", "proofs"]
"""What a contradiction is about: the regions of a map; a plan without a path; a path without a
plan; a path that is none; whether there is a path; lengths, costs and bounds; a proof of those."""

KINDS: tuple[Kind, ...] = get_args(Kind)


class Fault(NamedTuple):
    """A contradiction that the judge found."""

    kind: Kind
    """What the contradiction is about."""
    text: str
    """The contradiction in words."""


def is_any_angle(record: Record) -> bool:
    """Return whether a record holds an any-angle path, which is compared with such paths only."""
    return bool(record.get("metric") == "any-angle")


def compared(words: str, *lengths: float) -> str:
    """Return words with lengths in their braces: with six decimals, or in full where lengths that
    differ would look alike."""
    texts = [f"{length:.6f} m" for length in lengths]
    if len(set(texts)) < len(set(lengths)):
        texts = [f"{float(length)!r} m" for length in lengths]
    return words.format(*texts)


def contradiction(record: Record, reference: Record) -> Fault | None:
    """Return the contradiction of an answer by the optima, None if there is none.

    `reference`: the reference's record of the same pair, which holds both optima.
    """
    here, there = record["status"], reference["status"]
    if {here, there} <= set(ANSWERED) and (here == "no path") != (there == "no path"):
        text = f"solvability: {here}, but on the whole grid: {there}"
        return Fault("no path", text)
    if record.get("length_m") is None or reference.get("length_m") is None:
        return None
    wrong = _cost_contradiction(record, reference.get("weighted_m"))
    if not wrong and is_any_angle(record):
        wrong = _any_angle_contradiction(record, reference.get("any_angle_m"))
    elif not wrong:
        wrong = _cells_contradiction(record, reference)
    return Fault("bounds", wrong) if wrong else None


def octile_optimum_m(reference: Record) -> float:
    """Return the length of the shortest path of cells that a record of the reference holds."""
    return float(reference["octile_m"] if "octile_m" in reference else reference["length_m"])


def _cost_contradiction(record: Record, optimum: float | None) -> str | None:
    """Return the contradiction of costs by the least cost of paths of cells.

    An any-angle path may cost less, and a bound on all any-angle paths holds for paths of cells.
    """
    cost, bound = record.get("cost_m"), record.get("cost_lower_bound_m")
    if optimum is None or cost is None:
        return None
    if cost < optimum * (1 - SLACK) and not is_any_angle(record):
        return compared("cost {} is below the weighted optimum {}", cost, optimum)
    of_cells = record.get("cost_grid_bound_m")
    if of_cells is not None and of_cells > optimum * (1 + SLACK):
        words = "the lower bound on paths of cells {} is above the weighted optimum {}"
        return compared(words, of_cells, optimum)
    slack = ANY_ANGLE_SLACK if is_any_angle(record) else SLACK
    if bound is not None and bound > optimum * (1 + slack):
        words = "the lower bound on costs {} is above the weighted optimum {}"
        return compared(words, bound, optimum)
    return None


def _cells_contradiction(record: Record, reference: Record) -> str | None:
    length, optimum = record["length_m"], octile_optimum_m(reference)
    if length < optimum * (1 - SLACK):
        return compared("length {} is below the optimum {}", length, optimum)
    bound = record.get("bound")
    if bound is not None and length > optimum * bound * (1 + SLACK) + SLACK:
        words = f"length {{}} breaks its bound, {bound:.6f} x optimum {optimum:.6f} m = {{}}"
        return compared(words, length, bound * optimum)
    return None


def _any_angle_contradiction(record: Record, optimum: float | None) -> str | None:
    if optimum is None:  # corners may be cut
        return None
    length = record["length_m"]
    if length < optimum * (1 - ANY_ANGLE_SLACK):
        return compared("length {} is below the any-angle optimum {}", length, optimum)
    bound = record.get("lower_bound_m")
    if bound is not None and bound > optimum * (1 + ANY_ANGLE_SLACK):
        return compared("the lower bound {} is above the any-angle optimum {}", bound, optimum)
    return None
