from .client import (
    OmplQuery as OmplQuery,
    Reply as Reply,
    Search as Search,
    Setup as Setup,
    Worker as Worker,
    require_ompl as require_ompl,
    start_ahead as start_ahead,
)
from .problem import Corridors as Corridors
from .settings import OmplSettings as OmplSettings

__all__: list[str]
