from .saving import save as save
from .model import Model as Model, load as load

__all__: list[str]
