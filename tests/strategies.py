"""Hypothesis strategies for maps of all three classes, and maps drawn as text."""

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from hybridnav.maps import CellClass, Frame, OccupancyGrid, RoomLabels
from hybridnav.pyramid import DualGraphPyramid, Linkage

Classes = NDArray[np.uint8]

MAX_SIDE = 12 if os.environ.get("NUMBA_DISABLE_JIT", "0") != "0" else 40
"""Largest side of a random map; kernels that run as plain Python get small ones."""

_EXAMPLES = float(os.environ.get("HYBRIDNAV_EXAMPLES", "0.3"))

_PROBABILITY = {CellClass.OCCUPIED: 1.0, CellClass.FREE: 0.0, CellClass.UNEXPLORED: 0.5}
_LETTERS = {"#": CellClass.OCCUPIED, ".": CellClass.FREE, "?": CellClass.UNEXPLORED}
_CLASSES = st.sampled_from([1, 1, 2, 0])
seeds = st.integers(0, 2**32 - 1)


IS_FULL = "HYBRIDNAV_EXAMPLES" in os.environ
"""Whether many random examples are asked for, as `make test-full` does."""


def examples(count: int, full: int = 0) -> int:
    """Return how many random examples a test tries: three in ten of those named, twice as many as
    named where `IS_FULL`, or then by the same factor of a number of their own."""
    return max(5, round((full if full and IS_FULL else count) * _EXAMPLES))


def tried(count: int, /, *strategies: Any, **by_name: Any) -> Any:
    """A test of random examples, as many as `examples` says."""
    return lambda test: settings(max_examples=examples(count))(given(*strategies, **by_name)(test))


def full_but(often: Any, values: Any) -> list[Any]:
    """Values of parameters, each but those in `often` marked `full`; tuples hold one a name."""
    rows = {v: v if isinstance(v, tuple) else (v,) for v in values}
    return [v if v in often else pytest.param(*rows[v], marks=pytest.mark.full) for v in values]


def drawn(*lines: str) -> Classes:
    """Classes of a map drawn with y up, so that the last line is row 0: `.` `?` `#`."""
    return np.array([[_LETTERS[letter] for letter in line] for line in reversed(lines)], np.uint8)


def occupancy_grid(classes: Classes, *, resolution_m: float = 1.0) -> OccupancyGrid:
    """Grid whose cells have these classes under the default thresholds."""
    probability = np.zeros(classes.shape, dtype=np.float32)
    for cell_class, value in _PROBABILITY.items():
        probability[classes == cell_class] = value
    return OccupancyGrid(probability, frame=Frame(resolution_m=resolution_m), robot_radius_m=0)


def framed(
    classes: Classes, yaw_rad: float = 0.0, *, corner_cutting: bool = False
) -> OccupancyGrid:
    """The map with a resolution, an origin and a yaw that no rounding is kind to."""
    frame = Frame(resolution_m=0.05, origin_m=(12.3, -7.1), yaw_rad=yaw_rad)
    probability = occupancy_grid(classes).probability
    return OccupancyGrid(probability, frame=frame, corner_cutting=corner_cutting, robot_radius_m=0)


def free_cells(classes: Classes, seed: int, count: int) -> list[tuple[int, int]]:
    """Some free cells of a map, none of a map without."""
    free = np.argwhere(classes == CellClass.FREE)
    if not len(free):
        return []
    chosen = np.random.default_rng(seed).integers(len(free), size=count)
    return [(int(row), int(col)) for row, col in free[chosen]]


@dataclass(frozen=True)
class Scene:
    """A map and what a pyramid is built with."""

    classes: Any
    resolution_m: float
    merge_distance_m: float
    seed: int

    @property
    def grid(self) -> OccupancyGrid:
        return occupancy_grid(self.classes, resolution_m=self.resolution_m)

    def pyramid(self, linkage: Linkage) -> DualGraphPyramid:
        return DualGraphPyramid.build(
            self.grid, merge_distance_m=self.merge_distance_m, linkage=linkage, seed=self.seed
        )


def level_of(scene: Scene, index: int) -> Any:
    """A level of the scene's pyramid, the last one where there are fewer."""
    pyramid = scene.pyramid("radius")
    return pyramid[min(index, len(pyramid) - 1)]


@st.composite
def class_grids(draw: st.DrawFn, max_side: int = MAX_SIDE) -> Classes:
    """Draw maps: small ones cell by cell, noise, figures, noisy figures and regular patterns."""
    kind = draw(st.sampled_from(["cells", "noise", "figures", "noisy figures", "pattern"]))
    if kind == "cells":
        sides = arrays.array_shapes(min_dims=2, max_dims=2, max_side=min(8, max_side))
        return draw(arrays.arrays(np.uint8, sides, elements=_CLASSES))
    shape = (draw(_sides(max_side)), draw(_sides(max_side)))
    if kind == "noise":
        return draw(_noise(shape))
    if kind == "pattern":
        return draw(_patterns(shape))
    classes = np.full(shape, draw(_CLASSES), dtype=np.uint8)
    for _ in range(draw(st.integers(1, 12))):
        draw(_figure_onto(classes))
    if kind == "noisy figures":
        speckle = draw(_noise(shape))
        rng = np.random.default_rng(draw(seeds))
        struck = rng.random(shape) < draw(st.sampled_from([0.01, 0.03, 0.1, 0.3]))
        classes[struck] = speckle[struck]
    return classes


