from .analysis import Study as Study, load_study as load_study, to_frame as to_frame
from .compare import compare_runs as compare_runs
from .names import NamedMethod as NamedMethod
from .judges import Clearance as Clearance, Contact as Contact
from .path_files import RecordedPath as RecordedPath, load_paths as load_paths
from .recorded import Detour as Detour, JudgedPath as JudgedPath
from .output import write_outputs as write_outputs
from .one_call import evaluate as evaluate
from .run import RunSettings as RunSettings, write_records as write_records
from .workers import distances_on_cluster as distances_on_cluster
from .yardstick import AnyAngleOptimum as AnyAngleOptimum

__all__: list[str]
