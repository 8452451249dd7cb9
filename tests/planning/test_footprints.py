"""Footprints between two discs: what each one proves, padding, and obstacles of one query."""

import heapq
import itertools
import math
from typing import Any

import numpy as np
import pytest
import shapely

import hybridnav as hn
from hybridnav.maps.costs import cost_along
from hybridnav.planning import load_preset
from hybridnav.planning.methods.discs import Discs
from hybridnav.refine import MotionCheck
from hybridnav.refine.curves import driven
from hybridnav.refine.footprint import Footprint
from hybridnav.search.found import ClosedCells, Query
from tests.oracle.long_robot import rooms as rooms_with_doors
from tests.oracle.motions import ShapelyRobot

CELL_M = 0.1
CART = [[0.45, 0.3], [0.45, -0.3], [-0.45, -0.3], [-0.45, 0.3]]
WIDE = [[1.0, 1.0], [1.0, -1.0], [-1.0, -1.0], [-1.0, 1.0]]
ENDS = (2.0, 3.0, 0.5), (17.0, 9.0, 1.0)
OMPL = pytest.importorskip("ompl")


class Yard:
    """A small map, perhaps turned, with some obstacles or a wall with a gap, and a robot of any
    outline, or one that is nearly round and hardly fits through the gap."""

    def __init__(self, seed: int, *, has_gap: bool = False) -> None:
        self.rng = rng = np.random.default_rng(seed)
        frame = hn.Frame(CELL_M, (2.1, -3.3), float(rng.choice([0.0, 0.7])))
        n = int(rng.integers(7, 10) if has_gap else rng.integers(3, 7))
        angles = np.linspace(0, math.tau, n, endpoint=False) + rng.uniform(0, 0.3, n)
        radii_m = rng.uniform(2.2 if has_gap else 0.8, 2.5, n) * CELL_M
        corners = radii_m[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self.footprint = Footprint(corners)
        if has_gap:
            occupied = np.zeros((16, 24), np.float32)
            occupied[:, 12] = 1
            occupied[5 : 5 + int(rng.integers(4, 7)), 12] = 0
        else:
            occupied = (rng.random((30, 40)) < 0.01).astype(np.float32)
        most_m = self.footprint.inscribed_radius_m
        radius_m = float(rng.choice([0.0, 0.5 * most_m, most_m]))
        self.grid = hn.OccupancyGrid(occupied, frame, robot_radius_m=radius_m)
        self.check = MotionCheck(self.grid, footprint=self.footprint)
        self.discs = Discs(self.grid, self.footprint)

    def pairs(self, n: int) -> list[Any]:
        """Pairs of poses in which the robot stands, in any points."""
        poses: list[Any] = []
        while len(poses) < 2 * n:
            positions = self.rng.random(2) * self.grid.shape
            at = self.grid.frame.points_of_grid(positions[None])[0]
            pose = np.append(at, self.rng.uniform(-3, 3))
            if self.check.state_valid(*pose):
                poses.append(pose)
        return list(zip(poses[::2], poses[1::2], strict=True))

    def query(self, start: Any, goal: Any, closed: ClosedCells | None = None) -> Query:
        cells = tuple(self.grid.frame.cell_of(*pose[:2]) for pose in (start, goal))
        return Query((cells[0], cells[1]), (start[:2], goal[:2]), closed)


@pytest.mark.parametrize("seed", range(12))
def test_a_path_of_the_large_disc_is_driven_with_every_heading(seed: int) -> None:
    yard = Yard(seed)
    robot = ShapelyRobot(yard.grid, yard.footprint.corners_m)
    found_some = 0
    for start, goal in yard.pairs(12):
        found = yard.discs.above(yard.query(start, goal))
        if found is None:
            continue
        found_some += 1
        points: Any = found.points
        steps = np.diff(points, axis=0)
        ahead = [start[2], *np.arctan2(steps[:, 1], steps[:, 0])]
        poses = np.vstack([np.column_stack([points, ahead]), goal])
        assert len(driven(yard.check, poses))
        dense = [np.linspace(a, b, 20) for a, b in itertools.pairwise(points)]
        along = np.concatenate([points, *dense])
        headings = yard.rng.uniform(-math.pi, math.pi, len(along))
        assert not robot.is_hit(np.column_stack([along, headings]), grown_m=-1e-7)
    assert found_some


def shortest_on_lattice(yard: Yard, start: Any, goal: Any) -> float:
    """Metres of a path of the footprint over poses at centres in 8 headings; infinite if none."""
    frame, headings = yard.grid.frame, 8
    yaws = np.arange(headings) * math.tau / headings

    def pose(node: tuple[int, int, int]) -> Any:
        return (*frame.points_of(np.array([node[:2]]))[0].tolist(), float(yaws[node[2]]))

    heap = []
    for heading in range(headings):
        first = (*frame.cell_of(*start[:2]), heading)
        if yard.check.turn_valid(*start, *pose(first)):
            heap.append((math.dist(start[:2], pose(first)[:2]), first))
    heapq.heapify(heap)
    done: set[Any] = set()
    last, best = frame.cell_of(*goal[:2]), math.inf
    while heap:
        length_m, node = heapq.heappop(heap)
        if node in done or length_m >= best:
            continue
        done.add(node)
        here = pose(node)
        if node[:2] == last and yard.check.turn_valid(*here, *goal):
            best = min(best, length_m + math.dist(here[:2], goal[:2]))
        row, col, heading = node
        turns = [(row, col, (heading + way) % headings) for way in (-1, 1)]
        moves = [(row + i, col + j, heading) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
        for other in turns + moves:
            if other not in done and yard.check.turn_valid(*here, *pose(other)):
                heapq.heappush(heap, (length_m + math.dist(here[:2], pose(other)[:2]), other))
    return best


def test_the_small_disc_never_denies_a_path_and_its_bound_holds() -> None:
    denied = kept = 0
    for seed in range(16):
        yard = Yard(seed, has_gap=True)
        for start, goal in yard.pairs(3):
            found = yard.discs.below(yard.query(start, goal))
            if found is None:
                assert yard.discs.inscribed is None
                continue
            length_m = shortest_on_lattice(yard, start, goal)
            denied += not found.has_path
            kept += math.isfinite(length_m)
            assert found.lower_bound_m <= length_m * (1 + 1e-9)
    assert min(denied, kept) > 3


def test_obstacles_of_a_query_hold_for_the_large_disc_too() -> None:
    for seed in range(6):
        yard = Yard(seed)
        solid = np.sort(yard.rng.choice(yard.grid.classes.size, 8, replace=False))
        closed = ClosedCells(solid, solid)
        check = yard.check.confined(closed=solid, solid=solid)
        occupied = yard.grid.probability.copy()
        occupied.flat[solid] = 1
        robot = ShapelyRobot(
            hn.OccupancyGrid(occupied, yard.grid.frame, robot_radius_m=0), yard.footprint.corners_m
        )
        for start, goal in yard.pairs(10):
            inside = [check.state_valid(*pose) for pose in (start, goal)]
            at = np.array([start, goal])
            assert inside == [not robot.is_hit(pose[None], grown_m=0) for pose in at] or all(inside)
            found = yard.discs.above(yard.query(start, goal, closed))
            if found is not None:
                along: Any = found.points
                yaws = yard.rng.uniform(-3, 3, len(along))
                assert not robot.is_hit(np.column_stack([along, yaws]), grown_m=-1e-7)


# End to end, with OMPL between the discs.


def planner_of(
    grid: hn.OccupancyGrid, *settings: str, footprint: Any = CART, space: str = "differential"
) -> hn.HybridPlanner:
    given = [f"space={space}", f"footprint={footprint}", "budget_s=2", *settings]
    overrides = ["planner.corridor=neighbours", *(f"planner.ompl.{text}" for text in given)]
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    return hn.HybridPlanner(topology, preset=load_preset("ompl", overrides=overrides))


def bodies_of(result: hn.PlanResult, footprint: Any = CART) -> Any:
    """Outlines of the robot along a path of turns and drives, 2 cm and 0.02 rad apart."""
    headings: Any = result.path.headings_rad
    poses = np.column_stack([result.path.points, headings])
    dense = []
    for first, second in itertools.pairwise(poses):
        turn = math.remainder(second[2] - first[2], math.tau)
        steps = math.ceil(math.hypot(*(second - first)[:2], turn) / 0.02) + 1
        share = np.linspace(0, 1, steps)[:, None]
        dense.append(first + share * np.append((second - first)[:2], turn))
    along = np.concatenate(dense)
    cosine, sine = np.cos(along[:, 2, None]), np.sin(along[:, 2, None])
    x, y = np.transpose(footprint)
    xs = along[:, 0, None] + cosine * x - sine * y
    ys = along[:, 1, None] + sine * x + cosine * y
    return shapely.polygons(np.stack([xs, ys], axis=-1))


def walls_of(grid: hn.OccupancyGrid) -> Any:
    low = np.argwhere(grid.measured == hn.CellClass.OCCUPIED)[:, ::-1] * grid.resolution_m
    return shapely.STRtree(shapely.box(*low.T, *(low + grid.resolution_m).T))


def by(result: hn.PlanResult) -> str:
    return result.refinement.by


@pytest.fixture(scope="module")
def rooms() -> hn.OccupancyGrid:
    """Rooms with doors of 0.9 m, inflated by 0.3 m."""
    return rooms_with_doors()


@pytest.mark.parametrize("space", ["differential", "se2"])
def test_a_result_says_which_of_the_three_answered(rooms: hn.OccupancyGrid, space: str) -> None:
    made = planner_of(rooms, space=space)
    inside = made.plan((2.0, 2.0, 0.5), (4.5, 4.5, 2.0))
    assert (by(inside), inside.gap) == ("circumscribed disc", 0.0)
    assert inside.refinement.steps == ("circumscribed disc: solved",)
    through = made.plan(*ENDS)
    assert through.solved
    assert by(through) == "OMPL"
    assert through.refinement.steps[0] == "circumscribed disc: no path"
    for result in (inside, through):
        shortest = hn.HybridPlanner(made.topology).plan(result.start[:2], result.goal[:2])  # type: ignore[index]
        assert result.lower_bound == pytest.approx(min(shortest.cost, result.cost))


@pytest.mark.parametrize("space", ["differential", "se2", "dubins", "reeds-shepp"])
def test_no_path_of_the_small_disc_is_a_proof_for_every_space(rooms, space):
    radius = ["turning_radius_m=0.8"] if space in {"dubins", "reeds-shepp"} else []
    made = planner_of(rooms, *radius, footprint=WIDE, space=space)
    result = made.plan((3.0, 3.0, 0.0), (17.0, 9.0, 0.0))
    assert result.status is hn.PlanStatus.NO_PATH
    assert by(result) == "inscribed disc"
    assert result.lower_bound == math.inf
    # Where the map itself has no way, the disc that it was inflated for is that proof.
    shut = planner_of(rooms, *radius, space=space).plan(
        *ENDS, blocked={"polygons": [shapely.LineString([(6.1, -1), (6.1, 13)])]}
    )
    assert (shut.status, by(shut)) == (hn.PlanStatus.NO_PATH, "inscribed disc")


def test_a_way_round_of_the_large_disc_counts_only_where_ompl_finds_none_shorter() -> None:
    free = np.zeros((80, 120), dtype=np.bool_)
    free[4:76, 4:58] = free[4:76, 62:116] = True
    free[8:16, 58:62] = free[50:74, 58:62] = True  # doors of 0.8 m and 2.4 m
    grid = hn.OccupancyGrid((~free).astype(np.float32), hn.Frame(0.1), robot_radius_m=0.3)
    ends = (4.5, 1.2, 0.0), (7.5, 1.2, 0.0)
    short = planner_of(grid).plan(*ends)
    assert by(short) == "OMPL"
    assert "over the bound" in short.refinement.steps[0]
    assert short.cost < 3.3
    hasty = planner_of(grid, "planner=BITstar", "budget_s=0.01", "confine=mask").plan(*ends)
    assert hasty.solved
    if by(hasty) == "circumscribed disc":
        assert hasty.cost > 6
        assert hasty.gap > 1


def test_padding_keeps_every_path_off_walls(rooms: hn.OccupancyGrid) -> None:
    plain, padded = planner_of(rooms), planner_of(rooms, "footprint_padding_m=0.05")
    walls = walls_of(rooms)
    rng = np.random.default_rng(0)
    near = 0
    for _ in range(6):
        yaws = rng.uniform(-3, 3, 2).tolist()
        start = (*rng.uniform((1, 1), (5, 5)).tolist(), yaws[0])
        goal = (*rng.uniform((14, 7), (16.5, 11)).tolist(), yaws[1])
        for made, least_m in ((plain, 0.0), (padded, 0.05)):
            result = made.plan(start, goal)
            assert result.solved
            bodies = bodies_of(result)
            for body in bodies:
                ground = walls.geometries[walls.query(body, "dwithin", 0.05)]
                least = shapely.distance(ground, body).min(initial=1.0)
                assert least >= least_m - 1e-3
                near += made is plain and least < 0.02
    assert near  # without it they do come near


def test_padding_is_nav2s_for_a_rectangle_and_never_less_for_others() -> None:
    cart = Footprint.of(CART).padded(0.05)
    nav2 = np.array(CART) + np.sign(CART) * 0.05
    grown = shapely.Polygon(cart.corners_m)
    assert grown.symmetric_difference(shapely.Polygon(nav2)).area < 1e-9
    kite = [[0.5, 0.0], [0.0, 0.2], [-0.1, 0.0], [0.0, -0.4]]
    grown = shapely.Polygon(Footprint.of(kite).padded(0.1).corners_m)
    assert grown.buffer(1e-9).contains(shapely.Polygon(kite).buffer(0.1))
    assert Footprint.of(kite).padded(0.0).corners_m.shape == (4, 2)
    with pytest.raises(hn.errors.PresetError, match="footprint_padding_m goes with a footprint"):
        load_preset("ompl", overrides=["planner.ompl.footprint_padding_m=0.1"])


def test_an_obstacle_of_one_query_holds_for_the_whole_robot_and_a_keepout_for_its_base(rooms):
    made = planner_of(rooms)
    start, goal = (2.0, 2.0, 0.5), (4.5, 4.5, 2.0)
    pallet = shapely.box(2.9, 2.9, 3.6, 3.6)
    free = made.plan(start, goal)
    assert shapely.intersects(bodies_of(free), pallet).any()
    result = made.plan(start, goal, blocked={"polygons": [pallet]})
    assert result.solved
    assert not shapely.intersects(bodies_of(result), pallet.buffer(-1e-3)).any()
    # The robot stands beside it with its side, and with its front in it.
    beside = (2.45, 3.25)
    assert made.plan((*beside, math.pi / 2), goal, blocked={"polygons": [pallet]}).solved
    ahead = shapely.box(2.85, 2.9, 3.6, 3.6)
    within = made.plan((*beside, 0.2), goal, blocked={"polygons": [ahead]})
    assert within.status is hn.PlanStatus.START_BLOCKED
    kept = made.plan(start, goal, blocked={"keepout": [pallet]})
    assert kept.solved
    assert not shapely.LineString(kept.path.points).intersects(pallet.buffer(-0.05))
    assert kept.cost <= result.cost


def test_a_planner_of_the_map_that_changed_answers_by_it(rooms: hn.OccupancyGrid) -> None:
    made = planner_of(rooms)
    assert made.plan(*ENDS).solved
    occupied = rooms.probability.copy()
    occupied[:, 120:123] = 1  # both doors of the wall are shut now
    now = hn.OccupancyGrid(occupied, rooms.frame, robot_radius_m=0.3)
    with pytest.raises(hn.errors.InvalidValueError, match="make a new planner of the map now"):
        made.update(grid=now)
    assert made.plan(*ENDS).solved
    shut = planner_of(now)
    assert shut.plan(*ENDS).status is hn.PlanStatus.NO_PATH
    assert shut.plan((2.0, 2.0, 0.5), (4.5, 4.5, 2.0)).solved
    layer = hn.CostLayer(np.full(now.shape, 2.0))
    with pytest.raises(hn.errors.InvalidValueError, match="for a footprint that turns on the spot"):
        hn.HybridPlanner(shut.topology, preset="ompl", costs=layer)


@pytest.mark.parametrize("space", ["differential", "se2"])
def test_a_footprint_honours_costs_masks_and_keepouts(rooms: hn.OccupancyGrid, space: str) -> None:
    """An answer of a disc is no dearer than the shortest path of the footprint; the body stays off
    closed cells, and the base off a keepout zone; the bound is below the path of `robot`, a disc.
    """
    plain = planner_of(rooms, space=space)
    rng = np.random.default_rng(1)
    dear = np.ones(rooms.shape, np.float32)
    closed, keepout = np.zeros((2, *rooms.shape), np.bool_)
    pallet, zone = shapely.box(2.9, 2.9, 3.6, 3.6), shapely.box(14.0, 8.0, 16.0, 9.0)
    for cells, shape in ((closed, pallet), (keepout, zone)):
        west, south, east, north = np.rint(np.array(shape.bounds) / rooms.resolution_m).astype(int)
        cells[south:north, west:east] = True
    for row, col in rng.integers((0, 0), rooms.shape, (40, 2)):
        dear[row : row + 12, col : col + 12] = 4.0
    layer = hn.CostLayer.clearance(rooms) | hn.CostLayer(dear, closed=closed, keepout=keepout)
    made = hn.HybridPlanner(plain.topology, preset=plain.preset, costs=layer)
    disc = hn.HybridPlanner(plain.topology, preset="robot", costs=layer)
    answered, shut = set(), {"polygons": [pallet], "keepout": [zone]}
    ends = [ENDS, ((2.0, 2.0, 0.5), (4.5, 4.5, 2.0)), ((14.0, 7.0, 0.0), (15.0, 10.0, 0.0))]
    for start, goal in ends:
        result, short = made.plan(start, goal), plain.plan(start, goal, blocked=shut)
        assert result.solved
        assert short.path is not None
        answered.add(by(result))
        assert result.metric == "any-angle-weighted"
        assert result.cost == pytest.approx(cost_along(rooms, layer, result.path.points))
        if by(result) != "OMPL":
            assert result.cost <= cost_along(rooms, layer, short.path.points) * 1.05
        walls, bodies = walls_of(rooms), bodies_of(result)
        for body in bodies:
            assert not shapely.intersects(body.buffer(-1e-3), pallet)
            ground = walls.geometries[walls.query(body.buffer(-1e-3), "intersects")]
            assert not len(ground)
        assert not shapely.LineString(result.path.points).intersects(zone.buffer(-0.01))
        assert 0 < result.lower_bound <= result.cost
        cheapest = disc.plan(start[:2], goal[:2], smooth="line-of-sight")
        assert result.lower_bound <= cheapest.cost * (1 + 1e-9)
    assert "inscribed disc" in answered
    inside = made.plan((3.2, 3.2, 0.0), ENDS[1])
    assert inside.status is hn.PlanStatus.START_BLOCKED
    with pytest.raises(hn.errors.InvalidValueError, match="make a new planner of the map now"):
        made.update(costs=layer)
    with pytest.raises(hn.errors.InvalidValueError, match="without OMPL"):
        made.plan(*ENDS, smooth="arcs")


def test_where_the_body_fits_through_no_door_nothing_is_claimed(rooms: hn.OccupancyGrid) -> None:
    """Its disc fits, and it does not: neither disc decides, and OMPL finds nothing."""
    aside = [[0.5, 0.3], [-0.5, 0.3], [-0.5, -0.7], [0.5, -0.7]]
    result = planner_of(rooms, "budget_s=0.4", footprint=aside, space="se2").plan(*ENDS)
    assert result.status in {hn.PlanStatus.APPROXIMATE, hn.PlanStatus.TIMEOUT}
    assert by(result) == "OMPL"
