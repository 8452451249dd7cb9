"""Plans on one map under profiles: rooms, widths, room to turn, and what forbids a route."""

import itertools
from dataclasses import replace
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError, RoomsError
from hybridnav.planning import Profile

OFFICE = Path(__file__).parents[2] / "maps" / "office" / "office.yaml"
PRIVATE = hn.RoomUse(private=True)
# A hall h, wards a and b with a bath c behind a; b has a narrow door to the hall.
INK = (
    "#####################",
    "#aaaaaa#cccccc#bbbbb#",
    "#aaaaaa#cccccc#bbbbb#",
    "#aaaaaaacccccc#bbbbb#",
    "#aaaaaaacccccc#bbbbb#",
    "#aaaaaa#cccccc#bbbbb#",
    "###hh############h###",
    "#hhhhhhhhhhhhhhhhhhh#",
    "#hhhhhhhhhhhhhhhhhhh#",
    "#hhhhhhhhhhhhhhhhhhh#",
    "#####################",
)
NAMES = ("hall", "ward a", "ward b", "bath")


def clinic(uses: dict[str, hn.RoomUse], *, radius_m: float = 0.0, **how: Any) -> hn.HybridPlanner:
    """Rooms of cells of 0.5 m."""
    ink = np.array([list(line) for line in INK])[::-1]
    label_of = np.select([ink == each for each in "habc"], range(4), -1)
    rooms = hn.RoomLabels(NAMES, label_of, uses=uses)
    grid = hn.OccupancyGrid((ink == "#").astype(np.float32), hn.Frame(0.5), robot_radius_m=radius_m)
    return hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms)), **how)


def test_a_chain_of_private_rooms_is_open_for_the_room_behind_it_alone() -> None:
    planner = clinic({"ward a": PRIVATE, "bath": PRIVATE})
    visitor = hn.under(planner, "visitor")
    assert visitor is hn.under(planner, "visitor")
    for pair in (("hall", "bath"), ("bath", "ward b"), ("bath", "ward a"), ("hall", "hall")):
        result = visitor.plan(*pair)
        assert (result.status, result.gap) == (hn.PlanStatus.SOLVED, 0.0)
        assert result.cost == planner.plan(*pair).cost
        assert result.settings["profile"]["name"] == "visitor"
    behind = hn.under(clinic({"ward a": PRIVATE}), "visitor").plan("hall", "bath")
    assert behind.status is hn.PlanStatus.NO_PATH
    assert behind.settings["profile"]["forbids"] == (
        "profile visitor forbids every route: the way is by private rooms (ward a)"
    )
    assert hn.under(clinic({"ward a": PRIVATE}), "staff").plan("hall", "bath").solved


def drawn(ink: tuple[str, ...]) -> hn.HybridPlanner:
    """Rooms of the letters of a drawing, upper case private; cells of 0.5 m, `.` in no room."""
    cells = np.array([list(line) for line in ink])[::-1]
    names = sorted(set(cells.ravel().tolist()) - {"#", "."})
    label_of = np.select([cells == name for name in names], range(len(names)), -1)
    uses = {name: PRIVATE for name in names if name.isupper()}
    rooms = hn.RoomLabels(tuple(names), label_of, uses=uses)
    grid = hn.OccupancyGrid((cells == "#").astype(np.float32), hn.Frame(0.5))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    return hn.HybridPlanner(topology, preset="grid-astar")


def test_a_way_through_the_second_part_of_an_own_room_opens_no_other_private_room() -> None:
    """From the left part of A: through hall h and the right part of A to k. B is the shortcut."""
    ink = ("##########", "#AABBBkkk#", "#AA####kk#", "#hh####kk#", "#hhhhAAkk#", "##########")
    start, goal = (0.75, 2.25), (4.25, 1.25)
    for pair in ((start, goal), (goal, start)):
        visitor = hn.under(drawn(ink), "visitor")
        path = visitor.plan(*pair).path
        assert "B" not in {ink[::-1][row][col] for row, col in path.cells.tolist()}
        shut = hn.under(drawn((*ink[:4], "#hhhh##kk#", ink[5])), "visitor")
        assert shut.plan(*pair).solved, "B must be crossed, for there is no other way"


