from .exploring import (
    MOST_GOALS as MOST_GOALS,
    By as By,
    Exploration as Exploration,
    Step as Step,
    explore as explore,
)
from .goals import Goals as Goals
from .robot import Sensor as Sensor, laser_all_round as laser_all_round

__all__: list[str]
