"""The figures among the solutions of the page on teaching, computed on the example maps."""

import networkx as nx
import numpy as np
import pytest
from scipy import ndimage

import hybridnav as hn
from hybridnav.harness.scenes import sample_pairs
from tests.product.house import ROOT

PAGE = " ".join((ROOT / "docs" / "teaching.md").read_text().split())
FREE = hn.CellClass.FREE
FAR = (1.0, 13.2), (40.6, 19.4)


def topology(robot_radius_m=0.25, merge_distance_m=4.0, *, rooms=False):
    grid = hn.example_map("office", robot_radius_m=robot_radius_m)
    found = hn.find_rooms(grid) if rooms else None
    built = hn.DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m, rooms=found)
    return hn.TopologicalMap(built)


def pieces_m2(grid):
    """Areas of the connected parts of free space, the largest first."""
    labels, _ = ndimage.label(grid.classes == FREE)
    return np.sort(np.bincount(labels.ravel())[1:])[::-1] * grid.resolution_m**2


@pytest.fixture(scope="module")
def with_rooms():
    return topology(rooms=True)


def test_01_a_wide_robot_finds_the_office_in_pieces():
    wide = topology(robot_radius_m=0.6)
    before = pieces_m2(topology().grid)[0]
    first, *others = pieces_m2(wide.grid)
    large = [area for area in others if area > 10]
    assert (
        f"{first:.0f} m² and pieces of {min(large):.0f} to {max(large):.0f} m² are left of "
        f"{before:.0f} m²"
    ) in PAGE
    reason = hn.explain(hn.HybridPlanner(wide), *FAR)
    assert reason.tight
    x, y = reason.tight.point
    assert f"at ({x:.2f}, {y:.2f}) a radius below {reason.closed.radius_m:.2f} m fits" in PAGE


@pytest.mark.parametrize(
    ("merge_distance_m", "told"), [(1.0, "has {} vertices and {} arcs"), (10.0, "has {} and {}")]
)
def test_02_what_a_simple_graph_drops(merge_distance_m, told):
    top = hn.DualGraphPyramid.build(
        hn.example_map("figure1", robot_radius_m=0.0),
        merge_distance_m=merge_distance_m,
        linkage="radius",
    )[-1]
    report = top.to_simple_graph().dropped
    dropped = report.n_parallel_dropped + report.n_self_loops_dropped
    told = told.format(top.n_vertices, top.n_arcs).replace("has 3", "it has 3")
    assert told in PAGE
    assert {1.0: "a simple graph drops none", 10.0: "drops 2"}[merge_distance_m] in PAGE
    assert dropped == {1.0: 0, 10.0: 2}[merge_distance_m]


def ring_round(island, merge_distance_m):
    """The walk of places round the unexplored island at a cell."""
    places = topology(merge_distance_m=merge_distance_m)
    return places.enclosed_by(places.place_at(island))


def test_02_what_one_place_goes_round():
    places = topology(merge_distance_m=30.0)
    unexplored = np.flatnonzero(places.classes == hn.CellClass.UNEXPLORED)
    largest_first = unexplored[np.argsort(-places.areas_m2[unexplored])].tolist()
    alone = [u for u in largest_first if len(places.enclosed_by(u)) == 1]
    island = next(u for u in alone if places.classes[places.enclosed_by(u)[0]] == FREE)
    cell = tuple(np.argwhere(places.level.field_of == island)[0].tolist())
    (place,) = places.enclosed_by(island)
    every, large = (places.encloses(place, least_area_m2=area) for area in (0.0, 1.0))
    assert f"of {len(every.obstacles)} obstacles {len(large.obstacles)} have a square" in PAGE
    assert "the ring is one place from 29 m on" in PAGE
    assert len(ring_round(cell, 28.0)) > 1
    assert len(ring_round(cell, 29.0)) == 1


