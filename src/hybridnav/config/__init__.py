"""Configuration: presets and the safe reading of YAML."""

from hybridnav.config.preset import (
    PlannerSettings,
    Preset,
    PyramidSettings,
    load_preset,
    preset_names,
)

__all__ = ["PlannerSettings", "Preset", "PyramidSettings", "load_preset", "preset_names"]
