"""The judges of paths, optima and losses.

What is legal and what is shortest they decide by code of their own. With the planners they share
the grid and its frame, the cells that a line passes, which name a path and judge none, and the
exact comparison of two products, which tests hold against fractions.
"""

from hybridnav.metrics.anyangle import AnyAnglePath, VisibilityGraph
from hybridnav.metrics.arcs import Chords, chords_of
from hybridnav.metrics.cheapest import CheapestCost
from hybridnav.metrics.judge import ScipyOptimum, Verdict, judge_path, segment_faults
from hybridnav.metrics.judge_line import judge_line, line_cells
from hybridnav.metrics.segmentation import RoomAgreement, compare_rooms
from hybridnav.metrics.statistics import (
    Buckets,
    PairedDifference,
    Summary,
    distance_buckets,
    paired_difference,
    summarise,
    thrun_count,
)

__all__ = [
    "AnyAnglePath",
    "Buckets",
    "CheapestCost",
    "Chords",
    "PairedDifference",
    "RoomAgreement",
    "ScipyOptimum",
    "Summary",
    "Verdict",
    "VisibilityGraph",
    "chords_of",
    "compare_rooms",
    "distance_buckets",
    "judge_line",
    "judge_path",
    "line_cells",
    "paired_difference",
    "segment_faults",
    "summarise",
    "thrun_count",
]
