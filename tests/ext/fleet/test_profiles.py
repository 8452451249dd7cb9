"""Plans under profiles, against a search of all cells and all ways out of private rooms."""

import itertools
import math
import re
from dataclasses import replace
from typing import Any

import networkx as nx
import numpy as np
import pytest
from scipy import ndimage

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet import Building, Link, LinkEnd
from hybridnav.planning import Profile
from tests.floors import random_floor
from tests.strategies import occupancy_grid

CROSS = ndimage.generate_binary_structure(2, 1)
STEPS = [(0, 1), (1, 0), (1, 1), (1, -1)]
Node = tuple[int, int, int]


def random_house(rng: np.random.Generator) -> Building:
    """Two floors of six rooms with random uses, joined by one to three links."""
    floors = []
    for number in range(2):
        plan = random_floor(rng, 2, 3)
        names = tuple(f"{number}-{label}" for label in range(6))
        uses = {
            name: hn.RoomUse(
                private=bool(rng.random() < 0.5),
                corridor=bool(rng.random() < 0.2),
                cost=float(rng.choice([1.0, 1.0, 2.5])),
            )
            for name in names
        }
        rooms = hn.RoomLabels(names, plan.label_of, uses=uses)
        pyramid = hn.DualGraphPyramid.build(occupancy_grid(plan.classes), rooms=rooms)
        planner = hn.HybridPlanner(hn.TopologicalMap(pyramid), preset="grid-astar")
        floors.append(hn.ext.fleet.Floor(str(number), planner))
    links = []
    for number in range(int(rng.integers(1, 4))):
        ends = tuple(LinkEnd(floor.name, somewhere(floor, rng)) for floor in floors)
        kind: Any = rng.choice(["lift", "stairs"])
        cost_m = float(rng.integers(0, 9))
        links.append(Link(name=f"link {number}", kind=kind, ends=ends, cost_m=cost_m))
    return Building(floors, links)


def somewhere(floor: hn.ext.fleet.Floor, rng: np.random.Generator) -> tuple[float, float]:
    grid = floor.planner.grid
    cells = np.argwhere(grid.enterable())
    x, y = grid.frame.points_of(cells[rng.integers(len(cells))]).tolist()
    return x, y


def random_profile(rng: np.random.Generator) -> Profile:
    return Profile(
        name="somebody",
        through_private=bool(rng.random() < 0.2),
        elsewhere=float(rng.choice([1.0, 1.5])),
        costs=bool(rng.random() < 0.5),
        stairs=bool(rng.random() < 0.5),
    )


class Oracle:
    """A building under a profile, taken apart into cells, and into parts by label."""

    def __init__(self, building: Building, profile: Profile) -> None:
        self.floors = building.floors
        self.links = [x for x in building.links if profile.stairs or x.kind != "stairs"]
        self.profile = profile
        self.grids = [floor.planner.grid for floor in building.floors]
        self.rooms: list[Any] = [floor.rooms for floor in building.floors]

    def use_at(self, node: Node) -> hn.RoomUse | None:
        """The use of the room of a cell, None outside of rooms."""
        floor, row, col = node
        label = int(self.rooms[floor].label_of[row, col])
        name = self.rooms[floor].names[label]
        return None if label < 0 else self.rooms[floor].uses.get(name, hn.RoomUse())

    def room_at(self, node: Node) -> tuple[int, int] | None:
        """The private room of a cell, None for another one."""
        use = self.use_at(node)
        if use is None or not use.private or self.profile.through_private:
            return None
        return node[0], int(self.rooms[node[0]].label_of[node[1:]])

    def factor(self, node: Node) -> float:
        """What a metre costs in a cell."""
        use = self.use_at(node)
        uses = self.rooms[node[0]].uses.values()
        away = self.profile.elsewhere if any(one.corridor for one in uses) else 1.0
        if use is None:
            return away
        return (1.0 if use.corridor else away) * (use.cost if self.profile.costs else 1.0)

    def node_of(self, floor: str, point: tuple[float, float]) -> Node:
        index = [each.name for each in self.floors].index(floor)
        row, col = self.grids[index].frame.cell_of(*point)
        return index, int(row), int(col)

    def parts(self) -> tuple[dict[Node, int], "nx.Graph[int]"]:
        """The part of each cell, and which parts touch or are joined by a link."""
        part_of: dict[Node, int] = {}
        graph: nx.Graph[int] = nx.Graph()
        for floor, grid in enumerate(self.grids):
            free = grid.enterable()
            rooms = {self.room_at((floor, r, c)) for r, c in np.argwhere(free).tolist()}
            for room in sorted(rooms, key=str):
                own = np.zeros(free.shape, dtype=bool)
                for r, c in np.argwhere(free).tolist():
                    own[r, c] = self.room_at((floor, r, c)) == room
                labels, count = ndimage.label(own, structure=CROSS)
                for one in range(1, count + 1):
                    graph.add_node(len(graph), room=room)
                    for r, c in np.argwhere(labels == one).tolist():
                        part_of[floor, r, c] = len(graph) - 1
        for (floor, row, col), part in part_of.items():
            for up, right in STEPS[:2]:
                other = part_of.get((floor, row + up, col + right), part)
                if other != part:
                    graph.add_edge(part, other)
        for link in self.links:
            ends = [part_of[self.node_of(end.floor, end.position_m)] for end in link.ends]
            graph.add_edges_from((a, b) for a, b in itertools.combinations(ends, 2) if a != b)
        return part_of, graph

    def opened(self, start: Node, goal: Node) -> set[tuple[int, int] | None]:
        """The private rooms that are open, by listing all ways over parts."""
        own = {self.room_at(start), self.room_at(goal)}
        part_of, graph = self.parts()
        room = nx.get_node_attributes(graph, "room")
        least, found = math.inf, set[tuple[int, int] | None]()
        ways = nx.all_simple_paths(graph, part_of[start], part_of[goal])
        for way in [[part_of[start]]] if part_of[start] == part_of[goal] else ways:
            text = "".join(
                "u" if room[part] is None else "o" if room[part] in own else "p" for part in way
            )
            # No private room is entered from a public part, and then left to one.
            if re.search("up", text) and re.search("pu", text[text.index("up") :]):
                continue
            more = [room[part] for part in way if room[part] is not None and room[part] not in own]
            if len(more) < least:
                least, found = len(more), set()
            if len(more) == least:
                found |= set(more)
        return own | found

    def cost(self, start: Node, goal: Node) -> float:
        """The least cost of all ways over cells and links."""
        opened = self.opened(start, goal)
        cells = {
            (floor, row, col)
            for floor, grid in enumerate(self.grids)
            for row, col in np.argwhere(grid.enterable()).tolist()
            if self.room_at((floor, row, col)) in opened | {None}
        }
        graph: nx.Graph[Node] = nx.Graph()
        graph.add_nodes_from([start, goal])
        for node in cells:
            floor, row, col = node
            for up, right in STEPS:
                other = floor, row + up, col + right
                if {other, (floor, row + up, col), (floor, row, col + right)} <= cells:
                    mean = (self.factor(node) + self.factor(other)) / 2
                    graph.add_edge(node, other, weight=math.hypot(up, right) * mean)
        for link in self.links:
            one, other = (self.node_of(end.floor, end.position_m) for end in link.ends)
            if {one, other} <= cells:
                known = graph.get_edge_data(one, other, {"weight": math.inf})["weight"]
                graph.add_edge(one, other, weight=min(link.cost_m, known))
        try:
            return float(nx.dijkstra_path_length(graph, start, goal))
        except nx.NetworkXNoPath:
            return math.inf


