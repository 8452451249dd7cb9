"""The options that portals are built with: refused where they make no sense, and obeyed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.portals import PortalOptions, PortalSearch, prepare_portals
from hybridnav.search.grid_search import GridSearch
from tests.strategies import occupancy_grid

if TYPE_CHECKING:
    from hybridnav.portals import BuiltPortals

WRONG = [
    ("least_regions", 0),
    ("least_regions", 12.0),
    ("spacing_cells", 0),
    ("spacing_cells", 2.0),
    ("spacing_cells", True),
    ("all_border_cells_levels", -1),
    ("sparse_spacings_cells", (16, 1)),
    ("sparse_spacings_cells", [16]),
    ("sparse_spacings_cells", 16),
    ("most_bytes_per_cell", -1),
    ("most_sparse_bytes_per_cell", math.nan),
    ("least_bytes", None),
    ("rows_at_once", 0),
    ("dropped_bits", -1),
    ("dropped_bits", 31),
]


@pytest.mark.parametrize(("name", "value"), WRONG)
def test_options_out_of_range_are_refused_by_name(name: str, value: Any) -> None:
    with pytest.raises(hn.InvalidValueError, match=f"{name} of portals is .*, expected .*: leave"):
        PortalOptions(**{name: value})


def floor() -> hn.TopologicalMap:
    """An open floor of 40 x 40 cells with a pillar."""
    free = np.ones((40, 40), dtype=np.uint8)
    free[18:22, 10:30] = 0
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(free), merge_distance_m=6.0)
    return hn.TopologicalMap(pyramid)


def shortest(topology: hn.TopologicalMap, built: BuiltPortals) -> float:
    """Length of a path across the floor, in cells."""
    grid = topology.grid
    search = PortalSearch(built, GridSearch(grid.enterable()), grid.frame)
    return search.path((2, 3), (37, 35)).length_cells


def test_the_fields_are_the_regions_of_the_pyramid_and_as_small_as_the_option_asks_for() -> None:
    topology = floor()
    free = topology.grid.enterable()
    for least in (6, 12, 24):
        most_cells = -(-int(free.sum()) // least)
        pyramid = topology.pyramid.with_regions(most_cells)
        regions = pyramid[pyramid.region_level]
        built = prepare_portals(topology, options=PortalOptions(least_regions=least))
        np.testing.assert_array_equal(built.field_of[free], regions.field_of[free])
        assert np.bincount(built.field_of[free]).max() <= most_cells
        assert built.portals.n_fields >= least


@pytest.mark.parametrize("distance_m", [9.0, math.inf])
def test_where_places_are_too_large_a_level_below_them_is_routed_on(distance_m: float) -> None:
    free = floor().grid.enterable()
    grid = occupancy_grid(free.astype(np.uint8))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=distance_m))
    built = prepare_portals(topology, options=PortalOptions(least_regions=24))
    places = topology.level.field_of[free]
    sizes = np.bincount(built.field_of[free])
    assert sizes.max() <= 2 * math.ceil(free.sum() / 24) < np.bincount(places).max()
    pairs = np.unique(np.stack([built.field_of[free], places]), axis=1)
    assert pairs.shape[1] == built.portals.n_fields > topology.n_places


def test_every_choice_of_options_finds_paths_as_short() -> None:
    topology = floor()
    usual = prepare_portals(topology)
    choices = [
        PortalOptions(spacing_cells=3, rows_at_once=7),
        PortalOptions(all_border_cells_levels=0, sparse_spacings_cells=(8,)),
        PortalOptions(least_bytes=0, most_bytes_per_cell=0, most_sparse_bytes_per_cell=math.inf),
        PortalOptions(dropped_bits=4),
        PortalOptions(least_regions=3),
    ]
    built = [prepare_portals(topology, options=options) for options in choices]
    assert [found.has_all_gates for found in built] == [True, False, False, True, True]
    assert built[0].portals.n_sides > usual.portals.n_sides
    assert [found.tables.shift for found in built] == [0, 0, 0, 4, 0]
    lengths = [shortest(topology, found) for found in built]
    assert lengths == [shortest(topology, usual)] * len(built)
