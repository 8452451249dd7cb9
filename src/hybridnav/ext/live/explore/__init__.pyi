from .exploring import (
    By as By,
    Exploration as Exploration,
    MOST_GOALS as MOST_GOALS,
    Step as Step,
    explore as explore,
)
from .goals import Goals as Goals
from .robot import laser_all_round as laser_all_round

__all__: list[str]