@pytest.mark.parametrize("seed", range(60))
def test_costs_are_those_of_a_search_of_all_cells(seed: int) -> None:
    rng = np.random.default_rng(seed)
    building, profile = random_house(rng), random_profile(rng)
    oracle = Oracle(building, profile)
    for _ in range(6):
        ends = []
        for _ in range(2):
            floor = building.floors[int(rng.integers(2))]
            ends.append((floor.name, somewhere(floor, rng)))
        start, goal = (oracle.node_of(*end) for end in ends)
        plan = building.plan(*ends, profile=profile)
        expected = oracle.cost(start, goal)
        assert plan.cost == pytest.approx(expected, abs=1e-9), (ends, plan.status)
        assert plan.profile == "somebody"
        if plan.solved:
            assert plan.gap == pytest.approx(0.0, abs=1e-9)
            passed = {
                oracle.room_at((oracle.node_of(name, ends[0][1])[0], *cell))
                for name, result in zip(plan.floors, plan.results, strict=True)
                if result.path is not None
                for cell in result.path.cells.tolist()
            }
            assert passed - {None} <= oracle.opened(start, goal)
            others = building.alternatives(ends[0], ends[1], 3, profile=profile)
            assert others[0].cost == plan.cost
        else:
            assert math.isinf(plan.lower_bound)


def test_private_rooms_are_open_again_without_profile() -> None:
    """Under a profile that passes all, on both floors, costs are those of the plain building."""
    rng = np.random.default_rng(5)
    building = random_house(rng)
    free = Profile(name="free", through_private=True, costs=False)
    for _ in range(20):
        ends = [
            (f.name, somewhere(f, rng))
            for f in rng.permutation(np.array(building.floors, dtype=object))
        ]
        plain, under = building.plan(*ends), building.plan(*ends, profile=free)
        assert under.cost == plain.cost
        assert under.profile == "free"
        assert "profile" not in plain.to_dict()
        assert under.to_dict()["profile"] == "free"


def test_profiles_have_names() -> None:
    building = random_house(np.random.default_rng(0))
    assert [one.name for one in building.profiles] == ["visitor", "staff", "wheelchair", "cart"]
    own = [Profile(name="bed", width_m=1.1), Profile(name="visitor", elsewhere=2.0)]
    known = Building(building.floors, building.links, profiles=own).profiles
    assert [one.name for one in known] == ["visitor", "staff", "wheelchair", "cart", "bed"]
    assert known[0].elsewhere == 2.0
    with pytest.raises(InvalidValueError, match="no profile is called 'visiter': did you mean vis"):
        building.plan("0-0", "1-0", profile="visiter")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"name": ""}, "a profile needs a name of one line"),
        ({"name": "a", "width_m": -1.0}, "width_m is -1.0, expected a number from 0 to 100"),
        ({"name": "a", "elsewhere": 0.5}, "elsewhere is 0.5, expected a number from 1 to 10"),
        ({"name": "a", "turn_m": math.nan}, "turn_m is nan"),
    ],
)
def test_what_is_no_profile_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidValueError, match=message):
        Profile(**given)
    assert replace(Profile(name="a"), name="b").name == "b"
