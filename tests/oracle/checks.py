"""Assertions that hold on every level, and between levels, against the oracle."""

from collections import Counter
from typing import Any, Protocol

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from tests.oracle.pyramid import (
    AnyArray,
    Base,
    Boundaries,
    Dart,
    alpha,
    below,
    boundaries,
    canonical,
    cells_of,
    distances_in_fields,
    face_sequences,
    farthest_squared,
    full_blocks,
    holes,
    n_field_pieces,
    orbits,
    through_cells,
)


class LevelLike(Protocol):
    """What a level must show to be checked for its topology."""

    @property
    def n_vertices(self) -> int: ...
    @property
    def n_arcs(self) -> int: ...
    @property
    def field_of(self) -> AnyArray: ...
    @property
    def cells(self) -> AnyArray: ...
    @property
    def classes(self) -> AnyArray: ...
    @property
    def arcs(self) -> AnyArray: ...
    @property
    def base_pairs(self) -> AnyArray: ...
    @property
    def sigma(self) -> AnyArray: ...
    @property
    def protected(self) -> AnyArray: ...


class MeasuredLevel(LevelLike, Protocol):
    """A level with the attributes that planners read."""

    @property
    def areas(self) -> AnyArray: ...
    @property
    def max_distance_m(self) -> AnyArray: ...
    @property
    def through_m(self) -> AnyArray: ...
    def boundary(self, arc: int, /) -> AnyArray: ...


def check_level(level: LevelLike, base: Base) -> None:
    """Every invariant of one level that needs no attribute."""
    found = boundaries(level.field_of)
    check_shapes(level)
    check_fields(level, base)
    check_sigma(level)
    check_arcs(level, found)
    check_faces(level, base, found)
    check_self_loops(level)


def check_shapes(level: LevelLike) -> None:
    """Check that arrays have the lengths of the counts."""
    vertices, arcs = level.n_vertices, level.n_arcs
    assert level.cells.shape == (vertices, 2)
    assert level.classes.shape == (vertices,)
    assert level.arcs.shape == (arcs, 2)
    assert level.base_pairs.shape == (arcs, 2, 2)
    assert level.sigma.shape == level.protected.shape == (2 * arcs,)


def check_fields(level: LevelLike, base: Base) -> None:
    """Fields partition the vertices, are connected, of one class, and hold their survivor."""
    field_of, cells = level.field_of, level.cells
    is_vertex = base.classes > 0
    assert field_of.shape == base.classes.shape
    assert ((field_of >= 0) == is_vertex).all()
    assert np.unique(field_of[is_vertex]).tolist() == list(range(level.n_vertices))
    assert n_field_pieces(field_of) == level.n_vertices
    assert (level.classes[field_of[is_vertex]] == base.classes[is_vertex]).all()
    assert (field_of[cells[:, 0], cells[:, 1]] == np.arange(level.n_vertices)).all()
    flat = cells[:, 0] * field_of.shape[1] + cells[:, 1]
    assert (np.diff(flat) > 0).all()


def check_sigma(level: LevelLike) -> None:
    """Sigma is a permutation and its orbits are exactly the darts of each vertex."""
    n_darts = 2 * level.n_arcs
    assert np.sort(level.sigma).tolist() == list(range(n_darts))
    origin = level.arcs.ravel()
    assert (origin[level.sigma] == origin).all()
    n_orbits = len(orbits(dict(enumerate(level.sigma.tolist()))))
    assert n_orbits == len(np.unique(origin))


def check_arcs(level: LevelLike, found: Boundaries) -> None:
    """Arcs between different vertices are the boundaries, one to one."""
    pairs = level.base_pairs
    assert (np.abs(pairs[:, 0] - pairs[:, 1]).sum(axis=1) == 1).all()
    endpoints = level.field_of[pairs[:, :, 0], pairs[:, :, 1]]
    assert (endpoints == level.arcs).all()
    labels = [found.label_of[dart] for dart in crossing_darts(level)]
    assert sorted(labels) == list(range(found.n_boundaries))


def crossing_darts(level: LevelLike) -> list[Dart]:
    """Name the arcs that are no self-loops by their base darts."""
    crossing = level.arcs[:, 0] != level.arcs[:, 1]
    return base_darts(level.base_pairs[crossing])


def base_darts(base_pairs: AnyArray) -> list[Dart]:
    """Turn an array of base pairs into base darts `(cell, cell)`."""
    return [((a, b), (c, d)) for (a, b), (c, d) in base_pairs.tolist()]


