"""Golden hashes: an optimisation must not change what a pyramid is.

Maps from seeded generators; for each the SHA-256 of the apex, over the receptive field of each
cell, the arcs, their rotation (sigma) and which faces are protected, as little-endian bytes. A
change of a hash is a change of results: the seeded hash that breaks ties, the attribute by which
edges are matched, who survives, or which of two parallel edges stays. If that is meant, say so in
the changelog and renew the hashes with `python -m tests.pyramid.test_golden`; otherwise a bug.
"""

import hashlib
import sys

import numpy as np
import pytest

from benchmarks.worlds import figure1_world, office_world, tiled
from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.pyramid import DualGraphPyramid

GOLDEN = {
    "figure1": "da12ec6638d37903",
    "no-limit": "a5268a66ea16f02b",
    "office": "e840e6bf22c069c4",
    "office-diameter": "65c2fcfe78850446",
    "office-seed-7": "d1e00ac7239ad5da",
    "office-survivor": "2367c63df9536f7f",
    "office-tiled": "61f7686c175e5253",
    "one-column": "f141607881650635",
    "speckle": "777779e75269640e",
    "three-classes": "8460df6b15a3385f",
    "throats-figure1": "d529b5d0134899c2",
    "throats-office": "1e2746ebf14fb454",
    "throats-office-seed-7": "9d21d860dfe836e7",
    "throats-office-tiled": "2d11cd33350bc56e",
    "throats-speckle": "bad51f2e43f9829a",
    "throats-three-classes": "8460df6b15a3385f",
}


def noise(seed, shape, unexplored, occupied):
    value = np.random.Generator(np.random.PCG64(seed)).random(shape)
    probability = np.where(value < occupied, 1.0, np.where(value < occupied + unexplored, 0.5, 0.0))
    return OccupancyGrid(probability, Frame(0.05), robot_radius_m=0)


def office(seed=0, radius_m=0.25, **settings):
    world = office_world(seed=seed)
    return DualGraphPyramid.build(world.grid(robot_radius_m=radius_m), seed=seed, **settings)


def noisy(*world, **settings):
    return DualGraphPyramid.build(noise(*world), **settings)


def two_offices(**settings):
    grid = tiled(office_world(), rows=2, cols=1).grid(robot_radius_m=0.1)
    return DualGraphPyramid.build(grid, **settings)


def figure1(**settings):
    grid = figure1_world().grid(robot_radius_m=0)
    return DualGraphPyramid.build(grid, merge_distance_m=10.0, **settings)


PYRAMIDS = {
    "figure1": lambda: figure1(linkage="radius"),
    "no-limit": lambda: noisy(4, (120, 120), 0.0, 0.35, merge_distance_m=float("inf")),
    "office": lambda: office(linkage="radius"),
    "office-diameter": lambda: office(linkage="diameter"),
    "office-seed-7": lambda: office(seed=7, linkage="radius"),
    "office-survivor": lambda: office(linkage="survivor"),
    "office-tiled": lambda: two_offices(linkage="radius"),
    "one-column": lambda: noisy(3, (5000, 1), 0.02, 0.01, merge_distance_m=1.0),
    "speckle": lambda: noisy(1, (300, 400), 0.01, 0.01, linkage="radius"),
    "three-classes": lambda: noisy(2, (200, 150), 0.3, 0.2, merge_distance_m=0.4, linkage="radius"),
    "throats-figure1": figure1,
    "throats-office": office,
    "throats-office-seed-7": lambda: office(seed=7),
    "throats-office-tiled": two_offices,
    "throats-speckle": lambda: noisy(1, (300, 400), 0.01, 0.01),
    "throats-three-classes": lambda: noisy(2, (200, 150), 0.3, 0.2, merge_distance_m=0.4),
}


def hash_of(pyramid):
    apex = pyramid[-1]
    digest = hashlib.sha256()
    for array in (apex.field_of, apex.arcs, apex.sigma):
        digest.update(array.astype("<i4").tobytes())
    digest.update(apex.protected.astype(np.uint8).tobytes())
    return digest.hexdigest()[:16]


@pytest.mark.parametrize("name", sorted(GOLDEN))
def test_the_apex_is_what_it_was(name):
    assert hash_of(PYRAMIDS[name]()) == GOLDEN[name]


if __name__ == "__main__":
    for name, built in PYRAMIDS.items():
        sys.stdout.write(f'    "{name}": "{hash_of(built())}",\n')
