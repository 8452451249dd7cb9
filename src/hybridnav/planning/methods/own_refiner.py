"""Refiners of the user's own, and other classes that a preset names as `module:Class`."""

from __future__ import annotations

import inspect
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np

from hybridnav._base.moves import STEPS, legal_moves
from hybridnav._base.typing import BoolArray, ByteArray, LongArray
from hybridnav.errors import PresetError
from hybridnav.maps import OccupancyGrid
from hybridnav.planning import PlannerSettings
from hybridnav.refine import Refiner
from hybridnav.route import Corridor

Cell = tuple[int, int]

_MAX_SHOWN = 120
"""Characters of a foreign error that a message quotes."""


def own_refiner(grid: OccupancyGrid, settings: PlannerSettings) -> Refiner | None:
    """Import the class that settings name, and return a refiner of it whose paths are checked.

    `settings`: their `refine` is `module:Class`, else there is none. The class is called with the
    grid and the keyword `allow_unexplored`. Raises `PresetError` when the module cannot be
    imported, has no such class, or the class makes no refiner.
    """
    name, allow_unexplored = settings.own_refiner, settings.allow_unexplored
    if name is None:
        return None
    own = class_of(name)
    try:
        made = own(grid, allow_unexplored=allow_unexplored)
    except Exception as error:
        call = f"{own.__name__}(grid, allow_unexplored={allow_unexplored})"
        raise refused(name, f"{call} fails, {one_line(error)}") from error
    try:
        inspect.signature(made.refine).bind((0, 0), (0, 0), None)
    except (AttributeError, TypeError, ValueError) as error:
        expected = "expected a method refine(start, goal, corridor)"
        raise refused(name, f"it is no refiner, {one_line(error)}: {expected}") from error
    return CheckedRefiner(name, made, grid, allow_unexplored=allow_unexplored)


def class_of(name: str, key: str = "planner.refine") -> Any:
    """Import the class that a setting names."""
    module, _, attribute = name.partition(":")
    try:
        found = getattr(import_module(module), attribute, None)
    except (Exception, SystemExit) as error:
        raise refused(
            name, f"module {module} cannot be imported, {one_line(error)}", key
        ) from error
    if not inspect.isclass(found):
        what = "has nothing of that name" if found is None else f"has a {type(found).__name__}"
        raise refused(name, f"module {module} {what}, expected a class {attribute}", key)
    return found


class CheckedRefiner:
    """A refiner of the user's own, with its name; its answers are checked before a result shows
    them."""

    def __init__(
        self, name: str, own: Refiner, grid: OccupancyGrid, *, allow_unexplored: bool
    ) -> None:
        self._name = name
        self._own = own
        self._grid = grid
        self._allow_unexplored = allow_unexplored

    def refine(
        self, start: Cell, goal: Cell, corridor: Corridor | None
    ) -> tuple[LongArray | None, int]:
        """Find a path; see `Refiner`.

        Raises `PresetError` when the refiner returns something else than legal moves from start to
        goal inside the corridor, and a number of expansions.
        """
        returned: Any = self._own.refine(start, goal, corridor)
        try:
            given, expanded = returned
            cells = None if given is None else np.array(given)
            count = int(expanded)
        except (TypeError, ValueError, OverflowError):
            raise self._wrong("something else than (cells, expanded)") from None
        if cells is None:
            return None, count
        if cells.ndim != 2 or cells.shape[1] != 2 or cells.dtype.kind not in "iu":  # noqa: PLR2004
            raise self._wrong(f"cells of shape {cells.shape} and type {cells.dtype}")
        path: LongArray = cells.astype(np.int64)
        if not len(path) or tuple(path[0]) != tuple(start) or tuple(path[-1]) != tuple(goal):
            raise self._wrong(f"a path that does not lead from {tuple(start)} to {tuple(goal)}")
        if not self._is_legal(path):
            raise self._wrong("a path with a move that is not legal on the grid")
        if corridor is not None and not corridor.mask()[tuple(path.T)].all():
            raise self._wrong("a path that leaves its corridor")
        return path, count

    def _is_legal(self, path: LongArray) -> bool:
        """Return whether all cells may be entered, and all moves are legal."""
        if not ((path >= 0) & (path < self._grid.shape)).all():
            return False
        steps = np.diff(path, axis=0)
        is_step = (steps[:, None] == STEPS).all(axis=2)
        legal = self._moves[tuple(path[:-1].T)][:, None] >> np.arange(8, dtype=np.uint8) & 1 == 1
        return bool(self._enterable[tuple(path[0])] and (is_step & legal).any(axis=1).all())

    @cached_property
    def _enterable(self) -> BoolArray:
        return self._grid.enterable(allow_unexplored=self._allow_unexplored)

    @cached_property
    def _moves(self) -> ByteArray:
        """uint8 (rows, cols), masks of the legal moves."""
        enterable = np.ascontiguousarray(self._enterable)
        return legal_moves(enterable, self._grid.corner_cutting)

    def _wrong(self, what: str) -> PresetError:
        return refused(
            self._name,
            f"refine returned {what}, expected (cells, expanded): whole numbers of shape (n, 2) by "
            "legal moves from start to goal, or None, and a count",
        )


def refused(name: str, why: str, key: str = "planner.refine") -> PresetError:
    """Return the error that refuses a class."""
    return PresetError(f"{key}: {name}: {why}")


def one_line(error: BaseException) -> str:
    """Return a foreign error in one line."""
    text = " ".join(f"{type(error).__name__}: {error}".split())
    return text if len(text) <= _MAX_SHOWN else f"{text[:_MAX_SHOWN]} ..."
