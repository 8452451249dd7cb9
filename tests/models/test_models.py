"""Models: what was prepared comes back bit by bit, from a file that is mapped into memory."""

import dataclasses
import pickle
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.worlds import figure1_world
from hybridnav.models import structures
from hybridnav.pyramid.record import Record
from hybridnav.search.mesh import ConvexMesh, CornerGraph, CornerHierarchy, MeshSearch
from hybridnav.search.octile.jumps import JumpGraph
from tests.product.test_copies import assert_alike, kernels
from tests.strategies import scenes, tried

START, GOAL = (0.55, 0.55), (2.55, 2.85)
PRESETS = [name for name in hn.preset_names() if name != "ompl"]
WAYS = pytest.mark.parametrize("compress", [False, True], ids=["mapped", "compressed"])


@cache
def topology() -> hn.TopologicalMap:
    grid = figure1_world().grid(robot_radius_m=0.05)
    label_of = np.zeros(grid.shape, np.int32)
    label_of[:, grid.shape[1] // 2 :] = 1
    rooms = hn.RoomLabels(("west", "ost ä"), label_of, {"dock": START}, {7: (1.5, 0.5)})
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0, rooms=rooms))


def loaded(thing: Any, path: Path, *, compress: bool = False) -> hn.Model:
    hn.save(thing, path, compress=compress)
    return hn.load(path)


def same_answers(one: hn.HybridPlanner, other: hn.HybridPlanner) -> None:
    for blocked in (None, hn.Blocked(cells=[[12, 12]])):
        first, second = (each.plan(START, GOAL, blocked=blocked) for each in (one, other))
        assert first.solved
        assert (first.cost, first.lower_bound) == (second.cost, second.lower_bound)
        assert first.route == second.route
        assert first.settings == second.settings
        np.testing.assert_array_equal(first.path.points, second.path.points)
        np.testing.assert_array_equal(first.path.cells, second.path.cells)


def test_threads_may_share_a_model(tmp_path: Path) -> None:
    saved = hn.HybridPlanner(topology())
    saved.prepare()
    model = loaded(saved, tmp_path / "m.hnm")
    with ThreadPoolExecutor(8) as pool:
        planners = list(pool.map(lambda _: model.planner(), range(16)))
    assert all(planner.topology is model.topology for planner in planners)
    assert all(planner.prepared is not None for planner in planners)


@WAYS
@pytest.mark.parametrize("preset", PRESETS)
def test_a_planner_comes_back_bit_by_bit(preset: str, tmp_path: Path, *, compress: bool) -> None:
    saved = hn.HybridPlanner(topology(), preset=preset)
    saved.prepare()
    came_back = loaded(saved, tmp_path / "m.hnm", compress=compress).planner()
    assert came_back.preset == saved.preset
    assert_alike(saved.topology.pyramid.record, came_back.topology.pyramid.record, set())
    assert_alike(saved.topology.pyramid.rooms, came_back.topology.pyramid.rooms, set())
    assert_alike(saved.topology.grid, came_back.topology.grid, set())
    assert_alike(saved.prepared, came_back.prepared, set())
    same_answers(saved, came_back)
    same_answers(saved, pickle.loads(pickle.dumps(came_back)))  # noqa: S301 - our own


def test_a_graph_that_took_too_long_to_contract_comes_back(tmp_path, monkeypatch):
    monkeypatch.setattr("hybridnav.search.mesh.build._MOST_LOOKED", 0)
    saved = hn.HybridPlanner(topology())
    saved.prepare()
    came_back = loaded(saved, tmp_path / "m.hnm").planner()
    assert isinstance(came_back.prepared, MeshSearch)
    assert isinstance(came_back.prepared.graph, CornerGraph)
    assert_alike(saved.prepared, came_back.prepared, set())
    same_answers(saved, came_back)


@pytest.mark.full
def test_presets_with_ompl_find_their_mesh_in_a_model(tmp_path: Path) -> None:
    pytest.importorskip("ompl")
    preset = hn.load_preset("ompl", overrides=["pyramid.robot_radius_m=0.05"])
    saved = hn.HybridPlanner(topology(), preset=preset)
    came_back = loaded(saved, tmp_path / "m.hnm").planner()
    assert_alike(saved.prepared, came_back.prepared, set())
    for planner in (saved, came_back):
        assert planner.plan(START, GOAL).solved
        planner.close()


