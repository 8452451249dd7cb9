"""Every preset obeys directions, as an oracle knows that has no code of it; see `tests.one_way`."""

from fractions import Fraction

import numpy as np
import pytest

import hybridnav as hn
from tests.one_way import PRESETS, Scene, faults, planner_of, random_scene
from tests.strategies import examples, occupancy_grid

# Random lines may lie between blocked cells alone.
pytestmark = pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")


@pytest.mark.parametrize("preset", PRESETS)
def test_plans_on_random_maps_are_legal_and_as_good_as_the_oracle_s(preset):
    for seed in range(examples(300 if preset == "shortest" else 100)):
        scene = random_scene(seed)
        assert scene is None or not list(faults(scene, preset)), seed


@pytest.mark.parametrize("preset", [name for name in PRESETS if name != "paper"])
def test_updates_of_the_map_keep_directions(preset):
    for seed in range(examples(12, 50)):
        scene, rng = random_scene(seed), np.random.default_rng([5, seed])
        if scene is None:
            continue
        planner = planner_of(scene, preset)
        for _ in range(3):
            free = scene.free ^ (rng.random(scene.free.shape) < 0.1)
            scene = Scene(free, scene.sides, scene.ends)
            planner.update(grid=occupancy_grid(free.astype(np.uint8)))
            assert list(faults(scene, preset, planner)) == [], seed


def test_a_diagonal_beside_a_blocked_cell_goes_round_its_corner_by_the_other():
    """The line along the side is legal, from a cell on its other hand; a list of cells was not."""
    scene = random_scene(420)
    assert scene is not None
    assert list(faults(scene, "shortest")) == []


@pytest.mark.parametrize(
    "seed",
    [
        470,  # an end at a corner of cells, whose cell lies behind it
        684,  # a line along a side, beside which the other cell was listed
        718168,  # a line that ends in another cell beside its end, far from all sides
        703976,  # a line back to a corner of cells through which it had come
    ],
)
def test_robot_starts_and_ends_in_the_cells_of_its_ends(seed):
    scene = random_scene(seed)
    assert scene is not None
    assert not list(faults(scene, "robot"))


@pytest.mark.parametrize("preset", PRESETS)
def test_ends_at_corners_of_walls_lie_in_the_cell_beyond(preset):
    """Without directions too: where two walls meet, the other cell there is not reached."""
    for seed in range(examples(60)):
        rng = np.random.default_rng(seed)
        free = rng.random(rng.integers(2, 7, 2)) > rng.choice([0.2, 0.35, 0.5])
        cells = np.argwhere(free)[rng.permutation(free.sum())[:3]].tolist()
        ends = [((row, col), (Fraction(row), Fraction(col))) for row, col in cells]
        scene = Scene(free, np.empty((0, 4), np.int32), ends)
        assert not list(faults(scene, preset))


def test_shortest_answers_many_pairs_and_tables_as_it_answers_each():
    scene = random_scene(24, n_ends=7)
    assert scene is not None
    planner, one_way = planner_of(scene, "shortest"), hn.OneWay(sides=scene.sides)
    points = np.array([[float(p[1]), float(p[0])] for _, p in scene.ends])
    inside = points[(points.T[::-1] < np.array(scene.free.shape)[:, None]).all(axis=0)]
    cells = np.floor(inside[:, ::-1]).astype(int)
    points = inside[scene.free[tuple(cells.T)]]
    pairs = [(a, b) for a in points for b in points]
    alone = [planner.plan(a, b, one_way=one_way) for a, b in pairs]
    many = planner.plan_many(*zip(*pairs, strict=True), one_way=one_way)
    assert many.cost.tolist() == [result.cost for result in alone]
    assert many.lower_bound.tolist() == [result.lower_bound for result in alone]
    table = np.asarray(planner.distances(points, points, one_way=one_way))
    assert table.ravel() == pytest.approx([result.cost for result in alone], abs=1e-9)
    assert (table != table.T).any()


def test_a_time_limit_bars_no_direction():
    free = np.ones((6, 8), bool)
    one_way = hn.OneWay(sides=[(2, c, 3, c) for c in range(7)])
    topology = planner_of(Scene(free, np.empty((0, 4), np.int32), []), "shortest").topology
    preset = hn.load_preset("shortest", overrides=["planner.budget_s=1e-9"])
    result = hn.HybridPlanner(topology, preset=preset).plan((4.5, 5.5), (4.5, 0.5), one_way=one_way)
    assert result.path is not None
    assert result.cost == pytest.approx(2 * np.hypot(2.5, 2.5))


def test_sides_between_blocked_cells_change_nothing():
    free = np.ones((6, 8), bool)
    free[2, 1:7] = free[3, 1:7] = False
    sides = np.array([(2, c, 3, c) for c in range(1, 7)])
    planner = planner_of(Scene(free, sides, []), "shortest")
    plain = planner.plan((4.5, 0.5), (4.5, 5.5))
    directed = planner.plan((4.5, 0.5), (4.5, 5.5), one_way=hn.OneWay(sides=sides))
    assert directed.path.points.tolist() == plain.path.points.tolist()
    assert (directed.cost, directed.lower_bound) == (plain.cost, plain.lower_bound)
