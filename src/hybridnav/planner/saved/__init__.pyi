from .saving import save as save
from .model import Model as Model, is_model as is_model, load as load, open_model as open_model

__all__: list[str]