@pytest.mark.parametrize("seed", range(12))
def test_ways_of_a_visitor_are_those_of_all_ways_over_parts(seed: int) -> None:
    """Drawings of 3 x 4 cells, whose rooms are often of two parts: every simple way is listed."""
    rng = np.random.default_rng(seed)
    blocks = rng.choice(list("ABCDhk#"), (3, 4))
    ink = tuple("".join(row) for row in blocks.tolist())
    planner = hn.under(drawn(ink), "visitor")
    graph: nx.Graph[tuple[int, int]] = nx.grid_2d_graph(3, 4)
    graph.remove_nodes_from([(r, c) for r, c in list(graph) if blocks[r, c] == "#"])
    part_at: dict[tuple[int, int], tuple[int, int]] = {}
    for names in (*"ABCD", "hk"):
        same = graph.subgraph([at for at in graph if blocks[at] in names])
        part_at |= {at: min(part) for part in nx.connected_components(same) for at in part}
    for start, goal in itertools.permutations(sorted(graph), 2):
        own = {blocks[start], blocks[goal]}
        asked: dict[int, set[str]] = {}
        for way in nx.all_simple_paths(graph, start, goal):
            parts = [one for one, _ in itertools.groupby(part_at[at] for at in way)]
            names = [blocks[one] if blocks[one].isupper() else "" for one in parts]
            kinds = "".join("u" if not name else "o" if name in own else "p" for name in names)
            if "up" in kinds and "pu" in kinds[kinds.index("up") :]:
                continue
            asked.setdefault(kinds.count("p"), set()).update(names)
        opened = own | asked.get(min(asked, default=0), set()) | {"h", "k"}
        free = graph.subgraph([at for at in graph if blocks[at] in opened])
        ends = [(0.5 * (col + 0.5), 0.5 * (2.5 - row)) for row, col in (start, goal)]
        result = planner.plan(*ends)
        assert result.solved is nx.has_path(free, start, goal), (ink, start, goal)
        if result.path is not None:
            passed = {ink[::-1][row][col] for row, col in result.path.cells.tolist()}
            assert passed <= opened, (ink, start, goal)


def test_a_door_must_be_as_wide_as_the_profile() -> None:
    planner = clinic({})
    wide = hn.under(planner, Profile(name="bed", width_m=0.8))
    assert wide.grid.robot_radius_m == pytest.approx(0.4, abs=1e-5)
    assert wide.plan("hall", "ward a").solved
    refused = wide.plan("hall", "ward b")
    (door,) = [one for one in planner.topology.rooms.doors if set(one.rooms) == {"hall", "ward b"}]
    assert not refused.solved
    assert planner.plan("hall", "ward b").solved
    way = f"places less than 0.80 m wide (door {door.number}, 0.50 m wide)"
    assert refused.settings["profile"]["forbids"].endswith(f"the way is by {way}")
    for one in planner.topology.rooms.doors[:2]:
        for width_m in (0.3, 0.5, 0.55, 0.8, 1.0, 1.05, 1.4):
            profile = Profile(name="w", width_m=width_m)
            solved = hn.under(planner, profile).plan(str(one.rooms[0]), str(one.rooms[1])).solved
            assert solved is (width_m <= one.width_m + 1e-9), (one.rooms, width_m)


def test_the_room_of_the_goal_has_room_to_turn() -> None:
    planner = clinic({"bath": PRIVATE})
    for turn_m, fits in ((1.5, True), (2.4, True), (3.2, False)):
        chair = hn.under(planner, Profile(name="chair", turn_m=turn_m))
        assert chair.plan("hall", "bath").solved is fits
        assert chair.plan("hall", (5.25, 3.75)).solved is fits
        assert chair.plan("bath", "hall").solved is (turn_m < 1.9)
    told = chair.plan("ward a", "bath").settings["profile"]["forbids"]
    assert "a goal where no circle of 3.20 m is free to turn in" in told


def test_costs_and_corridors_are_factors_of_metres() -> None:
    uses = {"hall": hn.RoomUse(corridor=True), "ward a": hn.RoomUse(cost=3.0)}
    planner = clinic(uses)
    visitor = hn.under(planner, "visitor")
    result = visitor.plan((2.25, 4.25), (1.75, 1.25))
    assert result.metric == "weighted"
    assert result.gap == pytest.approx(0.0, abs=1e-12)
    layer = visitor.costs
    label_of = planner.topology.rooms.labels.label_of
    factors = {name: layer.factors[label_of == at] for at, name in enumerate(NAMES)}
    assert set(factors["hall"]) == {1.0}
    assert set(factors["ward a"]) == {4.5}
    assert set(factors["bath"]) == {1.5}
    assert hn.under(planner, Profile(name="plain", costs=False)).costs is None
    robot = hn.under(clinic(uses, preset="robot"), "visitor")
    assert robot.preset.name == "robot"
    assert robot.plan("hall", "ward a").gap < 0.5


def test_tours_alternatives_words_and_batches_heed_the_profile() -> None:
    planner = hn.under(clinic({"ward a": PRIVATE}), "visitor")
    tour = hn.plan_tour(planner, ["hall", "ward a", "hall"])
    assert tour.solved
    assert any("ward a" in line for line in tour.words())
    assert hn.plan_tour(planner, ["ward b", "hall", "bath"]).to_dict()["settings"]["profile"][
        "forbids"
    ]
    found = hn.plan_alternatives(planner, "ward b", "ward a", 2)
    assert found[0].result.solved
    starts, goals = [(1.25, 1.25), (1.25, 1.25)], [(2.25, 4.25), (5.25, 3.75)]
    assert [str(one) for one in planner.plan_many(starts, goals).status] == ["solved", "no path"]
    with pytest.raises(InvalidValueError, match="a planner under a profile follows its own"):
        planner.update(grid=planner.grid)


