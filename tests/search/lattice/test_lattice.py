"""The lattice: as connected as the grid, legal lines, and the same lines after changes."""

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

import hybridnav as hn
from hybridnav.search.lattice import LatticeSearch, build_lattice
from tests.search.lattice.scenes import Field, factors_of, fields
from tests.strategies import MAX_SIDE, drawn, seeds, tried


def check_lines(field: Field, search: LatticeSearch, rng: np.random.Generator, count: int) -> None:
    """There is a line just if there is a path of cells, and it is legal, from end to end."""
    labels, _ = ndimage.label(field.free)
    cells, positions = field.positions(rng, 2 * count)
    for (a, b), (start, goal) in zip(
        cells.reshape(-1, 2, 2), positions.reshape(-1, 2, 2), strict=True
    ):
        found = search.line(tuple(start), tuple(goal), (tuple(a), tuple(b)))
        if not (field.is_split(start) or field.is_split(goal)):
            assert (found.positions is not None) == (labels[tuple(a)] == labels[tuple(b)])
        if found.positions is not None:
            assert (found.positions[[0, -1]] == [start, goal]).all()
            assert field.faults(found.positions) == ()
            moved = (np.diff(found.positions, axis=0) != 0).any(axis=1)
            assert moved.all() or (start == goal).all()


@tried(200, fields(MAX_SIDE), seeds)
def test_it_is_as_connected_as_the_grid(field: Field, seed: int) -> None:
    search = LatticeSearch(build_lattice(field.free, field.factors))
    check_lines(field, search, np.random.default_rng(seed), 20)


@pytest.mark.parametrize("occupied", [0.3, 0.4, 0.45])
def test_it_is_as_connected_as_a_maze(occupied: float) -> None:
    rng = np.random.default_rng(5)
    side = 2 * MAX_SIDE
    field = Field(rng.random((side, side)) >= occupied, factors_of((side, side), rng))
    check_lines(field, LatticeSearch(build_lattice(field.free, field.factors)), rng, 200)


def test_an_end_on_the_side_of_a_wall_belongs_to_its_free_cell() -> None:
    """No node is in sight of it, and the cell of the next higher index is blocked."""
    free = drawn("#.##", ".#..", ".#.#", ".###", "..#.", "....") == hn.CellClass.FREE
    field = Field(free, np.ones(free.shape, np.float32))
    search = LatticeSearch(build_lattice(field.free, field.factors))
    labels, _ = ndimage.label(free)
    for cell in np.argwhere(free):
        for side in ((1.0, 0.5), (0.5, 1.0), (0.0, 0.5), (0.5, 0.0)):
            found = search.line(tuple(cell + side), (0.5, 0.5), (tuple(cell), (0, 0)))
            assert (found.positions is not None) == (labels[tuple(cell)] == labels[0, 0])
            if found.positions is not None:
                assert field.faults(found.positions) == ()


def lines(search: LatticeSearch, ends: Any) -> list[Any]:
    """Lines between many positions, and the nodes that each search expanded, as bytes."""
    free, found = search.lattice.free, []
    for start, goal in np.asarray(ends, dtype=float):
        own = np.minimum(np.array([start, goal]).astype(int), np.array(free.shape) - 1)
        if free[tuple(own.T)].all():
            first, last = map(tuple, own.tolist())
            found.append(search.line(tuple(start), tuple(goal), (first, last)))
    return [
        (None if one.positions is None else one.positions.tobytes(), one.expanded) for one in found
    ]


def changed_box(field: Field, rng: np.random.Generator) -> Field:
    """The field with the cells of a box drawn anew, at the rim as often as not."""
    free, factors = field.free.copy(), field.factors.copy()
    low = np.array([rng.integers(side) for side in free.shape])
    high = low + rng.integers(1, 7, 2)
    if rng.random() < 0.3:
        low[rng.integers(2)] = 0
    box = tuple(slice(a, b) for a, b in zip(low, high, strict=True))
    if rng.random() < 0.7:
        free[box] = rng.random(free[box].shape) < rng.choice([0.0, 0.5, 1.0])
    if rng.random() < 0.7:
        factors[box] = factors_of(free.shape, rng)[box]
    return Field(free, factors)


def renewed(lattice: Any, before: Field, now: Field) -> Any:
    """The lattice after the cells of one field became those of another."""
    differs = (before.free != now.free) | (before.factors != now.factors)
    return lattice.renewed(now.free, now.factors, np.flatnonzero(differs)).with_landmarks()


