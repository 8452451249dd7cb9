"""What `Blocked` closes: areas against single cells, arcs against reachability, and its errors."""

import itertools
import math
import types
from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import hybridnav as hn
from benchmarks.worlds import office_world
from hybridnav.closures.blocked import Blocked, as_blocked
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from hybridnav.pyramid import LevelArc
from tests.oracle.grid import components, move_graph
from tests.plans import TWO_ROOMS as ROOMS
from tests.strategies import drawn, examples, occupancy_grid, scenes

TOLERANCE = 1e-5
DOOR = hn.Door(3, ("kitchen", None), (1.0, 2.0), 0.9, (LevelArc(2, 0),))
PLAIN = settings(max_examples=examples(100), deadline=None, derandomize=True)


def map_of(classes: Any, **build: Any) -> hn.TopologicalMap:
    return hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(classes), **build))


def rooms() -> hn.TopologicalMap:
    """Two rooms, each one place, with two doors."""
    return map_of(ROOMS, merge_distance_m=7.0, linkage="radius", seed=0)


def empty_map(frame: Frame, shape: tuple[int, int], radius_cells: float = 0.0) -> Any:
    """What `cells_of` reads of a map, without a pyramid, for closing areas and cells alone."""
    grid = OccupancyGrid(
        np.zeros(shape, dtype=np.float32),
        frame=frame,
        robot_radius_m=radius_cells * frame.resolution_m,
    )
    none = np.empty(0, dtype=np.int64)
    return types.SimpleNamespace(
        grid=grid, place_ids=none, arc_ids=none, level=types.SimpleNamespace(is_self_loop=none > 0)
    )


def mask_of(blocked: Blocked, topology: Any) -> Any:
    """The closed cells as bool (rows, cols), after a look at the form of the answer."""
    flat = blocked.cells_of(topology)
    assert flat.dtype == np.int64
    assert (np.diff(flat) > 0).all()
    mask = np.zeros(topology.grid.shape, dtype=np.bool_)
    mask.ravel()[flat] = True
    return mask


def square(frame: Frame, cell: tuple[int, int], grown: float) -> Any:
    """The square of a cell in metres, grown or shrunk by a part of a cell on each side."""
    row, col = cell
    low, high = -grown, 1 + grown
    corners = [(low, low), (low, high), (high, high), (high, low)]
    return shapely.Polygon(frame.points_of_grid([(row + up, col + right) for up, right in corners]))


def moves_of(mask: Any) -> tuple[Any, Any]:
    """Legal moves between the cells that are not closed, as flat cells."""
    graph = move_graph(~mask).tocoo()
    return graph.row.astype(np.int64), graph.col.astype(np.int64)


@dataclass(frozen=True)
class Case:
    """An area on a map without obstacles."""

    frame: Frame
    shape: tuple[int, int]
    radius_cells: float
    area: Any

    @property
    def radius_m(self) -> float:
        """The robot's radius."""
        return self.radius_cells * self.frame.resolution_m

    def closed(self) -> Any:
        topology = empty_map(self.frame, self.shape, self.radius_cells)
        try:
            return mask_of(Blocked(polygons=[self.area]), topology)
        except hn.errors.InvalidValueError as error:
            assert "must meet the map" in str(error)  # noqa: PT017 - many areas lie off the map
            return np.zeros(self.shape, dtype=np.bool_)

    def reaches(self, cell: tuple[int, int], grown: float) -> bool:
        """Whether the area comes as near to a grown square as the radius, by plain distance."""
        return bool(self.area.distance(square(self.frame, cell, grown)) <= self.radius_m)


frames = st.builds(
    Frame,
    st.sampled_from([1.0, 0.05, 0.1, 0.3]),
    st.sampled_from([(0.0, 0.0), (-3.0, 2.5), (431_207.3, 5_412_300.9)]),
    st.sampled_from([0.0, 0.3, -2.0, math.pi / 2, math.pi / 4]),
)
# Many corners fall on corners and sides of cells, many outside the map.
coordinates = st.one_of(
    st.integers(-3, 12).map(float),
    st.integers(-6, 24).map(lambda half: half / 2),
    st.floats(-4, 14, allow_nan=False).map(lambda value: round(value, 3)),
)
corners = st.tuples(coordinates, coordinates)


