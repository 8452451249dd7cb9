"""Colours of rooms: neighbours differ, also through walls; names keep theirs on a later map."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st
from PIL import ImageColor

import hybridnav as hn
from hybridnav.maps import RoomLabels
from hybridnav.viz import plot_rooms, plot_rooms_beside, style
from hybridnav.viz.room_colours import colour_rooms
from research._rooms_buildings import SITES, Building
from tests.drawn_rooms import HOUSE, topology_of
from tests.strategies import occupancy_grid, seeds, tried

MAPS = Path(__file__).parents[2] / "maps"


@st.composite
def offices(draw):
    """Rooms between walls of 0.2 to 0.8 m, drawn as a person would, or any labels of cells."""
    rng = np.random.default_rng(draw(seeds))
    wall = draw(st.integers(0, 4))
    label_of = np.zeros((48, 64), dtype=np.int32)
    lines = label_of, label_of.T
    for at, number in enumerate(rng.permutation(np.repeat([0, 1], 8)), start=1):
        part = lines[number]
        first, last = np.sort(rng.integers(0, part.shape[0], 2))
        begin = rng.integers(0, part.shape[1] - 6)
        part[first : last + 2, begin : begin + rng.integers(4, 20)] = at
    edge = np.zeros(label_of.shape, dtype=bool)
    edge[:, 1:] |= label_of[:, 1:] != label_of[:, :-1]
    edge[1:] |= label_of[1:] != label_of[:-1]
    for _ in range(wall):
        edge[1:] |= edge[:-1]
        edge[:, 1:] |= edge[:, :-1]
    label_of[edge & (wall > 0)] = -1
    _, dense = np.unique(np.append(label_of, -1), return_inverse=True)
    return (dense[:-1].reshape(label_of.shape) - 1).astype(np.int32)


def facing(label_of, widest):
    """Pairs of rooms with at most so many cells of no room between them, in a row or a column."""
    pairs = set()
    for lines in (label_of, label_of.T):
        for line in lines.tolist():
            last, gap = -1, 0
            for label in line:
                if label < 0:
                    gap += 1
                    continue
                if last not in (-1, label) and gap <= widest:
                    pairs.add((min(last, label), max(last, label)))
                last, gap = label, 0
    return pairs


def named(label_of, names=None):
    names = names or [f"room-{n + 1}" for n in range(int(label_of.max()) + 1)]
    return RoomLabels(tuple(names), label_of)


@tried(40, label_of=offices())
def test_rooms_that_touch_or_share_a_wall_never_share_a_colour(label_of):
    grid = occupancy_grid(np.ones(label_of.shape, dtype=np.uint8), resolution_m=0.2)
    colours = colour_rooms(named(label_of), grid)
    assert all(colours[one] != colours[other] for one, other in facing(label_of, 4))
    assert len(set(colours.tolist())) >= min(6, len(colours))


@tried(20, old=offices(), seed=st.integers(0, 99))
def test_a_name_has_one_colour_on_both_maps(old, seed):
    """The later map is cut a little differently: its rooms have moved by three cells."""
    grid = occupancy_grid(np.ones(old.shape, dtype=np.uint8), resolution_m=0.2)
    names = np.random.default_rng(seed).permutation([f"lab {n}" for n in range(old.max() + 1)])
    before, now = named(old, names.tolist()), named(np.roll(old, 3, axis=1), names.tolist())
    one, other = colour_rooms(before, grid, now), colour_rooms(now, grid, before)
    assert one.tolist() == other.tolist()


def assert_neighbours_differ(rooms, grid):
    colours = colour_rooms(rooms, grid)
    pairs = facing(rooms.label_of, int(0.9 / grid.resolution_m))
    assert len(pairs) >= len(rooms.names) / 2
    assert all(colours[one] != colours[other] for one, other in pairs)


@pytest.mark.parametrize("name", SITES)
def test_neighbours_differ_on_labelled_maps(data, name):
    building = Building.read(data, name)
    _, dense = np.unique(np.append(building.true, -1), return_inverse=True)
    people = named(dense[:-1].reshape(building.true.shape).astype(np.int32) - 1)
    for rooms in (people, hn.find_rooms(building.grid)):
        assert_neighbours_differ(rooms, building.grid)


@pytest.mark.parametrize("name", ["office", "office-explored"])
def test_neighbours_differ_on_the_maps_of_the_project(name):
    grid = hn.load_map(MAPS / name / f"{name}.yaml")
    assert_neighbours_differ(hn.find_rooms(grid), grid)


def test_many_rooms_have_one_colour_whichever_map_comes_first():
    """Of many rooms there are ties, which must not hang on the order of the maps."""
    rng = np.random.default_rng(1)
    one, other = (rng.permutation(144).reshape(12, 12).repeat(4, 0).repeat(4, 1) for _ in "ab")
    grid = occupancy_grid(np.ones(one.shape, dtype=np.uint8), resolution_m=0.2)
    before, now = named(one.astype(np.int32)), named(other.astype(np.int32))
    assert colour_rooms(before, grid, now).tolist() == colour_rooms(now, grid, before).tolist()


def pixel(ax, point):
    """The colour that a picture has at a point of the map, before it is averaged."""
    (cells,) = (image for image in ax.images if image.get_gid() == "cells")
    left, _, bottom, _ = cells.get_extent()
    return tuple(cells.get_array()[int(point[1] - bottom), int(point[0] - left)][:3].tolist())


def test_unexplored_cells_are_grey_with_a_room_and_without():
    classes = np.ones((20, 40), dtype=np.uint8)
    classes[:, 30:] = 2
    labels = np.zeros(classes.shape, dtype=np.int32)
    labels[:, 20:] = -1
    labels[:, 35] = 0
    ax = plot_rooms(named(labels), occupancy_grid(classes))
    grey = ImageColor.getrgb(style.UNEXPLORED)
    assert pixel(ax, (25, 5)) == ImageColor.getrgb(style.FREE)
    known = np.asarray(ax.images[0].get_array()).shape[1]
    assert {pixel(ax, (col, 5)) for col in range(30, known)} <= {grey}
    legend = ax.get_legend()
    texts = [text.get_text() for text in legend.get_texts()]
    assert "unexplored" in texts


def test_squares_stand_where_an_opening_is_listed():
    topology = topology_of(HOUSE)
    squares = next(line for line in plot_rooms(topology).lines if line.get_gid() == "openings")
    listed = [door.position for door in topology.rooms.listed_doors if door.is_opening]
    assert np.asarray(squares.get_xydata()).tolist() == [list(at) for at in listed]


def test_rooms_of_one_name_look_alike_beside_each_other():
    topology = topology_of(HOUSE)
    later = topology_of([line[::-1] for line in HOUSE])
    axes = plot_rooms_beside(topology, later).figure.axes
    for name, label in ((name, topology.rooms.names.index(name)) for name in topology.rooms.names):
        seen = []
        for ax, each in zip(axes, (topology, later), strict=True):
            labels = each.rooms.labels
            row, col = np.argwhere(labels.label_of == labels.names.index(name))[0]
            seen.append(np.asarray(ax.images[0].get_array())[row, col].tolist())
        assert seen[0] == seen[1], label