@tried(60, fields(MAX_SIDE), seeds)
def test_a_renewed_lattice_answers_as_one_built_anew(field: Field, seed: int) -> None:
    rng = np.random.default_rng(seed)
    first, lattice = field, build_lattice(field.free, field.factors)
    for _ in range(4):
        now = changed_box(field, rng)
        lattice, field = renewed(lattice, field, now), now
        anew = build_lattice(field.free, field.factors)
        assert lattice.n_nodes == anew.n_nodes
        ends = field.positions(rng, 10)[1].reshape(-1, 2, 2)
        assert lines(LatticeSearch(lattice), ends) == lines(LatticeSearch(anew), ends)
    back = renewed(lattice, field, first)
    ends = first.positions(rng, 20)[1].reshape(-1, 2, 2)
    anew = build_lattice(first.free, first.factors)
    assert lines(LatticeSearch(back), ends) == lines(LatticeSearch(anew), ends)


@pytest.mark.parametrize("seed", range(3))
def test_lines_in_the_open_do_not_depend_on_landmarks(seed: int) -> None:
    """Where all cells cost alike, many lines over the lattice would tie without its hashes."""
    rng = np.random.default_rng(seed)
    free = np.ones((90, 90), np.bool_)
    for row, col, down, over in rng.integers([0, 0, 1, 1], [85, 85, 15, 15], (8, 4)):
        free[row : row + down, col : col + over] = False
    lattice = build_lattice(free, np.ones(free.shape, np.float32))
    ends = rng.choice(np.argwhere(free), (60, 2)) + 0.5
    found = [
        [line for line, _ in lines(LatticeSearch(lattice.with_landmarks(n)), ends)]
        for n in (0, 3, 12)
    ]
    assert found[0] == found[1] == found[2]


@pytest.mark.parametrize("shape", [(21, 18), (1, 40), (40, 1), (3, 3)])
def test_hundreds_of_changes_are_answered_as_by_one_built_anew(shape: tuple[int, int]) -> None:
    """So many that it is built anew in between, with which its unused nodes are gone."""
    rng = np.random.default_rng(7)
    field = Field(rng.random(shape) < 0.8, factors_of(shape, rng))
    lattice = build_lattice(field.free, field.factors)
    sizes = []
    for turn in range(200):
        now = changed_box(field, rng)
        lattice, field = renewed(lattice, field, now), now
        sizes.append(len(lattice.cells))
        if turn % 10 == 0:
            anew = build_lattice(field.free, field.factors)
            ends = field.positions(rng, 20)[1].reshape(-1, 2, 2)
            assert lines(LatticeSearch(lattice), ends) == lines(LatticeSearch(anew), ends)
    assert shape == (3, 3) or (np.diff(sizes) < 0).any()
    assert max(sizes) <= 3 * shape[0] * shape[1] + 4**4 + 100  # narrow maps have a node a cell


def test_a_lattice_that_was_renewed_leaves_the_one_before_as_it_was() -> None:
    rng = np.random.default_rng(2)
    field = Field(rng.random((30, 30)) < 0.8, factors_of((30, 30), rng))
    lattice = build_lattice(field.free, field.factors)
    ends = field.positions(rng, 40)[1].reshape(-1, 2, 2)
    before = lines(LatticeSearch(lattice), ends)
    for _ in range(5):
        renewed(lattice, field, changed_box(field, rng))
    assert lines(LatticeSearch(lattice), ends) == before


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (4, 4), (13, 5)])
def test_a_map_without_a_free_cell_opens_and_closes(shape: tuple[int, int]) -> None:
    factors: Any = np.ones(shape, np.float32)
    shut, opened = np.zeros(shape, np.bool_), np.ones(shape, np.bool_)
    lattice = build_lattice(shut, factors)
    assert lattice.n_nodes == 0
    cells = np.arange(factors.size)
    now = lattice.renewed(opened, factors, cells)
    far = shape[0] - 0.5, shape[1] - 0.5
    found = LatticeSearch(now).line((0.5, 0.5), far).positions
    assert found is not None
    assert Field(opened, factors).faults(found) == ()
    assert now.renewed(shut, factors, cells).n_nodes == 0


def test_a_search_that_needs_a_longer_open_list_gets_it() -> None:
    """And answers as before when asked again, when the list is there."""
    rng = np.random.default_rng(0)
    field = Field(np.ones((200, 200), np.bool_), rng.uniform(1, 4, (200, 200)).astype(np.float32))
    search = LatticeSearch(build_lattice(field.free, field.factors))
    ends = [((0.5, 0.5), (199.5, 199.5)), ((3.5, 190.5), (190.5, 3.5))]
    first = lines(search, ends)
    assert lines(search, ends[::-1])[::-1] == first
    assert field.faults(search.line(*ends[0]).positions) == ()


@pytest.mark.parametrize(("free", "factors"), [((3, 4), (4, 3)), ((3,), (3,))])
def test_arrays_of_other_shapes_are_refused(free: Any, factors: Any) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="must have one shape"):
        build_lattice(np.ones(free, np.bool_), np.ones(factors))
