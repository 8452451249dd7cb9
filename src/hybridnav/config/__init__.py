"""Configuration: presets and the safe reading of YAML."""

from hybridnav.config.ompl import OmplSettings
from hybridnav.config.preset import (
    DEFAULT_ROBOT_RADIUS_M,
    ClearanceSettings,
    CostSettings,
    PlannerSettings,
    Preset,
    PyramidSettings,
    load_preset,
    preset_names,
)

__all__ = [
    "DEFAULT_ROBOT_RADIUS_M",
    "ClearanceSettings",
    "CostSettings",
    "OmplSettings",
    "PlannerSettings",
    "Preset",
    "PyramidSettings",
    "load_preset",
    "preset_names",
]
