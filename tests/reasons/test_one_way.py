"""Proofs and reasons where sides may be crossed in one direction only."""

import base64
import itertools
import json
import math
import zlib
from fractions import Fraction

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.subjects.proofs import frame_of, is_accepted
from hybridnav import check_proof
from tests.one_way import Scene, planner_of, random_scene
from tests.oracle.one_way import OneWayPlane
from tests.reasons.test_proofs import forged
from tests.strategies import examples

# Random lines may lie between blocked cells alone.
pytestmark = pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
PRESETS = "shortest", "octile", "grid-astar", "paper", "robot"
CELLS = "octile", "grid-astar", "paper"
WARD = Scene(np.ones((4, 6), bool), np.array([(1, c, 2, c) for c in range(6)]), [])
"""A line across the map, crossed upwards."""
BELOW, ABOVE = (0.5, 0.5), (0.5, 3.5)


def plans(scene, preset):
    """Plans between the ends of a scene, with the optimum that the oracle knows."""
    planner = planner_of(scene, preset)
    one_way, plane = hn.OneWay(sides=scene.sides), scene.plane
    for (_, a), (_, b) in itertools.permutations(scene.ends, 2):
        ends = [(math.floor(p[0]), math.floor(p[1])) for p in (a, b)]
        result = planner.plan(*[tuple(map(float, p[::-1])) for p in (a, b)], one_way=one_way)
        if str(result.status) not in {"solved", "no path"}:
            continue  # an end on a side whose upper cell is blocked
        if preset in CELLS:
            yield planner, result, plane.cells_length(*ends)
        else:
            yield planner, result, float(plane.lengths([(ends[0], a)], [(ends[1], b)])[0, 0])


@pytest.mark.parametrize("preset", PRESETS)
def test_proofs_of_directed_plans_are_accepted_and_bound_the_optimum(preset):
    kinds = dict.fromkeys(("path", "no path", "dropped", "wrong"), 0)
    for seed in range(examples(80)):
        scene = random_scene(seed, n_ends=2)
        if scene is None:
            continue
        for planner, result, best in plans(scene, preset):
            grid, proof = planner.grid, json.loads(json.dumps(hn.prove(result), allow_nan=False))
            said = check_proof.check(grid.measured, frame_of(grid), proof)
            has_path = best < math.inf
            assert said.startswith("path" if has_path else "no path")
            kinds["path" if has_path else "no path"] += 1
            if has_path:
                # The costs of `robot` are at least the lengths that the oracle knows.
                assert proof["bound"] <= (result.cost if preset == "robot" else best) + 1e-9
                least = best if proof["one_way"] else 0.0  # lines between walls count for nothing
                assert min(proof["bound"], result.lower_bound) >= least * (1 - 1e-8)
                if preset != "robot":
                    assert proof["bound"] == pytest.approx(best, abs=1e-9)
            # Without directions another path, or a path at all, may be there.
            free = planner.plan(result.start, result.goal)
            is_better = has_path and free.cost < proof["bound"] - 1e-6
            if is_better or (free.solved and not has_path):
                kinds["dropped"] += 1
                assert not is_accepted(grid, {**proof, "one_way": []})
            # The path of the map without directions crosses a side the wrong way.
            if is_better:
                kinds["wrong"] += 1
                wrong = hn.prove(free) | {"one_way": proof["one_way"], "bound": 0.0}
                assert not is_accepted(grid, wrong)
    assert min(kinds["path"], kinds["no path"], kinds["dropped"]) > 0, kinds
    assert kinds["wrong"] > 0 or preset == "robot", kinds


