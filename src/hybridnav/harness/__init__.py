"""The harness: consistency, loss and efficiency of topological and metric layers, measured.

S. Thrun: Learning metric-topological maps for indoor mobile robot navigation, 1998.
"""

from hybridnav.harness.analysis import Study, load_study, to_frame
from hybridnav.harness.compare import compare_runs
from hybridnav.harness.names import NamedMethod, read_methods
from hybridnav.harness.output import write_outputs
from hybridnav.harness.run import RunSettings, evaluate
from hybridnav.harness.yardstick import AnyAngleOptimum

__all__ = [
    "AnyAngleOptimum",
    "NamedMethod",
    "RunSettings",
    "Study",
    "compare_runs",
    "evaluate",
    "load_study",
    "read_methods",
    "to_frame",
    "write_outputs",
]
