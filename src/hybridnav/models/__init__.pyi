from .export import (
    export_path as export_path,
    export_places as export_places,
    export_rooms as export_rooms,
)
from .model import Model as Model, load as load
from .one_call import plan as plan
from .saving import save as save

__all__: list[str]