def _sides(max_side: int) -> st.SearchStrategy[int]:
    return st.one_of(st.integers(1, max_side), st.integers(min(6, max_side), max_side))


@st.composite
def _noise(draw: st.DrawFn, shape: tuple[int, int]) -> Classes:
    occupied = draw(st.sampled_from([0.0, 0.02, 0.1, 0.2, 0.4, 0.7]))
    unexplored = draw(st.sampled_from([0.0, 0.02, 0.1, 0.5, 0.9]))
    rng = np.random.default_rng(draw(seeds))
    classes = np.where(rng.random(shape) < unexplored, 2, 1).astype(np.uint8)
    classes[rng.random(shape) < occupied] = CellClass.OCCUPIED
    return classes


@st.composite
def _patterns(draw: st.DrawFn, shape: tuple[int, int]) -> Classes:
    """One class all over, checkerboards, stripes, concentric rings; sometimes one row or column."""
    thin = draw(st.sampled_from(["", "", "row", "column"]))
    shape = (1, shape[1]) if thin == "row" else (shape[0], 1) if thin == "column" else shape
    palette = np.array(draw(st.lists(_CLASSES, min_size=1, max_size=3)), dtype=np.uint8)
    period = draw(st.integers(1, 3))
    row, col = np.indices(shape)
    measure = draw(st.sampled_from(["board", "stripes", "rings"]))
    if measure == "board":
        turn = row // period + col // period
    elif measure == "stripes":
        turn = col // period
    else:
        edge = np.minimum.reduce([row, col, shape[0] - 1 - row, shape[1] - 1 - col])
        turn = edge // period
    result: Classes = palette[turn % len(palette)]
    return result


@st.composite
def _figure_onto(draw: st.DrawFn, classes: Classes) -> None:
    rows, cols = classes.shape
    low, high = sorted((draw(st.integers(0, rows)), draw(st.integers(0, rows))))
    left, right = sorted((draw(st.integers(0, cols)), draw(st.integers(0, cols))))
    figure, paint = draw(st.sampled_from(["filled", "rim", "wall"])), draw(_CLASSES)
    if figure == "wall":
        lying = draw(st.booleans())
        line = classes[min(low, rows - 1), :] if lying else classes[:, min(left, cols - 1)]
        door = draw(st.integers(0, len(line) - 1))
        kept = line[door]
        line[:] = paint
        line[door] = kept
        return
    inner = classes[low + 1 : max(high - 1, low + 1), left + 1 : max(right - 1, left + 1)].copy()
    classes[low:high, left:right] = paint
    if figure == "rim" and inner.size:
        classes[low + 1 : high - 1, left + 1 : right - 1] = inner


@st.composite
def scenes(draw: st.DrawFn, max_side: int = MAX_SIDE) -> Scene:
    """Draw maps with a resolution and a merge distance from 1.5 cells to more than the map."""
    classes = draw(class_grids(max_side))
    resolution_m = draw(st.sampled_from([1.0, 0.05, 0.1]))
    merge_cells = draw(st.sampled_from([4, 1.5, 2, 2.5, 3, 5, 8, 13, 20, 80]))
    return Scene(
        classes=classes,
        resolution_m=resolution_m,
        merge_distance_m=merge_cells * resolution_m,
        seed=draw(st.integers(0, 1000)),
    )


def block_labels(shape: tuple[int, ...], rng: np.random.Generator) -> NDArray[np.int32]:
    """Labels of square blocks, several blocks of one label, with ragged borders."""
    side, n_labels = int(rng.integers(1, 9)), int(rng.integers(1, 7))
    rows, cols = shape
    coarse = rng.integers(n_labels, size=(rows // side + 1, cols // side + 1), dtype=np.int32)
    labels: NDArray[np.int32] = coarse.repeat(side, axis=0)[:rows].repeat(side, axis=1)[:, :cols]
    noisy = rng.random(shape) < rng.choice([0.0, 0.05])
    return np.where(noisy, rng.integers(n_labels, size=shape, dtype=np.int32), labels)


@st.composite
def labelled(draw: st.DrawFn) -> tuple[Classes, RoomLabels]:
    """A map, and labels on it that are blocks, noise, or one room for all."""
    classes = draw(class_grids(min(MAX_SIDE, 20)))
    rng = np.random.default_rng(draw(seeds))
    n_rooms = draw(st.sampled_from([1, 2, 3, 200]))
    block = draw(st.integers(1, 9))
    rows, cols = classes.shape
    coarse = rng.integers(-1, n_rooms, (rows // block + 1, cols // block + 1))
    labels = np.kron(coarse, np.ones((block, block), dtype=int))[:rows, :cols]
    names = tuple(f"r{i}" for i in range(n_rooms))
    return classes, RoomLabels(names, labels)