def _forged(proof, shape, rng):
    """A proof in which one thing is another: a line, cells of the region, the path, an end."""
    forged, step = json.loads(json.dumps(proof)), rng.integers(-1, 2, 2).tolist()
    lines, kind = forged["one_way"], rng.choice(["drop", "turn", "move", "end", "body", "body"])
    if kind in {"drop", "turn", "move"} and lines:
        line = lines.pop(rng.integers(len(lines)))
        moved = line[::-1] if kind == "turn" else np.add(line, step).tolist()
        lines += [moved] * (kind != "drop")
    elif kind == "end":
        end = ("start", "goal")[rng.integers(2)]
        forged[end] = np.add(forged[end], np.divide(step, 2)).tolist()
    elif "region" in forged:
        cells = check_proof.unpacked(forged["region"], shape).copy()
        cells.ravel()[rng.integers(cells.size, size=rng.integers(1, 4))] ^= 1
        forged["region"] = base64.b85encode(zlib.compress(cells.tobytes())).decode()
    elif "path" in forged:
        (row, col), moves = forged["path"]
        k = rng.integers(len(moves) + 1)
        forged["path"] = [
            [row + step[0], col + step[1]],
            f"{moves[:k]}{rng.integers(8)}{moves[k:]}",
        ]
    else:
        k = rng.integers(len(forged["line"]))
        forged["line"][k] = np.round(np.add(forged["line"][k], step)).tolist()
    return forged


def _sides_of(lines):
    """The sides that lines bar, each from the cell on its left to the one on its right."""
    for first, last in np.array(lines).reshape(-1, 2, 2):
        ahead = np.sign(last - first)
        left = ahead[::-1] * (0.5, -0.5)
        for n in range(abs(last - first).sum()):
            middle = first + (n + 0.5) * ahead
            yield np.floor([middle + left, middle - left]).astype(np.int32).ravel()


def _is_true(proof, free):
    """Whether the oracle says what a proof states."""
    plane = OneWayPlane(free, np.array([*_sides_of(proof["one_way"])], np.int32).reshape(-1, 4))
    points = [(Fraction(y), Fraction(x)) for x, y in (proof["start"], proof["goal"])]
    ends = [((math.floor(y), math.floor(x)), (y, x)) for y, x in points]
    (rows, cols), cells = free.shape, [cell for cell, _ in ends]
    if not all(0 <= row < rows and 0 <= col < cols for row, col in cells):
        best = math.inf  # in a cell beyond the rim
    elif proof["kind"] == "line":
        best = float(plane.lengths(ends[:1], ends[1:])[0, 0])
    else:
        best = plane.cells_length(ends[0][0], ends[1][0])
    if proof["kind"] == "no path":
        return best == math.inf
    is_short = proof["costs"] is not None or proof["bound"] <= best + 1e-7
    return is_short and best <= proof["cost"] + 1e-7


@pytest.mark.parametrize("preset", ["shortest", "octile", "robot"])
def test_what_is_accepted_of_forged_proofs_is_true(preset):
    rng, counts = np.random.default_rng(64), {True: 0, False: 0}
    for seed in range(examples(80)):
        scene = random_scene(seed, n_ends=2)
        if scene is None:
            continue
        for planner, result, _ in plans(scene, preset):
            proof, grid = hn.prove(result), planner.grid
            for false in (_forged(proof, grid.shape, rng) for _ in range(4)):
                accepted = is_accepted(grid, false)
                assert not accepted or _is_true(false, scene.free), false
                counts[accepted] += 1
    assert min(counts.values()) > 10, counts


def test_no_heights_prove_a_length_that_is_too_high_past_lines():
    rng, n_forged = np.random.default_rng(64), 0
    for seed in range(examples(200)):
        scene = random_scene(seed, n_ends=2)
        if scene is None:
            continue
        for planner, result, best in plans(scene, "shortest"):
            if not 0 < best < math.inf:
                continue
            one_way = hn.OneWay(sides=scene.sides).on(planner.grid)
            proof = forged(hn.prove(result), planner.grid, rng, one_way)
            walls = np.pad(~scene.free, 1, constant_values=True)
            bars = check_proof.bars_of(walls.shape, proof)
            ends = np.array(proof["line"])[[0, -1]]
            n_forged += 1
            with pytest.raises(check_proof.Rejected, match="p rises too much"):
                check_proof.check_strings(walls, bars, proof, ends + 1, proof["bound"])
    assert n_forged > 50