@st.composite
def shapes_in_cells(draw: st.DrawFn, kinds: tuple[str, ...]) -> Any:
    """Draw areas with (row, col) as coordinates."""
    kind = draw(st.sampled_from(kinds))
    if kind == "line":
        return shapely.LineString(draw(st.lists(corners, min_size=2, max_size=5)))
    if kind == "lines":
        pairs = draw(st.lists(st.tuples(corners, corners), min_size=1, max_size=3))
        return shapely.MultiLineString(pairs)
    if kind == "box":
        (a, b), (c, d) = draw(corners), draw(corners)
        return shapely.box(min(a, c), min(b, d), max(a, c), max(b, d))
    hull = shapely.MultiPoint(draw(st.lists(corners, min_size=3, max_size=8))).convex_hull
    if kind == "hull":
        return hull
    if kind == "ring":
        return hull.difference(hull.buffer(-draw(st.sampled_from([0.2, 1.0, 2.0]))))
    return hull.symmetric_difference(shapely.box(2, 2, 2 + draw(coordinates) ** 2, 6))


@st.composite
def cases(draw: st.DrawFn, *kinds: str) -> Case:
    """Draw areas in the map frame and maps of at most 9 x 9 cells."""
    frame, area = draw(frames), draw(shapes_in_cells(kinds))
    wanted = {"line": 1, "lines": 1}.get(kinds[0], 2)
    assume(not area.is_empty and area.is_valid and shapely.get_dimensions(area) == wanted)
    assume(area.geom_type != "GeometryCollection")
    in_metres = shapely.transform(area, frame.points_of_grid)
    assume(in_metres.is_valid)
    shape = draw(st.tuples(st.integers(1, 9), st.integers(1, 9)))
    return Case(frame, shape, draw(st.sampled_from([0.0, 0.0, 0.4, 1.0, 2.5])), in_metres)


@given(case=cases("hull", "box", "ring", "pieces"))
@settings(PLAIN)
def test_an_area_closes_the_cells_whose_inside_it_reaches(case: Case) -> None:
    mask = case.closed()
    for cell in np.ndindex(case.shape):
        if case.reaches(cell, -TOLERANCE):
            assert mask[cell], f"{cell} lies within the area"
        if not case.reaches(cell, -1e-7):
            assert not mask[cell], f"{cell} lies outside the area"


@given(case=cases("line", "lines"))
@settings(PLAIN)
def test_a_line_closes_the_cells_it_passes_through(case: Case) -> None:
    mask = case.closed()
    for cell in np.ndindex(case.shape):
        if case.reaches(cell, -TOLERANCE):
            assert mask[cell], f"{cell} is passed"
        if not case.reaches(cell, TOLERANCE):
            assert not mask[cell], f"{cell} is not passed"


@given(case=cases("line", "hull", "box", "lines", "ring", "pieces"))
@settings(PLAIN)
def test_no_move_crosses_an_area_or_comes_nearer_than_the_radius(case: Case) -> None:
    tail, head = moves_of(case.closed())
    endpoints = [case.frame.points_of(np.stack(divmod(cell, case.shape[1]), axis=1))
            for cell in (tail, head)]  # fmt: skip
    segments = shapely.linestrings(np.stack(endpoints, axis=1)) if len(tail) else np.empty(0)
    slack_m = TOLERANCE * case.frame.resolution_m
    if case.radius_m:
        assert (shapely.distance(segments, case.area) > case.radius_m - slack_m).all()
    elif shapely.get_dimensions(case.area) == 1:
        assert not shapely.intersects(segments, case.area).any()
    else:
        inside = shapely.intersection(segments, case.area.buffer(-slack_m))
        assert (shapely.length(inside) <= slack_m).all()


