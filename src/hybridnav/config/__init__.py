"""Configuration: presets and the safe reading of YAML."""

from hybridnav.config.ompl import OmplSettings
from hybridnav.config.preset import (
    PlannerSettings,
    Preset,
    PyramidSettings,
    load_preset,
    preset_names,
)

__all__ = [
    "OmplSettings",
    "PlannerSettings",
    "Preset",
    "PyramidSettings",
    "load_preset",
    "preset_names",
]
