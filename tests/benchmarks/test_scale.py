"""Tiles of the subject `scale`: plans on them against scipy."""

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.common import largest_part
from benchmarks.subjects.scale import tile_of
from benchmarks.worlds import World, figure1_world
from hybridnav.search.mesh import MeshSearch
from tests.oracle.grid import distances, move_graph


@pytest.mark.parametrize("kind", ["small", "large"])
def test_plans_on_tiles_are_as_long_as_scipy_finds(monkeypatch, kind):
    """Tiles of a building and its mirror images, joined by streets; as a large map is planned on
    too, whose graphs are built behind the queries."""
    if kind == "large":
        monkeypatch.setattr("hybridnav.planning.methods.octile.MANY_CELLS", 0)
        monkeypatch.setattr("hybridnav.search.mesh.search.MANY_CORNERS", 0)
        monkeypatch.setattr("hybridnav.search.mesh.search._WORTH", 0)
    tile = tile_of(figure1_world().grid(robot_radius_m=0.1), 140)
    grid = World(np.tile(tile, (2, 2)), hn.Frame(0.1), "tiles").grid(robot_radius_m=0.1)
    free = grid.enterable()
    inside = largest_part(free)
    assert len(inside) > 0.8 * free.sum()
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    octile, shortest = (hn.HybridPlanner(topology, preset=name) for name in ("octile", "shortest"))
    chosen = inside[np.random.default_rng(2).integers(len(inside), size=(4, 11))]
    for source, *goals in chosen:
        expected = distances(move_graph(free), grid.shape, tuple(source.tolist()))
        for goal in goals:
            ends = grid.frame.points_of(np.array([source, goal]))
            found = octile.plan(*ends)
            assert found.cost == pytest.approx(expected[tuple(goal)] * grid.resolution_m)
            taut = shortest.plan(*ends)
            assert taut.gap == 0
            assert taut.cost <= found.cost * (1 + 1e-12)
    shortest.prepare()
    assert isinstance(shortest.prepared, MeshSearch)
    assert shortest.prepared.graph is not None