@pytest.mark.parametrize("at", [2.0, 2.3, 2.0 - 1e-12, 2.0 + 1e-12, 2 - 1e-6, 2 - 2e-6, 2 + 1e-6])
@pytest.mark.parametrize("width", [0.0, 1e-9, 1e-3])
def test_a_door_drawn_along_a_side_of_cells_still_closes(at: float, width: float) -> None:
    area = (
        shapely.LineString([(at, 0), (at, 4)]) if not width else shapely.box(at, 0, at + width, 4)
    )
    mask = mask_of(Blocked(polygons=[area]), empty_map(Frame(), (4, 6)))
    assert components(~mask)[0, 0] != components(~mask)[0, 5]
    assert mask[:, 0].sum() == mask[:, 4].sum() == 0
    if at == 2.0:
        assert mask[:, 2].all()
        assert mask.sum() == 4


def test_an_area_along_sides_of_cells_closes_no_neighbours() -> None:
    frame = Frame(0.05, (-3.0, 1.7))
    corner, opposite = frame.points_of_grid([(2, 3), (5, 9)])
    mask = mask_of(Blocked(polygons=[shapely.box(*corner, *opposite)]), empty_map(frame, (9, 12)))
    assert mask[2:5, 3:9].all()
    assert mask.sum() == 3 * 6


def test_a_robot_keeps_its_radius_off_an_area_but_not_off_cells() -> None:
    area, topology = shapely.box(4, 4, 5, 5), empty_map(Frame(), (9, 9), radius_cells=1.0)
    row, col = np.indices((9, 9))
    beside = np.hypot(np.maximum(abs(row - 4) - 1, 0), np.maximum(abs(col - 4) - 1, 0)) < 1
    assert (mask_of(Blocked(polygons=[area]), topology) == beside).all()
    assert Blocked(cells=[(4, 4)]).cells_of(topology).tolist() == [4 * 9 + 4]


def test_holes_stay_open_and_points_make_a_polygon() -> None:
    ring = shapely.box(1, 1, 6, 6).difference(shapely.box(2, 2, 5, 5))
    topology = empty_map(Frame(), (7, 7))
    mask = mask_of(Blocked(polygons=[ring]), topology)
    assert not mask[2:5, 2:5].any()
    assert mask.sum() == 16
    listed = mask_of(Blocked(polygons=[[(1, 1), (6, 1), (6, 6), (1, 6)]]), topology)
    assert listed.sum() == 25


@pytest.mark.parametrize("box", [(20, 20, 30, 30), (-9, 0, -1, 7), (0, 8, 7, 9)])
def test_an_area_outside_the_map_is_refused(box: tuple[float, float, float, float]) -> None:
    topology = empty_map(Frame(), (7, 7), radius_cells=1.0)
    expected = "must meet the map, which spans x 0.00 to 7.00 m, y 0.00 to 7.00 m, got <POLYGON"
    with pytest.raises(hn.errors.InvalidValueError, match=expected):
        Blocked(polygons=[shapely.box(3, 3, 4, 4), shapely.box(*box)]).cells_of(topology)


def test_nothing_may_be_closed_for_lists_may_be_empty() -> None:
    assert not len(Blocked().cells_of(empty_map(Frame(), (7, 7))))
    assert not len(Blocked(doors=[], rooms=[]).cells_of(empty_map(Frame(), (7, 7))))


def test_an_area_over_a_large_map_is_no_work() -> None:
    topology = empty_map(Frame(0.05), (3000, 2500), radius_cells=5.0)
    everything = Blocked(polygons=[shapely.box(-1e9, -1e9, 1e9, 1e9)]).cells_of(topology)
    assert (everything == np.arange(3000 * 2500)).all()
    disc = Blocked(polygons=[shapely.Point(62.5, 75.0).buffer(50.0, quad_segs=90)])
    mask = mask_of(disc, topology)
    row, col = np.indices(mask.shape)
    distance = np.hypot(row + 0.5 - 1500, col + 0.5 - 1250)
    assert mask[distance < 1004.8].all()
    assert not mask[distance > 1005.8].any()


@given(st.lists(st.tuples(st.integers(0, 8), st.integers(0, 8)), max_size=30), st.data())
def test_everything_closed_is_one_sorted_set(cells: list[tuple[int, int]], data: Any) -> None:
    low, high = sorted(data.draw(st.tuples(st.integers(0, 9), st.integers(0, 9))))
    area = [shapely.box(low, low, high, high)] * 2 if low < high else []
    dtype = data.draw(st.sampled_from([np.uint8, np.int32, np.int64, np.uint64]))
    given_cells = np.array(cells, dtype=dtype).reshape(-1, 2)
    mask = mask_of(Blocked(cells=given_cells, polygons=area), empty_map(Frame(), (9, 9)))
    expected = np.zeros((9, 9), dtype=np.bool_)
    expected[low:high, low:high] = True
    for cell in cells:
        expected[cell] = True
    assert (mask == expected).all()


