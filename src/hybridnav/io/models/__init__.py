"""Models: a map with everything that planners have prepared on it, in one file."""

from hybridnav.io.models.kept import save
from hybridnav.io.models.model import Model, is_model, open_model

__all__ = ["Model", "is_model", "open_model", "save"]
