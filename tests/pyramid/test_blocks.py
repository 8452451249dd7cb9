"""The closed form of the lower levels: blocks of open ground merge along a quadtree."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.pyramid import DualGraphPyramid
from tests.oracle.blocks import blocks, in_pieces, piece_of
from tests.oracle.checks import check_level
from tests.oracle.pyramid import Base
from tests.strategies import MAX_SIDE, Scene, examples, occupancy_grid, scenes

LINKAGES = ("radius", "survivor", "diameter")
ORDINARY = settings(max_examples=examples(30), deadline=None, derandomize=True)


@st.composite
def open_scenes(draw):
    """Mostly open ground, with a few obstacles and islands."""
    shape = tuple(draw(st.integers(2, max(2, MAX_SIDE))) for _ in range(2))
    classes = np.full(shape, draw(st.sampled_from([1, 2])), dtype=np.uint8)
    for _ in range(draw(st.integers(0, 4))):
        row, col = (draw(st.integers(0, side - 1)) for side in shape)
        height, width = draw(st.integers(1, 5)), draw(st.integers(1, 5))
        classes[row : row + height, col : col + width] = draw(st.sampled_from([0, 0, 1, 2]))
    distance = draw(st.sampled_from([3.9, 4.0, 7.0, 8.0, 12.0, 16.0, 40.0, np.inf]))
    return Scene(classes, 1.0, distance, draw(st.integers(0, 3)))


def check_blocks(scene, linkage):
    pyramid = scene.pyramid(linkage)
    distance = scene.merge_distance_m / scene.resolution_m
    for block in blocks(scene.classes, distance):
        assert len(pyramid) > block.whole_at
        for level in range(block.whole_at + 1):
            field_of = pyramid[level].field_of
            fields = field_of[block.window]
            pairs = np.unique(np.stack([fields, piece_of(block, level)]).reshape(2, -1), axis=1)
            pieces = block.side**2 >> level
            assert pairs.shape[1] == len(np.unique(pairs[0])) == pieces
            assert np.isin(field_of, fields).sum() == block.side**2
        row, col = pyramid[block.whole_at].cells[fields[0, 0]] - block[:2]
        far = max(row, block.side - 1 - row), max(col, block.side - 1 - col)
        assert max(far) <= block.side * 5 // 8


@pytest.mark.parametrize("linkage", LINKAGES)
@given(scene=st.one_of(open_scenes(), scenes()))
@ORDINARY
def test_blocks_merge_by_halves_and_with_nothing_else_until_they_are_whole(scene, linkage):
    check_blocks(scene, linkage)


@pytest.mark.parametrize("linkage", LINKAGES)
@given(scene=open_scenes())
@ORDINARY
def test_levels_of_open_ground_are_plane_maps(scene, linkage):
    pyramid = scene.pyramid(linkage)
    base = Base.of(scene.classes)
    for level in range(len(pyramid)):
        check_level(pyramid[level], base)


def test_the_sizes_in_the_statistics_are_those_of_the_levels():
    rng = np.random.default_rng(5)
    classes = np.ones((MAX_SIDE, MAX_SIDE + 3), dtype=np.uint8)
    classes[rng.random(classes.shape) < 0.01] = 0
    pyramid = DualGraphPyramid.build(occupancy_grid(classes), merge_distance_m=18.0)
    assert len(pyramid.stats.sizes) == len(pyramid)
    for index, size in enumerate(pyramid.stats.sizes):
        level = pyramid[index]
        loops = int((level.arcs[:, 0] == level.arcs[:, 1]).sum())
        assert (size.vertices, size.arcs, size.self_loops) == (
            level.n_vertices,
            level.n_arcs,
            loops,
        )


def test_the_definition_finds_blocks_of_every_size():
    classes = np.ones((32, 32), dtype=np.uint8)
    assert {block.side for block in blocks(classes, 16.0)} == {2, 4, 8}
    assert {block.side for block in blocks(classes, 15.9)} == {2, 4}
    assert {block.side for block in blocks(classes, 4.0)} == {2}
    assert not blocks(classes, 3.9)
    assert in_pieces(classes, 16.0, 5).sum() == 4 * 64
    assert not in_pieces(classes, 16.0, 6).any()