def test_a_place_closes_its_receptive_field() -> None:
    topology = rooms()
    for places in ([0], [1], [1, 0, 1]):
        mask = mask_of(Blocked(places=places), topology)
        assert (mask == np.isin(topology.level.field_of, places)).all()


def pairs_of(topology: hn.TopologicalMap) -> dict[int, Any]:
    """Flat cell pairs of the boundary of each arc that is no self-loop."""
    cols = topology.grid.shape[1]
    level = topology.level
    return {
        arc: level.boundary(arc) @ np.array([cols, 1])
        for arc in np.flatnonzero(~level.is_self_loop).tolist()
    }


def arcs_crossed(topology: hn.TopologicalMap, mask: Any) -> dict[int, set[tuple[int, int]]]:
    """Legal moves across each boundary: sides on it, diagonals with a pair of it in their block."""
    field, cols = topology.level.field_of.ravel(), topology.grid.shape[1]
    arc_of = {
        frozenset(pair): arc for arc, pairs in pairs_of(topology).items() for pair in pairs.tolist()
    }
    crossed = defaultdict(set)
    enterable = topology.grid.enterable(allow_unexplored=True) & ~mask
    for tail, head in zip(*moves_of(~enterable), strict=True):
        if field[tail] == field[head]:
            continue
        corners_of = {tail, head}
        if tail // cols != head // cols and tail % cols != head % cols:
            corners_of |= {tail // cols * cols + head % cols, head // cols * cols + tail % cols}
        between = {field[tail], field[head]}
        for pair in itertools.combinations(corners_of, 2):
            arc = arc_of.get(frozenset(pair))
            if arc is not None and {field[cell] for cell in pair} == between:
                crossed[arc].add((int(tail), int(head)))
    return crossed


@given(scene=scenes(max_side=12), data=st.data())
@settings(PLAIN, max_examples=examples(150))
def test_no_move_crosses_a_closed_arc(scene: Any, data: Any) -> None:
    topology = hn.TopologicalMap(scene.pyramid("radius"))
    pairs = pairs_of(topology)
    assume(pairs)
    arcs = data.draw(st.lists(st.sampled_from(sorted(pairs)), min_size=1, max_size=3))
    mask = mask_of(Blocked(arcs=arcs), topology)
    on_boundary = np.concatenate([pairs[arc].ravel() for arc in arcs])
    assert set(np.flatnonzero(mask)) <= set(on_boundary)
    assert mask.sum() <= sum(len(pairs[arc]) for arc in set(arcs))
    assert not arcs_crossed(topology, mask).keys() & set(arcs)


@given(scene=scenes(max_side=14), data=st.data())
@settings(PLAIN, max_examples=examples(150))
def test_closing_all_arcs_round_some_places_cuts_them_off(scene: Any, data: Any) -> None:
    topology = hn.TopologicalMap(scene.pyramid("radius"))
    pairs = pairs_of(topology)
    assume(pairs)
    inside = np.array(data.draw(st.lists(st.booleans(), min_size=topology.n_places,
                                         max_size=topology.n_places)))  # fmt: skip
    endpoints = inside[topology.arcs]
    cut = [arc for arc in pairs if endpoints[arc, 0] != endpoints[arc, 1]]
    mask = mask_of(Blocked(arcs=cut), topology)
    label = components(topology.grid.enterable(allow_unexplored=True) & ~mask)
    kept = label > 0
    side = inside[topology.level.field_of]
    assert not set(label[kept & side]) & set(label[kept & ~side])


@given(scene=scenes(max_side=12), data=st.data())
@settings(PLAIN)
def test_places_whose_arcs_are_all_closed_meet_at_points_at_most(scene: Any, data: Any) -> None:
    topology = hn.TopologicalMap(scene.pyramid("radius"))
    pairs = pairs_of(topology)
    assume(pairs)
    endpoints = set(topology.arcs[data.draw(st.sampled_from(sorted(pairs)))].tolist())
    between = [arc for arc in pairs if set(topology.arcs[arc].tolist()) == endpoints]
    mask = mask_of(Blocked(arcs=between), topology)
    field, cols = topology.level.field_of, topology.grid.shape[1]
    enterable = topology.grid.enterable(allow_unexplored=True) & ~mask
    for tail, head in zip(*moves_of(~enterable), strict=True):
        (row, col), (to_row, to_col) = divmod(int(tail), cols), divmod(int(head), cols)
        if {field[row, col], field[to_row, to_col]} == endpoints:
            assert row != to_row
            assert col != to_col
            assert not {field[row, to_col], field[to_row, col]} & endpoints


def cost_of(topology: hn.TopologicalMap, arc: int, others: list[Any], closed: Any) -> Any:
    """Other arcs closed too, free cells and all cells lost to their place, in that order."""
    harmed = sum(bool(np.isin(pairs, closed).any(axis=1).all()) for pairs in others)
    lost, free = 0, 0
    for place in topology.arcs[arc].tolist():
        inside = topology.level.field_of.ravel() == place
        kept = inside.copy()
        kept[closed] = False
        label = components(kept.reshape(topology.grid.shape))
        here = int(inside.sum()) - int(np.bincount(label[label > 0]).max(initial=0))
        lost += here
        free += here * (topology.classes[place] == CellClass.FREE)
    return harmed, free, lost


@given(scene=scenes(max_side=14))
@settings(PLAIN)
def test_no_side_of_a_boundary_would_cost_less_than_what_is_closed(scene: Any) -> None:
    topology = hn.TopologicalMap(scene.pyramid("radius"))
    pairs = pairs_of(topology)
    for arc, own in itertools.islice(pairs.items(), 8):
        others = [pair for other, pair in pairs.items() if other != arc]
        closed = Blocked(arcs=[arc]).cells_of(topology)
        sides = [cost_of(topology, arc, others, side) for side in own.T]
        assert cost_of(topology, arc, others, closed) <= min(sides)


def test_a_cell_that_two_doors_share_is_left_open() -> None:
    # Either side of the boundary in the middle would close the door above it or the one below.
    topology = map_of(drawn("#?##", "..??", "..??", "##.#"), merge_distance_m=50.0)
    pairs = pairs_of(topology)
    (middle,) = (arc for arc, own in pairs.items() if len(own) == 2)
    assert len(pairs) == 3
    mask = mask_of(Blocked(arcs=[middle]), topology)
    assert np.argwhere(mask).tolist() == [[1, 1], [2, 2]]
    assert arcs_crossed(topology, mask).keys() == pairs.keys() - {middle}


def test_of_two_doors_the_other_one_stays_open() -> None:
    topology = rooms()
    one, other = sorted(pairs_of(topology))
    free = topology.grid.classes == CellClass.FREE
    for closed in ([one], [other]):
        label = components(free & ~mask_of(Blocked(arcs=closed), topology))
        assert label[4, 0] == label[4, 14] > 0
        assert arcs_crossed(topology, mask_of(Blocked(arcs=closed), topology)).keys() == (
            {one, other} - set(closed)
        )
    label = components(free & ~mask_of(Blocked(arcs=[one, other]), topology))
    assert label[4, 0] != label[4, 14]
    assert label[4, 0] > 0
    assert label[4, 14] > 0


def test_a_single_door_closes_the_room() -> None:
    classes = ROOMS.copy()
    classes[1, 7] = CellClass.OCCUPIED
    topology = map_of(classes, merge_distance_m=9.0, linkage="radius", seed=3)
    (door,) = pairs_of(topology)
    mask = mask_of(Blocked(arcs=[door]), topology)
    assert mask.sum() == 1
    label = components((classes == CellClass.FREE) & ~mask)
    assert label[4, 0] != label[4, 14]


def test_every_door_of_the_office_leaves_its_twin_open() -> None:
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(office_world().grid(robot_radius_m=0.25))
    )
    pairs, twins = pairs_of(topology), defaultdict(list)
    for arc in pairs:
        twins[tuple(sorted(topology.arcs[arc].tolist()))].append(arc)
    doubles = [arcs for arcs in twins.values() if len(arcs) > 1]
    assert doubles
    for arcs in doubles:
        for arc in arcs:
            closed = Blocked(arcs=[arc]).cells_of(topology)
            for other in set(arcs) - {arc}:
                assert not np.isin(pairs[other], closed).any(axis=1).all()