def test_no_kernel_is_compiled_anew_for_what_was_loaded(tmp_path: Path) -> None:
    planners = [hn.HybridPlanner(topology(), preset=name) for name in PRESETS]
    for planner in planners:
        planner.prepare()
        planner.plan(START, GOAL, blocked=hn.Blocked(cells=[[12, 12]]))
        assert planner.plan(START, GOAL).route is not None
        planner.plan_many([START], [GOAL])
    before = kernels()
    model = loaded(planners, tmp_path / "m.hnm")
    for planner in planners:
        came_back = model.planner(planner.preset)
        same_answers(planner, came_back)
        came_back.plan_many([START], [GOAL])
    changed = {name for name, count in kernels().items() if count > before.get(name, count)}
    assert changed == set()


def test_what_is_not_prepared_is_built_when_it_is_needed(tmp_path: Path) -> None:
    saved = hn.HybridPlanner(topology())
    model = loaded(saved, tmp_path / "m.hnm")
    assert model.planner().prepared is None
    assert model.planner("octile").prepared is None
    same_answers(saved, model.planner())


def test_a_mesh_whose_graph_is_not_built_yet_goes_on_as_it_would_have(tmp_path: Path) -> None:
    saved = hn.HybridPlanner(topology())
    saved.plan(START, GOAL)
    came_back = loaded(saved, tmp_path / "m.hnm").planner()
    assert_alike(saved.prepared, came_back.prepared, set())
    same_answers(saved, came_back)


def test_settings_of_a_planner_decide_what_it_takes_from_a_model(tmp_path: Path) -> None:
    entering = hn.load_preset("shortest", overrides=["planner.allow_unexplored=true"])
    saved = hn.HybridPlanner(topology(), preset=entering)
    saved.prepare()
    model = loaded(saved, tmp_path / "m.hnm")
    assert model.planner().prepared is not None
    assert model.planner("shortest").prepared is None
    stopping = hn.load_preset(entering, overrides=["planner.epsilon=0.01"])
    assert model.planner(stopping).prepared is not None


def test_several_planners_share_a_model(tmp_path: Path) -> None:
    planners = [hn.HybridPlanner(topology(), preset=name) for name in ("octile", "shortest")]
    for planner in planners:
        planner.prepare()
    model = loaded(planners, tmp_path / "m.hnm")
    assert [preset.name for preset in model.presets] == ["octile", "shortest"]
    assert model.planner().preset.name == "octile"
    again = loaded(model, tmp_path / "again.hnm", compress=True)
    for planner in planners:
        same_answers(planner, again.planner(planner.preset.name))


def test_a_map_and_a_grid_alone_are_models_too(tmp_path: Path) -> None:
    grid = topology().grid
    model = loaded(grid, tmp_path / "g.hnm")
    assert_alike(grid, model.grid, set())
    assert model.presets == ()
    assert model.rooms is None
    assert_alike(grid, hn.load_map(tmp_path / "g.hnm"), set())
    model = loaded(topology(), tmp_path / "t.hnm")
    assert_alike(topology().pyramid.record, model.topology.pyramid.record, set())
    assert model.rooms.names == ("west", "ost ä")
    assert model.planner().plan("west", "ost ä").solved


@tried(40, scene=scenes(), compress=...)
def test_any_grid_comes_back_bit_by_bit(scene, tmp_path_factory, *, compress: bool):
    path = tmp_path_factory.mktemp("models") / "m.hnm"
    assert_alike(scene.grid, loaded(scene.grid, path, compress=compress).grid, set())


def test_occupancy_of_more_than_256_values_comes_back_bit_by_bit(tmp_path: Path) -> None:
    values = np.random.default_rng(0).random((40, 30), np.float32)
    values[3, 4] = np.nan
    frame = hn.Frame(0.05, (-3.0, 1e6), 0.3)
    grid = hn.OccupancyGrid(values, frame, least_island_m2=0.02, corner_cutting=True, name="x y")
    assert_alike(grid, loaded(grid, tmp_path / "m.hnm").grid, set())


def test_a_map_without_a_free_cell_and_infinite_distances_come_back(tmp_path: Path) -> None:
    grid = hn.OccupancyGrid(np.ones((5, 4), np.float32), robot_radius_m=0.0)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=float("inf"), seed=-3)
    for preset in ("shortest", "octile"):
        planner = hn.HybridPlanner(
            hn.TopologicalMap(pyramid),
            preset=hn.load_preset(
                preset, overrides=["pyramid.robot_radius_m=0", "pyramid.merge_distance_m=.inf"]
            ),
        )
        planner.prepare()
        came_back = loaded(planner, tmp_path / "m.hnm").planner()
        assert came_back.preset == planner.preset
        assert came_back.topology.pyramid.merge_distance_m == float("inf")
        assert came_back.topology.pyramid.seed == -3
        assert_alike(planner.prepared, came_back.prepared, set())