def test_03_one_shut_door_suffices_where_a_room_has_one(with_rooms):
    doors = [door.rooms for door in with_rooms.rooms.doors if door.width_m > 0.5]
    graph: nx.MultiGraph[str] = nx.MultiGraph(doors)
    simple: nx.Graph[str] = nx.Graph(graph)
    single = sum(degree == 1 for _, degree in graph.degree())
    bridges = list(nx.bridges(simple))
    assert f"the {single} rooms that have only one" in PAGE
    assert f"of the simple graph counts {len(bridges)}" in PAGE
    several = sum(graph.number_of_edges(*pair) > 1 for pair in bridges)
    assert single + several == len(bridges)


def test_04_what_a_wider_corridor_takes_away():
    judged = {
        merge_distance_m: topology(merge_distance_m=merge_distance_m)
        for merge_distance_m in (1.0, 4.0, 16.0)
    }
    grid = judged[4.0].grid
    pairs = [pair for pair in sample_pairs(grid, 60, seed=1) if pair.kind == "sampled"]
    ends = [grid.frame.points_of([pair.start, pair.goal]) for pair in pairs]
    whole_grid = hn.HybridPlanner(judged[4.0], preset="grid-astar")
    optima = np.array([whole_grid.plan(*pair).cost for pair in ends])

    def figures(merge_distance_m, corridor):
        preset = hn.load_preset(
            "paper", overrides=["planner.levels=places", f"planner.corridor={corridor}"]
        )
        planner = hn.HybridPlanner(judged[merge_distance_m], preset=preset)
        plans = [planner.plan(*pair) for pair in ends]
        losses = np.array([plan.cost for plan in plans]) / optima - 1
        return losses.mean() * 100, int(np.median([plan.stats.expanded for plan in plans]))

    (route, of_route), (joined, of_joined), (beside, of_beside) = (
        figures(4.0, corridor) for corridor in ("route", "joined", "neighbours")
    )
    assert beside < 1e-9
    assert f"{route:.2f} % with `route`, {joined:.2f} % with `joined` and 0 with" in PAGE
    assert f"expand {of_route:,}, {of_joined:,} and {of_beside:,} cells in the median" in PAGE
    (narrow, of_narrow), (wide, of_wide) = figures(1.0, "joined"), figures(16.0, "joined")
    assert (
        f"at 1 m it is {narrow:.2f} % for {of_narrow:,}, at 16 m {wide:.2f} % for {of_wide:,}"
    ) in PAGE


def test_06_a_door_far_from_the_path_changes_nothing(with_rooms):
    octile = hn.HybridPlanner(with_rooms, preset="octile")
    shortest = hn.HybridPlanner(with_rooms)
    open_cost = octile.plan(*FAR).cost
    doors = [door.number for door in with_rooms.rooms.doors if door.width_m > 0.5]
    costs = np.array(
        [
            [planner.plan(*FAR, blocked={"doors": [number]}).cost for number in doors]
            for planner in (octile, shortest)
        ]
    )
    untouched = int(np.isclose(costs[0], open_cost, rtol=1e-12, atol=0).sum())
    assert f"{untouched} of {len(doors)} doors leave the cost as it is" in PAGE
    assert (costs[0].argsort(kind="stable") == costs[1].argsort(kind="stable")).all()
    assert (costs[1] <= costs[0]).all()


def test_06_each_wall_costs_more_until_there_is_no_path():
    octile = hn.HybridPlanner(topology(), preset="octile")
    shut: list[list[tuple[float, float]]] = []
    costs = []
    for y in (17.5, 12.5, 7.5, None):
        costs.append(octile.plan(*FAR, blocked={"polygons": shut}).cost)
        if y is not None:
            shut = [*shut, [(28.8, y - 1.2), (29.6, y - 1.2), (29.6, y + 1.2), (28.8, y + 1.2)]]
    first, second, third, last = costs
    assert f"costs {first:.2f}, {second:.2f} and {third:.2f} m, then infinity" in PAGE
    assert last == np.inf