def test_a_corridor_is_not_cut_to_close_a_wide_opening_beside_it() -> None:
    # The corridor, unexplored so that it is a place of its own, is one cell wide.
    classes = drawn("???????????", "###.....###", "###.....###", "###########")
    topology = map_of(classes, merge_distance_m=50.0)
    (arc,) = pairs_of(topology)
    mask = mask_of(Blocked(arcs=[arc]), topology)
    assert mask.sum() == 5
    # Two choices close five cells: this one costs the fewest free cells.
    assert not mask[classes == CellClass.FREE].any()
    swapped = map_of(np.array([0, 2, 1], dtype=np.uint8)[classes], merge_distance_m=50.0)
    mask = mask_of(Blocked(arcs=[arc]), swapped)
    assert mask.sum() == 5
    assert not mask[3].any()


def test_where_corners_may_be_cut_no_diagonal_slips_past_a_closed_arc() -> None:
    # Without the cell beside it, (0, 1) to (1, 2) is a move that passes the end of the boundary.
    classes = drawn("...#???", "....???", "...#???")
    base = occupancy_grid(classes)
    grid = OccupancyGrid(base.probability, corner_cutting=True)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=50.0))
    (arc,) = pairs_of(topology)
    open_cells = {cell for cell in np.ndindex(3, 7) if classes[cell] != CellClass.OCCUPIED}
    open_cells -= {divmod(cell, 7) for cell in Blocked(arcs=[arc]).cells_of(topology).tolist()}
    field = topology.level.field_of
    for (row, col), (up, right) in itertools.product(
        open_cells, itertools.product((-1, 0, 1), (-1, 0, 1))
    ):
        if (row + up, col + right) in open_cells:
            assert field[row, col] == field[row + up, col + right]