def test_other_settings_make_the_grid_of_a_model_anew(tmp_path: Path) -> None:
    planner = hn.HybridPlanner(topology())
    planner.prepare()
    path = tmp_path / "m.hnm"
    hn.save(planner, path)
    assert hn.load(path, robot_radius_m=0.05).is_filed
    wider = hn.load(path, robot_radius_m=0.1)
    assert not wider.is_filed
    assert wider.planner().prepared is None
    assert_alike(
        dataclasses.replace(topology().grid, robot_radius_m=0.1, radius_is_default=False),
        wider.grid,
        set(),
    )
    assert hn.load_map(path, free_threshold=0.1).free_threshold == 0.1
    assert hn.load_map(path).robot_radius_m == 0.05


def test_a_model_in_use_shares_nothing_with_a_file_that_takes_its_place(tmp_path: Path) -> None:
    path = tmp_path / "m.hnm"
    planner = hn.HybridPlanner(topology())
    planner.prepare()
    model = loaded(planner, path)
    in_use = model.planner()
    free = np.zeros((50, 50), np.float32)
    hn.save(hn.OccupancyGrid(free, robot_radius_m=0.0), path)
    same_answers(planner, in_use)
    assert model.planner().prepared is not None
    path.unlink()
    same_answers(planner, in_use)
    same_answers(planner, model.planner())


def test_what_is_written_to_arrays_of_a_model_stays_out_of_its_file(tmp_path: Path) -> None:
    path = tmp_path / "m.hnm"
    model = loaded(topology(), path)
    before = path.read_bytes()
    model.topology.pyramid.record.vertex_end[:] = 0
    assert path.read_bytes() == before


@pytest.mark.parametrize(
    ("thing", "words"),
    [
        ("a text", "several planners"),
        ([], "several planners"),
        ([3], "several planners"),
        (3, "several planners"),
        (None, "several planners"),
    ],
)
def test_other_things_are_no_models(thing: Any, words: str, tmp_path: Path) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match=words):
        hn.save(thing, tmp_path / "m.hnm")
    assert list(tmp_path.iterdir()) == []


def test_planners_of_several_maps_are_no_model(tmp_path: Path) -> None:
    other = hn.TopologicalMap(hn.DualGraphPyramid.build(topology().grid))
    planners = [hn.HybridPlanner(on) for on in (topology(), other)]
    with pytest.raises(hn.errors.InvalidValueError, match="one topological map"):
        hn.save(planners, tmp_path / "m.hnm")


def test_a_model_is_named_as_one_and_written_where_there_is_room(tmp_path: Path) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="must end in"):
        hn.save(topology(), tmp_path / "m.model")
    with pytest.raises(hn.errors.ModelError, match="cannot be written"):
        hn.save(topology(), tmp_path / "nowhere" / "m.hnm")


@pytest.mark.parametrize(
    ("structure", "made", "others"),
    [
        (structures.PYRAMID, Record, ()),
        (structures.MESH, ConvexMesh, ()),
        (structures.CORNER_GRAPH, CornerGraph, ()),
        (structures.CORNER_HIERARCHY, CornerHierarchy, ()),
        (structures.JUMP_GRAPH, JumpGraph, ("origin", "shape", "behind", "reach")),  # directed
        (structures.ROOMS, hn.RoomLabels, ("names", "points", "doors", "uses", "one_way")),
    ],
)
def test_a_description_names_every_attribute_of_its_class(structure, made, others):
    described = {field.name for field in structure.arrays} - {"field_of"}
    if dataclasses.is_dataclass(made):
        attributes = {field.name for field in dataclasses.fields(made)}
    else:
        attributes = set(made._fields)
    assert described == attributes - set(others)


def test_the_description_of_a_grid_names_every_attribute() -> None:
    from hybridnav.models.parts import grid_part

    part = grid_part(topology().grid)
    frame = {"resolution_m", "origin_m", "yaw_rad"}
    attributes = {field.name for field in dataclasses.fields(hn.OccupancyGrid)}
    assert {*part.values, *part.arrays} - frame - {"palette"} == attributes - {"frame"}