@pytest.mark.parametrize("preset", PRESETS)
def test_a_line_across_the_map_leaves_no_way_back_and_that_is_proved(preset):
    planner = planner_of(WARD, preset)
    one_way, grid = hn.OneWay(sides=WARD.sides), planner.grid
    there, back = (
        planner.plan(*ends, one_way=one_way) for ends in ((BELOW, ABOVE), (ABOVE, BELOW))
    )
    assert (str(there.status), str(back.status)) == ("solved", "no path")
    for result in (there, back):
        proof = hn.prove(result)
        assert proof["one_way"] == [[[2, 6], [2, 0]]]
        assert ", 1 one-way lines" in check_proof.check(grid.measured, frame_of(grid), proof)
    upwards, none = hn.prove(there), hn.prove(back)
    turned = {"one_way": [[[2, 0], [2, 6]]]}
    assert not is_accepted(grid, upwards | turned)
    assert not is_accepted(grid, none | turned)
    for wrong in (
        [[[2, 6], [2, 1]]],  # one side may be crossed
        [[[2, 6], [2, -1]]],
        [[[2, 6], [3, 0]]],
        [[[2, 6], [2, 6]]],
        [[0.5, 1], [2, 3]],
        "2602",
    ):
        assert not is_accepted(grid, {**none, "one_way": wrong})


def test_the_checker_bars_the_moves_that_the_planner_bars():
    for seed in range(examples(200)):
        scene = random_scene(seed)
        if scene is None:
            continue
        grid = planner_of(scene, "octile").grid
        proof = {"one_way": [*_unit_lines(scene)]}
        bars = check_proof.bars_of(np.add(scene.free.shape, 2), proof)[:, 1:-1, 1:-1]
        moves = hn.OneWay(sides=scene.sides).on(grid).moves
        straight = np.stack([moves >> k & 1 == 1 for k in range(0, 8, 2)])
        assert (bars[::2] == straight).all()
        # Those off the map do not count.
        for k in range(1, 8, 2):
            assert (bars[k] >= (moves >> k & 1 == 1)).all()


def _unit_lines(scene):
    """Each side as a line between two corners of cells, with the cell `from` on its left."""
    for row, col, to_row, to_col in scene.sides.tolist():
        up, right = to_row - row, to_col - col
        first = [max(row, to_row), max(col, to_col)]
        last = [first[0] + abs(right), first[1] + abs(up)]
        yield [first, last] if right > 0 or up < 0 else [last, first]


def test_a_reason_names_the_door_that_only_leads_in():
    planner = planner_of(WARD, "shortest")
    sides = hn.OneWay(sides=WARD.sides)
    for name, kind in (("door 5", ("doors", 5)), ("the gate", ("named", "the gate"))):
        closed = hn.Blocked(one_way=hn.OneWay(named={name: sides}))
        why = hn.explain(planner, ABOVE, BELOW, blocked=closed)
        assert not why.has_path
        assert why.against == (kind,)
        assert why.parts_start
        assert why.reason == (
            f"Only {name} leads away from the start, and may be crossed only towards it."
        )
        assert why.to_dict()["against"] == [list(kind)]
        assert hn.explain(planner, BELOW, ABOVE, blocked=closed).has_path
    assert "Vom Start weg führt nur the gate" in why.words("de")[0]


def test_a_reason_names_the_fewest_things_that_part_the_ends():
    """Two lines lead away from the start, and one to the goal."""
    free = np.ones((3, 9), bool)
    parts = {
        "line 1": [(r, 3, r, 2) for r in range(2)],
        "line 2": [(2, 3, 2, 2)],
        "line 3": [(r, 7, r, 6) for r in range(3)],
    }
    one_way = hn.OneWay(named={name: hn.OneWay(sides=sides) for name, sides in parts.items()})
    planner = planner_of(Scene(free, np.empty((0, 4), int), []), "octile")
    closed = hn.Blocked(one_way=one_way)
    why = hn.explain(planner, (0.5, 1.5), (8.5, 1.5), blocked=closed)
    assert why.reason == "Only line 3 leads to the goal, and may be crossed only away from it."
    assert why.against == (("lines", 3),)
    assert not why.parts_start
    why = hn.explain(planner, (0.5, 1.5), (5.5, 1.5), blocked=closed)
    assert why.reason.startswith("Only line 1 and line 2 lead away from the start")