def test_a_self_loop_is_refused() -> None:
    island = map_of(drawn(".....", ".....", "..#..", ".....", "....."), merge_distance_m=50.0)
    (loop,) = np.flatnonzero(island.level.is_self_loop).tolist()
    with pytest.raises(hn.errors.InvalidValueError, match=f"arc {loop} of level .* is a self-loop"):
        Blocked(arcs=[loop]).cells_of(island)


@pytest.mark.parametrize(
    ("blocked", "message"),
    [
        ({"arcs": [2]}, "there is no arc 2 on this map, ids are 0 to 1"),
        ({"arcs": [-1]}, "there is no arc -1"),
        ({"places": [0, 17]}, "there is no place 17 on this map, ids are 0 to 1"),
        ({"places": [2**63]}, "there is no place 9223372036854775808"),
        ({"cells": [(0, 0), (9, 3)]}, r"map of 9 x 15 cells, got \(9, 3\)"),
        ({"cells": [(0, -1)]}, r"got \(0, -1\)"),
        ({"polygons": [[(0, 0), (1e200, 0), (0, 1e200)]]}, "within 1e\\+12 cells"),
    ],
)
def test_what_the_map_does_not_have_is_refused(blocked: dict[str, Any], message: str) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match=message):
        as_blocked(blocked).cells_of(rooms())


@pytest.mark.parametrize("dtype", [np.int8, np.uint8, np.int64, np.uint64])
def test_cells_of_any_integer_type_join_other_closures(dtype: Any) -> None:
    cells = Blocked(cells=np.array([[1, 2]], dtype=dtype))
    both = cells | Blocked(arcs=[0]) | cells
    assert np.asarray(both.cells).tolist() == [[1, 2], [1, 2]]
    alone = [one.cells_of(rooms()) for one in (cells, Blocked(arcs=[0]))]
    assert both.cells_of(rooms()).tolist() == np.union1d(*alone).tolist()


