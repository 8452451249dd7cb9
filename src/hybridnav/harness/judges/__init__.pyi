from .judge_line import AnyAnglePath as AnyAnglePath, VisibilityGraph as VisibilityGraph
from .cheapest import Chords as Chords, chords_of as chords_of
from .cheapest import CheapestCost as CheapestCost
from .contacts import (
    Clearance as Clearance,
    Contact as Contact,
    clearance_of as clearance_of,
    contacts_of as contacts_of,
)
from .judge import (
    ScipyOptimum as ScipyOptimum,
    Verdict as Verdict,
    judge_path as judge_path,
    segment_faults as segment_faults,
)
from .judge_line import judge_line as judge_line, line_cells as line_cells
from .statistics import (
    Buckets as Buckets,
    PairedDifference as PairedDifference,
    Summary as Summary,
    distance_buckets as distance_buckets,
    paired_difference as paired_difference,
    summarise as summarise,
    thrun_count as thrun_count,
)

__all__: list[str]
