"""What small runs of the harness share: a map, names of methods, runs in this process."""

import os
from pathlib import Path

import numpy as np
import pytest

from hybridnav.harness import RunSettings, write_records
from hybridnav.maps import CellClass

ROOT = Path(__file__).parents[2]
ROOMS = [
    "####################",
    "#........#.........#",
    "#........#.........#",
    "#..................#",
    "#........#.........#",
    "#........#.........#",
    "######.#######.#####",
    "#........#.........#",
    "#........#......####",
    "#........#......#..#",
    "####################",
]
"""Four rooms in a row of doors, and a closet without one."""


def importable():
    """Return a value of PYTHONPATH with which other processes import this clone's tests."""
    return os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))


def name_of(method):
    return f"{method.__module__}:{method.__name__}"


def label_of(method):
    """Return the name that a class of `faulty_methods` gives itself."""
    return method.__name__


def write_map(folder, lines, name="rooms"):
    body = "".join(f"{line}\n" for line in lines).replace("#", "@")
    path = folder / f"{name}.map"
    path.write_text(f"type octile\nheight {len(lines)}\nwidth {len(lines[0])}\nmap\n{body}")
    return path


def free_pairs(classes, count, seed):
    cells = np.argwhere(classes == CellClass.FREE)
    if not len(cells):
        return []
    chosen = cells[np.random.default_rng(seed).integers(len(cells), size=(count, 2))]
    return [((a, b), (c, d)) for (a, b), (c, d) in chosen.tolist()]


def outcome_of(study, method):
    """Return what a study holds of a method, by its class or by its name in tables."""
    names = {method} if isinstance(method, str) else {name_of(method), label_of(method)}
    return next(outcome for outcome in study.outcomes if outcome.label in names)


def run_in(folder, **settings):
    """Make a run without a process of its own into a folder, on `ROOMS` unless maps are given."""
    maps = (str(write_map(folder, ROOMS)),)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hybridnav.harness.run.run_local", run_here)
        write_records(RunSettings(**{"maps": maps} | settings), folder / "run")
    return folder / "run"


def run_here(tasks, **_settings):
    """Instead of `run_local`: no process is started, where none is what a test is about."""
    return (list(task.run()) for task in tasks)