def check_faces(level: LevelLike, base: Base, found: Boundaries) -> None:
    """Faces are those of the oracle, in number, in protection and in the order of their arcs."""
    n_isolated = level.n_vertices - len(np.unique(level.arcs))
    walks = phi_walks(level)
    ordinary = [walk for walk in walks if not level.protected[walk[0]]]
    for walk in walks:
        assert len({bool(level.protected[dart]) for dart in walk}) == 1
    components = base.n_components
    assert n_components(level) == components
    assert level.n_vertices - level.n_arcs + len(walks) == 2 * components - n_isolated
    assert len(ordinary) == found.n_ordinary_faces
    assert len(walks) - len(ordinary) == base.n_protected(n_isolated)
    label = np.full(level.n_arcs, -1)
    crossing = level.arcs[:, 0] != level.arcs[:, 1]
    label[crossing] = [found.label_of[dart] for dart in crossing_darts(level)]
    origin = level.arcs.ravel()
    sequences: Counter[Any] = Counter()
    for walk in walks:
        steps = ((int(label[dart // 2]), int(origin[dart])) for dart in walk)
        sequence = tuple(step for step in steps if step[0] >= 0)
        sequences[bool(level.protected[walk[0]]), canonical(sequence)] += 1
    assert sequences == face_sequences(base, level.field_of, found)


def phi_walks(level: LevelLike) -> list[tuple[int, ...]]:
    """Faces as cycles of darts."""
    sigma = level.sigma.tolist()
    return orbits({dart: sigma[dart ^ 1] for dart in range(len(sigma))})


def n_components(level: LevelLike) -> int:
    size = level.n_vertices
    endpoints = (level.arcs[:, 0], level.arcs[:, 1])
    graph = sparse.csr_array((np.ones(level.n_arcs), endpoints), shape=(size, size))
    return int(csgraph.connected_components(graph, directed=False)[0]) if size else 0


def check_self_loops(level: LevelLike) -> None:
    """Every vertex has one self-loop per hole of its field."""
    loops = level.arcs[level.arcs[:, 0] == level.arcs[:, 1], 0]
    assert np.bincount(loops, minlength=level.n_vertices).tolist() == holes(level.field_of).tolist()


def check_base(level: LevelLike, base: Base) -> None:
    """Check that the lowest level is the map of the 4-neighbour grid, in closed form."""
    assert level.n_vertices == (base.classes > 0).sum()
    assert sigma_of(level) == base.sigma
    ordinary = {walk[0] for walk in phi_walks(level) if not level.protected[walk[0]]}
    assert len(ordinary) == full_blocks(level.field_of)
    darts = named_darts(level)
    block_darts = {dart for walk in base.ordinary for dart in walk}
    assert {dart for dart, shut in zip(darts, level.protected, strict=True) if not shut} == (
        block_darts
    )


def named_darts(level: LevelLike) -> list[Dart]:
    darts: list[Dart] = []
    for tail, head in base_darts(level.base_pairs):
        darts += [(tail, head), (head, tail)]
    return darts


def sigma_of(level: LevelLike) -> dict[Dart, Dart]:
    """Sigma of a level on base darts, comparable between implementations."""
    darts = named_darts(level)
    return {dart: darts[after] for dart, after in zip(darts, level.sigma.tolist(), strict=True)}


def protected_of(level: LevelLike) -> set[Dart]:
    """Name the darts whose face is protected."""
    return {dart for dart, shut in zip(named_darts(level), level.protected, strict=True) if shut}


def check_attributes(level: MeasuredLevel, classes: AnyArray, *, resolution_m: float) -> None:
    """Areas, boundaries and both distances of the arcs equal their brute-force values."""
    found = boundaries(level.field_of)
    fields = cells_of(level.field_of)
    assert level.areas.tolist() == [len(cells) for cells in fields]
    farthest = [farthest_squared(fields[u], fields[v]) for u, v in level.arcs.tolist()]
    np.testing.assert_allclose(level.max_distance_m, np.sqrt(farthest) * resolution_m, rtol=1e-9)
    reach = distances_in_fields(classes, level.field_of, level.cells)
    through = through_cells(found, reach) * resolution_m
    assert np.isfinite(level.through_m).all()
    assert (level.through_m >= resolution_m * (1 - 1e-9)).all()
    cracks: list[set[Dart]] = [set() for _ in range(found.n_boundaries)]
    for dart, label in found.label_of.items():
        cracks[label].add(dart)
    expected = np.array(level.through_m, dtype=float)
    lines = [np.asarray(level.boundary(arc)).reshape(-1, 2, 2) for arc in range(level.n_arcs)]
    pairs = np.concatenate([*lines, np.empty((0, 2, 2), int)])
    endpoints = level.field_of[pairs[:, :, 0], pairs[:, :, 1]]
    assert (endpoints == np.repeat(level.arcs, [len(line) for line in lines], axis=0)).all()
    for arc, dart in enumerate(base_darts(level.base_pairs)):
        if dart not in found.label_of:
            continue
        label = found.label_of[dart]
        darts = base_darts(lines[arc])
        assert {*darts, *map(alpha, darts)} == cracks[label]
        assert 2 * len(darts) == len(cracks[label])
        expected[arc] = through[label]
    np.testing.assert_allclose(level.through_m, expected, rtol=1e-9)


def check_step(lower: LevelLike, upper: LevelLike) -> AnyArray:
    """Reduction windows are stars round their surviving vertex; return the parent of each son."""
    parent = upper.field_of[lower.cells[:, 0], lower.cells[:, 1]]
    inside = lower.field_of >= 0
    assert (parent[lower.field_of[inside]] == upper.field_of[inside]).all()
    assert upper.n_vertices < lower.n_vertices
    centre = lower.field_of[upper.cells[:, 0], upper.cells[:, 1]]
    assert (lower.cells[centre] == upper.cells).all()
    adjacent = {frozenset(endpoints) for endpoints in lower.arcs.tolist()}
    for son, window in enumerate(parent.tolist()):
        if son != centre[window]:
            assert frozenset((son, int(centre[window]))) in adjacent
            assert lower.classes[son] == lower.classes[centre[window]]
    kept = {frozenset(dart) for dart in base_darts(upper.base_pairs)}
    assert kept < {frozenset(dart) for dart in base_darts(lower.base_pairs)}
    result: AnyArray = parent
    return result


def passes(
    level: LevelLike,
    *,
    linkage: str,
    limit_m: float,
    resolution_m: float,
    parts: AnyArray | None = None,
) -> AnyArray:
    """Whether each arc may be contracted under a linkage, whichever end survives.

    `parts` has the part of each vertex: two of different ones do not merge, -1 merges with any.
    """
    fields = cells_of(level.field_of)
    passing = np.zeros(level.n_arcs, dtype=bool)
    for arc, (u, v) in enumerate(level.arcs.tolist()):
        if u == v or level.classes[u] != level.classes[v]:
            continue
        if parts is not None and parts[u] != parts[v] and min(parts[u], parts[v]) >= 0:
            continue
        survivors = level.cells[[u]], level.cells[[v]]
        if linkage == "survivor":
            squared = farthest_squared(*survivors)
        elif linkage == "radius":
            squared = min(
                farthest_squared(survivors[0], fields[v]), farthest_squared(survivors[1], fields[u])
            )
        else:
            both = np.concatenate([fields[u], fields[v]])
            squared = farthest_squared(both, both)
        passing[arc] = below(squared, limit_m=limit_m, resolution_m=resolution_m)
    return passing


def check_cap(level: LevelLike, *, linkage: str, limit_m: float, resolution_m: float) -> None:
    """Fields keep the cap of `radius` or `diameter`; a single cell always does."""
    for field, cells in enumerate(cells_of(level.field_of)):
        others = level.cells[[field]] if linkage == "radius" else cells
        if len(cells) > 1:
            squared = farthest_squared(cells, others)
            assert below(squared, limit_m=limit_m, resolution_m=resolution_m)


def check_links(
    lower: LevelLike, upper: LevelLike, waiting: AnyArray, *, limit_m: float, resolution_m: float
) -> None:
    """`survivor`: parent links are shorter than the cap, and all that can merge do.

    `waiting` is a mask of the cells whose blocks are in pieces: nothing else merges with those.
    """
    parent = upper.field_of[lower.cells[:, 0], lower.cells[:, 1]]
    squared = ((lower.cells - upper.cells[parent]) ** 2).sum(axis=1)
    assert below(squared, limit_m=limit_m, resolution_m=resolution_m).all()
    passing = passes(lower, linkage="survivor", limit_m=limit_m, resolution_m=resolution_m)
    waits = waiting[lower.cells[:, 0], lower.cells[:, 1]]
    busy = np.unique(lower.arcs[passing & ~waits[lower.arcs].any(axis=1)])
    assert (np.bincount(parent, minlength=upper.n_vertices)[parent[busy]] >= 2).all()