def test_a_planner_under_a_profile_is_made_anew_after_an_update() -> None:
    planner = clinic({"ward a": PRIVATE}, preset="grid-astar")
    before = hn.under(planner, "visitor")
    slow = hn.CostLayer(np.full(planner.grid.shape, 2.0))
    planner.update(costs=slow) if planner.costs else None
    planner.update(topology=clinic({}, preset="grid-astar").topology)
    after = hn.under(planner, "visitor")
    assert after is not before
    assert after.plan("hall", "bath").solved


def test_uses_are_read_written_and_kept(tmp_path: Path) -> None:
    planner = clinic({"ward a": PRIVATE, "hall": hn.RoomUse(corridor=True, cost=1.25)})
    labels, grid = planner.topology.rooms.labels, planner.grid
    file = tmp_path / "rooms.yaml"
    hn.save_rooms(file, labels, grid)
    assert file.read_text().count("use: private") == 1
    assert hn.load_rooms(file, grid).uses == labels.uses
    hn.save(planner, tmp_path / "clinic.hnm")
    kept = hn.load(tmp_path / "clinic.hnm").rooms
    assert kept.uses == labels.uses
    # A use that a program changes is changed in the text, and comments stay.
    text = file.read_text().replace("- name: bath", "# mine\n- name: bath")
    file.write_text(text)
    other = hn.RoomLabels(NAMES, labels.label_of, uses={"bath": PRIVATE})
    hn.save_rooms(file, other, grid)
    assert hn.load_rooms(file, grid).uses == {"bath": PRIVATE}
    assert "# mine" in file.read_text()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("use: open", "use must be private, got 'open'"),
        ("prefer: 3", "prefer must be corridor, got 3"),
        ("cost: 0.5", "the cost of a room is a factor from 1 to 100, got 0.5"),
        ("cost: a", "cost: expected a number, got 'a'"),
        ("private: true", "unknown key 'private'"),
    ],
)
def test_uses_that_are_none_are_refused(line: str, message: str, tmp_path: Path) -> None:
    file = tmp_path / "rooms.yaml"
    square = "[[0, 0], [2, 0], [2, 2], [0, 2]]"
    file.write_text(f"rooms:\n- name: kitchen\n  polygon: {square}\n  {line}\n")
    grid = hn.OccupancyGrid(np.zeros((2, 4), np.float32), robot_radius_m=0)
    with pytest.raises(RoomsError, match="line 2: room 'kitchen'") as caught:
        hn.load_rooms(file, grid)
    assert message in str(caught.value)
    with pytest.raises(InvalidValueError, match="uses: no room is called 'attic'"):
        hn.RoomLabels(("hall",), np.zeros((2, 4), dtype=int), uses={"attic": PRIVATE})


@pytest.mark.full
def test_no_route_of_a_visitor_leads_through_private_rooms_of_the_office() -> None:
    """Many shortest ways of the office lead through rooms of others, and none of a visitor."""
    grid = hn.load_map(OFFICE, robot_radius_m=0.25)
    labels = hn.find_rooms(grid)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    kinds = dict(zip(labels.names, topology.rooms.kinds, strict=True))
    private = {name for name in labels.names if kinds[name] is None}
    labels = replace(labels, uses=dict.fromkeys(private, PRIVATE))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    shown = [
        name for name, is_one in zip(labels.names, topology.rooms.is_listed, strict=True) if is_one
    ]
    points = {name: topology.rooms.point_of(name) for name in shown}
    planner = hn.HybridPlanner(topology)
    visitor = hn.under(planner, Profile(name="visitor"))

    def passed(one: str, other: str, path: Any) -> set[str]:
        found = set(labels.label_of[tuple(path.cells.T)].tolist()) - {-1}
        return ({labels.names[label] for label in found} & private) - {one, other}

    longer, n_pairs = [], 0
    for one, other in itertools.combinations(shown, 2):
        plain = planner.plan(points[one], points[other])
        if not plain.solved:
            continue
        n_pairs += 1
        under = visitor.plan(points[one], points[other])
        assert under.solved
        assert under.gap == 0
        assert not passed(one, other, under.path)
        if passed(one, other, plain.path):
            longer.append(under.cost - plain.cost)
        else:
            assert under.cost == pytest.approx(plain.cost, abs=1e-9)
    assert (n_pairs, len(longer)) == (190, 18)
