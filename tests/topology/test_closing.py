"""The closing of free space, which takes as long for large discs as for small ones."""

import numpy as np
import pytest
from scipy import ndimage

from hybridnav.topology.rooms.cutting import closed_by_disc


@pytest.mark.parametrize("seed", range(30))
def test_a_closing_by_distances_is_that_by_a_disc(seed):
    rng = np.random.default_rng(seed)
    free = rng.random(rng.integers(1, 40, 2)) < rng.random()
    occupied = (rng.random(free.shape) < 0.1) & ~free
    reach = rng.uniform(0, 8)
    size = max(1, round(reach))
    row, col = np.ogrid[-size : size + 1, -size : size + 1]
    disc = row * row + col * col <= size * size + 1
    wide = ndimage.binary_closing(np.pad(free, size + 1), disc)
    expected = wide[size + 1 : -size - 1, size + 1 : -size - 1] & ~occupied
    assert (closed_by_disc(free, occupied, reach) == expected).all()