def test_a_map_without_arcs_says_so() -> None:
    with pytest.raises(
        hn.errors.InvalidValueError, match="there is no arc 0 on this map, it has none"
    ):
        Blocked(arcs=[0]).cells_of(map_of(drawn("...")))


@pytest.mark.parametrize(
    ("blocked", "message"),
    [
        ({"arcs": 3}, "arcs must be a sequence of integer ids or LevelArc objects, got 3"),
        ({"arcs": [1.5]}, "arcs must be a sequence of integer ids"),
        ({"arcs": [True]}, "arcs must be"),
        ({"arcs": "12"}, "arcs must be"),
        ({"arcs": [True, 2]}, "arcs must be"),
        ({"arcs": [DOOR]}, r"arcs must be .* \(doors go under doors\), got \[Door\(number=3"),
        ({"places": [[1], [2, 3]]}, "places must be"),
        ({"places": [LevelArc(0, 1)]}, "places must be a sequence of integer ids, got"),
        ({"places": [2**70]}, "places must be"),
        ({"cells": (1, 2)}, r"cells must be integers \(row, col\) of shape \(n, 2\), got \(1, 2\)"),
        ({"cells": [(1, 2, 3)]}, "cells must be"),
        ({"cells": [(0.5, 1.0)]}, "cells must be"),
        ({"cells": [(1, 2), (3,)]}, "cells must be"),
        ({"cells": 4}, "cells must be"),
        ({"polygons": shapely.box(0, 0, 1, 1)}, "polygons must be a sequence of areas"),
        ({"polygons": 5}, "polygons must be a sequence of areas"),
        ({"polygons": [(0, 0), (1, 0), (1, 1)]}, "a geometry or points"),
        ({"polygons": ["box"]}, "a geometry or points"),
        ({"polygons": [[(0, 0), (1, 1)]]}, "at least three points.*give a LineString"),
        ({"polygons": [[(0, 0), (1, 1), (math.nan, 0)]]}, "finite"),
        ({"polygons": [shapely.LineString([(0, 0), (math.inf, 1)])]}, "finite"),
        ({"polygons": [[(0, 0), (2, 2), (2, 0), (0, 2)]]}, "simple.*Self-intersection"),
        ({"polygons": [[(0, 0), (1, 1), (2, 2)]]}, "simple"),
        ({"polygons": [shapely.LineString([(1, 1), (1, 1)])]}, "simple"),
        ({"polygons": [shapely.Polygon()]}, "needs points"),
        ({"polygons": [shapely.Point(1, 1)]}, "must be one of Polygon"),
        ({"doors": 3}, "doors must be a sequence of integer ids or Door objects, got 3"),
        ({"doors": DOOR}, "doors must be"),
        ({"doors": ["39"]}, "doors must be"),
        ({"doors": [1.0, DOOR]}, "doors must be"),
        ({"rooms": "kitchen"}, "rooms must be a sequence of names, got 'kitchen'"),
        ({"rooms": [3]}, "rooms must be a sequence of names"),
        ({"rooms": 3}, "rooms must be a sequence of names"),
        (
            {"door": [1]},
            "takes arcs, places, cells, polygons, doors, rooms, keepout, named, one_way, got door",
        ),
        ("door:39", "must be a Blocked, a Door"),
        ([1, 2], "must be a Blocked, a Door, a shapely geometry or a mapping"),
    ],
)
def test_what_cannot_be_closed_is_refused_in_one_line(blocked: Any, message: str) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match=message) as caught:
        as_blocked(blocked)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 250


def test_any_form_will_do() -> None:
    topology, door = empty_map(Frame(), (9, 15)), shapely.LineString([(2.5, 0), (2.5, 9)])
    ready = Blocked(polygons=(door,))
    assert as_blocked(ready) is ready
    expected = ready.cells_of(topology).tolist()
    assert expected == [15 * row + 2 for row in range(9)]
    assert as_blocked(door).cells_of(topology).tolist() == expected
    assert as_blocked({"polygons": [door]}).cells_of(topology).tolist() == expected


def test_nothing_is_shared_with_the_caller() -> None:
    cells = np.array([[1, 2]])
    blocked = Blocked(cells=cells)
    cells[0] = 7
    assert blocked.cells_of(empty_map(Frame(), (9, 9))).tolist() == [11]
