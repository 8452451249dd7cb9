"""Proofs of results: the checker accepts the true ones, and none that was altered."""

import base64
import io
import json
import math
import pickle
import re
import subprocess
import sys
import zlib

import numpy as np
import pytest
from PIL import Image
from scipy import ndimage

import hybridnav as hn
from benchmarks.subjects.proofs import false_proofs, frame_of, is_accepted
from hybridnav import check_proof
from hybridnav.errors import HybridNavError, PlanError
from hybridnav.maps.files.ros import occupancy_of_greys
from hybridnav.search.proofs import parting_chain, strings_near
from tests.oracle.any_angle_cost import SidePoints
from tests.plans import grid_of, map_of, points_in
from tests.strategies import examples, occupancy_grid

PRESETS = ("shortest", "octile", "grid-astar", "grid-astar by costs", "robot")


def random_grid(rng, shape=(24, 30), radius_m=0.0):
    smooth = ndimage.uniform_filter(rng.random(shape), int(rng.integers(1, 4)))
    classes = np.where(smooth < np.quantile(smooth, rng.uniform(0.1, 0.4)), 0, 1)
    classes[rng.random(shape) < 0.03] = 2
    probability = np.where(classes == 2, 0.5, classes == 0).astype(np.float32)
    frame = hn.Frame(0.05, origin_m=(3.1, -20.4), yaw_rad=0.7)
    return hn.OccupancyGrid(probability, frame, robot_radius_m=radius_m)


def planner_of(grid, preset):
    costs = hn.CostLayer.clearance(grid, inflation_radius_m=0.3) if "costs" in preset else None
    return hn.HybridPlanner(map_of(grid), preset=preset.split()[0], costs=costs)


@pytest.mark.parametrize("preset", PRESETS)
def test_true_proofs_are_accepted_and_altered_ones_are_not(preset):
    rng = np.random.default_rng(PRESETS.index(preset))
    kinds: dict[str, int] = {}
    for n in range(examples(24, 112)):  # in full 10,000 false proofs
        grid = random_grid(rng, radius_m=0.05 * (n % 3))
        planner = planner_of(grid, preset)
        for pair in points_in(grid, rng, 3):
            if n % 4 < 2:  # half of the ends are centres, as in the harness
                pair = grid.frame.points_of(grid.frame.cells_of(pair))  # noqa: PLW2901
            shut = np.argwhere(grid.enterable())[:: max(n, 1) * 7]
            at = grid.frame.cells_of(pair)
            shut = shut[~(shut[:, None] == at).all(axis=2).any(axis=1)]
            result = planner.plan(*pair, blocked={"cells": shut} if n % 2 else None)
            proof = json.loads(json.dumps(hn.prove(result), allow_nan=False))
            said = check_proof.check(grid.measured, frame_of(grid), proof)
            assert said.startswith("path" if result.solved else "no path")
            if result.solved and preset != "robot":
                assert proof["bound"] == result.lower_bound
                assert proof["bound"] == pytest.approx(proof["cost"], rel=1e-9)
                assert len(set(re.findall(r"\d+\.\d{6}(?= m)", said))) == 1  # the cost is the bound
            elif result.solved:
                assert proof["bound"] <= min(proof["cost"], result.cost)
                told = float(re.findall(r"none less than (\S+) m", said)[0])
                assert told <= proof["bound"] < told + 1.000001e-6
            for kind, false, measured in false_proofs(grid, result, proof, rng):
                kinds[kind] = kinds.get(kind, 0) + 1
                assert not is_accepted(grid, false, measured), (kind, false)
    planted = {"radius", "map", "cost", "bound", "corner", "closure", "wall on the path"}
    print(sum(kinds.values()), "false proofs")  # noqa: T201 - for `pytest -s`
    assert planted | ({"forged bound"} if preset != "robot" else set()) <= kinds.keys()


@pytest.mark.parametrize("preset", PRESETS)
def test_ends_on_the_corners_of_cells_beside_walls_are_proved(preset):
    """Round numbers of metres are a rounding error off the sides of cells, on either side."""
    rng = np.random.default_rng(7)
    below = 0
    for _ in range(examples(6)):
        turned = random_grid(rng)
        grid = hn.OccupancyGrid(turned.probability, hn.Frame(0.05), robot_radius_m=0)
        free = grid.enterable()
        cells = np.argwhere(free)
        planner = planner_of(grid, preset)
        for pair in rng.choice(len(cells), (8, 2)):
            ends = np.round(cells[pair][:, ::-1] * 0.05, 2)
            below += int((grid.frame.positions_of(ends) < cells[pair]).any())
            proof = hn.prove(planner.plan(*ends))
            assert check_proof.check(grid.measured, frame_of(grid), proof)
            assert proof.get("bound", 0) <= proof.get("cost", 0)
    assert below


@pytest.mark.parametrize("preset", PRESETS)
def test_a_bound_above_the_cost_is_no_proof(preset):
    grid = hn.OccupancyGrid(np.zeros((9, 9), np.float32), hn.Frame(0.5), robot_radius_m=0)
    result = planner_of(grid, preset).plan((0.75, 0.75), (3.25, 2.25))
    assert hn.prove(result)["bound"] <= result.cost
    vars(result)["lower_bound"] = 2 * result.cost
    if preset == "robot":  # its proof finds a bound of its own
        assert hn.prove(result)["bound"] <= result.cost
    else:
        with pytest.raises(PlanError, match="a proof has the bound"):
            hn.prove(result)
        # Two numbers of which one is above the other by a hair read so.
        vars(result)["lower_bound"] = result.cost * (1 + 1e-8)
        with pytest.raises(PlanError) as error:
            hn.prove(result)
        bound, cost = map(float, re.findall(r"([0-9.]+) m[,:]", str(error.value)))
        assert bound > cost


@pytest.mark.parametrize("preset", PRESETS)
def test_an_end_between_two_walls_that_meet_lies_in_the_cell_beyond(preset):
    """It touches another one, out of which there is a shorter path, or one at all."""
    free = np.ones((6, 6), bool)
    free[3, [1, 3]] = free[2, 4] = False  # the start is the corner of two of them
    cut_off = free.copy()
    cut_off[[3, 4], [5, 4]] = False
    short = {"kind": "line", "line": [[3.0, 4.0], [1.0, 2.0]], "bound": 2.0, "heights": []}
    for each in free, cut_off:
        planner = planner_of(occupancy_grid(each.astype(np.uint8)), preset)
        result = planner.plan((4.0, 3.0), (2.0, 1.0))
        proof = hn.prove(result)
        assert result.solved == (each is free)
        assert is_accepted(planner.grid, proof)
        assert not is_accepted(planner.grid, proof | short | {"cost": math.sqrt(8), "costs": None})
        if preset == "shortest":
            assert proof.get("bound", math.inf) == pytest.approx(result.cost, abs=1e-12)


def forged(proof, grid, rng, one_way=None):
    """Return a proof of a bound that is too high, with a longer path and other heights."""
    more = float(rng.choice([1e-6, 1e-3, 0.1, 1.0]))
    line = np.array(proof["line"])
    start, last, goal = line[0], line[-2], line[-1]
    length = np.hypot(*(goal - last))
    back = goal - (goal - last) / length * min(more / 2, length)
    bend = [] if len(line) > 2 else [((start + goal) / 2).tolist()]
    longer = [*proof["line"][:-1], *bend, goal.tolist(), back.tolist(), goal.tolist()]
    bound = proof["bound"] / grid.resolution_m + more
    reach = bound * float(rng.choice([1, 1, 1.2]))
    ends = np.array([start, goal])
    heights, _ = strings_near(grid.enterable(), ends, reach, one_way)
    for _ in range(int(rng.integers(4))):
        if heights:
            n = int(rng.integers(len(heights)))
            kind = int(rng.integers(6))
            if kind == 0:
                del heights[n]
            elif kind == 1:
                heights[n][int(rng.integers(2))] += int(rng.choice([-1, 1]))
            elif kind == 2:
                heights[n][-1] += float(rng.choice([more, -more, 1e9, -1e9, np.nan]))
            elif kind == 3:
                heights = heights[:n]
            elif kind == 4:
                heights.append([*heights[n][:-1], heights[n][-1] + more])
            else:
                share = float(rng.choice([1 + more / bound, bound]))
                heights = [[*at[:2], *(share * p for p in at[2:])] for at in heights]
    metres = bound * grid.resolution_m
    return {**proof, "line": longer, "heights": heights, "bound": metres, "cost": metres}


@pytest.mark.parametrize("seed", range(examples(6, 120)))
def test_no_heights_prove_a_length_that_is_too_high(seed):
    rng = np.random.default_rng(seed)
    count = 0
    while count < 60:
        shape = tuple(rng.integers(8, 30, 2).tolist())
        grid = random_grid(rng, shape)
        planner = hn.HybridPlanner(map_of(grid))
        for pair in points_in(grid, rng, 4):
            if rng.random() < 0.5:  # centres of cells
                pair = grid.frame.points_of(grid.frame.cells_of(pair))  # noqa: PLW2901
            result = planner.plan(*pair)
            if not result.solved or result.cost == 0:
                continue
            proof = hn.prove(result)
            assert is_accepted(grid, proof)
            for _ in range(12):
                count += 1
                assert not is_accepted(grid, forged(proof, grid, rng))


SLITS = ["....", "..#.", ".#..", "...."]


@pytest.mark.parametrize(
    "line",
    [
        [[1.5, 1.5], [2.5, 2.5]],  # between two walls that meet at a corner
        [[1.5, 1.5], [2, 2], [2.5, 2.5]],
        [[1.5, 1.5], [2 - 1e-9, 2 - 1e-9], [2 + 1e-9, 2 + 1e-9], [2.5, 2.5]],
        [[1.5, 1.5], [2, 2 + 1e-7], [2.5, 2.5]],
        [[1.5, 1.5], [1.5, 2.5]],  # through a wall
        [[1.5, 1.5], [1.5, 1.999999], *([1.5, 2 + n * 4e-6] for n in range(250_000)), [1.5, 3.5]],
        [[1.5, 1.5], [1.5, 1e9], [2.5, 2.5]],  # more cells than memory has
        [[1.5, 1.5], [1.5, np.nan], [2.5, 2.5]],
        [[1.5, 1.5], [-5.0, 1.5], [-5.0, 5.0], [2.5, 2.5]],
    ],
)
def test_no_line_slips_through_a_wall(line):
    kinds = np.array([[cell == "." for cell in row] for row in SLITS], np.uint8)
    grid = grid_of(kinds)
    ends = grid.frame.points_of([[1, 1], [2, 2]])
    proof = hn.prove(hn.HybridPlanner(map_of(grid)).plan(*ends))
    assert is_accepted(grid, proof)
    assert proof["line"][0] == pytest.approx([1.5, 1.5])
    length = float(np.hypot(*np.diff(np.array(line), axis=0).T).sum()) * grid.resolution_m
    false = {**proof, "line": line, "cost": length, "bound": 0.0}
    with np.errstate(all="ignore"):
        assert not is_accepted(grid, false)


def test_a_chain_parts_an_island_from_the_rest_and_both_ways_round():
    free = np.zeros((9, 9), bool)
    free[1:8, 1:8] = True
    free[2:7, 2:7] = False
    free[4, 4] = True
    for ends in (((4, 4), (1, 1)), ((1, 1), (4, 4))):
        chain = parting_chain(free, *ends)
        assert chain is not None
        assert (chain[0] == chain[-1]).all()
        assert (np.abs(np.diff(chain, axis=0)).max(axis=1) == 1).all()
        assert not np.pad(free, 1)[tuple((chain + 1).T)].any()
    assert parting_chain(free, (1, 1), (7, 7)) is None


@pytest.mark.parametrize("name", ["office", "figure1"])
def test_the_checker_reads_a_map_as_the_package_does(name, tmp_path):
    grid = hn.example_map(name)
    hn.write_ros_map(grid, tmp_path / "m.yaml")
    thresholds = [grid.free_threshold, grid.occupied_threshold]
    cells, frame = check_proof.read_map(tmp_path / "m.yaml", thresholds)
    assert (cells == grid.measured).all()
    assert frame == frame_of(grid)
    hn.write_movingai_map(grid, tmp_path / "m.map")
    cells, frame = check_proof.read_map(tmp_path / "m.map", thresholds)
    again = hn.load_map(tmp_path / "m.map")
    assert (cells == again.measured).all()
    assert frame == frame_of(again)


@pytest.mark.parametrize("negate", ["0", "1"])
@pytest.mark.parametrize("kind", ["P5 # kept\n4 2\n255\n", "P2\n4 2\n255\n"])
def test_the_checker_reads_other_images_too(kind, negate, tmp_path):
    values = [0, 60, 100, 160, 200, 199, 150, 20]
    body = bytes(values) if "P5" in kind else " ".join(map(str, values)).encode()
    (tmp_path / "m.pgm").write_bytes(kind.encode() + body)
    (tmp_path / "m.yaml").write_text(
        "image: 'm.pgm'  # a map\nresolution: 5e-2\norigin:\n- -1.5\n- 2\n- 0.25\n"
        f"negate: {negate}\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    grid = hn.load_map(tmp_path / "m.yaml")
    cells, frame = check_proof.read_map(tmp_path / "m.yaml", [0.25, 0.65])
    assert (cells == grid.measured).all()
    assert frame == frame_of(grid)


GREYS = np.arange(256, dtype=np.uint8).reshape(8, 32)
COLOURS = np.stack([GREYS, GREYS[::-1], GREYS.T.reshape(8, 32), 255 - GREYS], axis=-1)
DEEP = np.arange(256, dtype=np.uint16).reshape(8, 32) * 257 - 1
TEXT = " ".join(map(str, GREYS.ravel().tolist())).encode()


def saved(values, file_format="PNG"):
    stream = io.BytesIO()
    Image.fromarray(values).save(stream, file_format)
    return stream.getvalue()


IMAGES = {
    "P5": (b"P5\r\n# a\r\n 32 #b\n8\n255\n" + GREYS.tobytes(), True),
    "P5 and more": (b"P5 32 8 255 " + GREYS.tobytes() + b"more", True),
    "comment that CR ends": (b"P5 #1 2\r32 8 #\n255 " + GREYS.tobytes(), True),
    "comment in a number": (b"P5 3#\n2 8 255 " + GREYS.tobytes(), False),
    "P2": (b"P2 32 8 255\n" + TEXT, True),
    "P2 with a comment": (b"P2 32 8 255\n" + TEXT.replace(b"\x20", b" #1\n", 1), False),
    "P2 below 0": (b"P2 32 8 255 -9" + TEXT[1:], False),
    "P2 above 255": (b"P2 32 8 255 256" + TEXT[1:], False),
    "P2, 16 bits": (b"P2 32 8 65535 " + TEXT, False),
    "P5, 16 bits": (b"P5 32 8 65535 " + DEEP.astype(">u2").tobytes(), False),
    "P5, 7 bits": (b"P5 32 8 127 " + (GREYS // 2).tobytes(), False),
    "P5 cut off": (b"P5 32 8 255 " + GREYS.tobytes()[1:], False),
    "P4": (b"P4 32 8 " + GREYS.tobytes()[:32], False),
    "P6": (b"P6 32 8 255 " + COLOURS[..., :3].tobytes(), False),
    "grey": (saved(GREYS), False),
    "grey, 16 bits": (saved(DEEP), False),
    "grey and opacity": (saved(COLOURS[..., [0, 3]].copy()), False),
    "colours": (saved(COLOURS[..., :3].copy()), False),
    "colours and opacity": (saved(COLOURS), False),
    "TIFF": (saved(GREYS, "TIFF"), False),
    "BMP": (saved(GREYS, "BMP"), False),
}
"""Images of 256 cells, and whether the checker reads them."""
EDGES = [float(p) for p in occupancy_of_greys()[[0, 50, 100, 205, 206, 254, 255]]]
THRESHOLDS = [(0.196, 0.65), (0.25, 0.25), (0.0, 1.0), (0.0, 0.0), (1.0, 1.0)]
THRESHOLDS += [(low, high) for low in EDGES for high in EDGES if low <= high]


@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
@pytest.mark.parametrize("kind", IMAGES)
def test_the_checker_reads_an_image_as_the_package_does_or_not_at_all(kind, tmp_path):
    image, is_read = IMAGES[kind]
    (tmp_path / "m.pgm").write_bytes(image)
    head = "image: m.pgm\nresolution: 0.05\norigin: [1, 2, 0.5]\n"
    modes = {"": True, "trinary": True, "Scale": True, "raw": False, "other": False}
    for mode, is_known in modes.items():
        for negate in "01":
            for low, high in THRESHOLDS if is_read and is_known else THRESHOLDS[:1]:
                text = f"{head}negate: {negate}\nfree_thresh: {low}\noccupied_thresh: {high}\n"
                text += f"mode: {mode}\n" * bool(mode)
                ours, theirs = read_by_both(tmp_path, text, [low, high])
                assert (theirs is not None) == (is_read and is_known)
                assert theirs is None or ours == theirs, text


LINES = {
    "image": [
        "image: m.pgm",
        "image: 'it''s m.pgm' # origin: [9, 9, 9]",
        '"image": "a, b.pgm"',
        "image: original.pgm",
        "image: a#b.pgm",
    ],
    "resolution": ["resolution: 5e-2", "'resolution': .5", "resolution: '0.1'", "resolution: 3"],
    "origin": [
        "origin: [-1.5, +2, 0.3,]",
        "origin:\n- 1\n- 2. # y\n\n# yaw\n- -5e-1",
        "origin:\n  - 1\n  - 2\n  - 3",
    ],
    "negate": ["negate: 0", "negate: True", "negate: 'off'"],
    "more": ["", "mode: Scale", "extra:\n  resolution: 7\n  origin: [9, 9, 9]", "# origin: 3"],
    "thresholds": ["occupied_thresh: 0.65\nfree_thresh: 0.25"],
}
"""Lines of YAML that the checker promises to read."""


def read_by_both(folder, text, thresholds=(0.25, 0.65)):
    """Return what the package and the checker read of a file, None where they refuse it.

    The checker is told the thresholds that the package read, as a proof states them; these if it
    read none.
    """
    (folder / "m.yaml").write_text(text)
    answers: list[object] = []
    try:
        grid = hn.load_map(folder / "m.yaml")
        answers.append((grid.measured.tolist(), frame_of(grid)))
        thresholds = grid.free_threshold, grid.occupied_threshold
    except HybridNavError:
        answers.append(None)
    try:
        cells, frame = check_proof.read_map(folder / "m.yaml", thresholds)
        answers.append((cells.tolist(), frame))
    except (ValueError, OSError, IndexError):
        answers.append(None)
    return answers


def test_the_checker_reads_the_yaml_that_it_states_or_says_that_it_does_not(tmp_path):
    rng = np.random.default_rng(5)
    for name in ("m.pgm", "it's m.pgm", "a, b.pgm", "original.pgm", "a#b.pgm"):
        (tmp_path / name).write_bytes(b"P5 2 2 255 " + bytes(rng.integers(256, size=4).tolist()))
    count = 0
    for _ in range(examples(400, 5000)):
        lines = [rng.choice(lines) for lines in LINES.values()]
        text = "\n".join(rng.permutation(lines)) + "\n"
        ours, theirs = read_by_both(tmp_path, text)
        assert ours is not None, text
        assert ours == theirs, text
        at, mark = int(rng.integers(len(text))), rng.choice(list("   01\n\n##:'\"-[],.e\t{&|>"))
        ours, theirs = read_by_both(tmp_path, text[:at] + mark + text[at + rng.integers(2) :])
        assert None in (ours, theirs) or ours == theirs, (text, at, mark)
        count += ours is not None and theirs is not None
    assert count > 5


@pytest.mark.parametrize(
    "line",
    ["note: |\n  x", "note: 'x\nresolution: 3'", "{a: b}", "origin: [1,\n 2, 3]", "image: m.pgm"],
)
def test_yaml_of_another_form_is_not_read_in_one_line(line):
    with pytest.raises(ValueError, match=r"expected KEY: VALUE|given twice"):
        check_proof.read_yaml(f"image: m.pgm\n{line}\n")


def run_script(*arguments):
    command = [sys.executable, check_proof.__file__, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert not done.stderr
    assert done.stdout.count("\n") == 1
    return done.returncode, done.stdout


def test_the_script_says_of_every_file_what_it_makes_of_it(tmp_path):
    grid = hn.OccupancyGrid(np.zeros((4, 5), np.float32), hn.Frame(0.5), robot_radius_m=0)
    hn.write_ros_map(grid, file := tmp_path / "original.yaml")
    proof = hn.prove(hn.HybridPlanner(map_of(grid)).plan((0.1, 0.1), (2.1, 1.1)))
    good, other = tmp_path / "proof.json", tmp_path / "other.json"
    good.write_text(json.dumps(proof))
    code, said = run_script(file, good)
    assert (code, said[:22]) == (0, "accepted: path from [0")
    other.write_text(json.dumps({**proof, "cost": 9}))
    assert run_script(file, other)[0] == 1
    for text in ("", "[]", "3", "{}", '{"thresholds": 3}', "[" * 100_000):
        other.write_text(text)
        assert run_script(file, other)[0] == 2
    (tmp_path / "bad.yaml").write_text("image: none.pgm\n")
    (tmp_path / "bad.pgm").write_bytes(b"P5 4 4 255 ...")
    (tmp_path / "bad.map").write_text("type octile\nmap\n..\n...\n")
    (tmp_path / "cut.yaml").write_text(file.read_text().replace("original.pgm", "bad.pgm"))
    (tmp_path / "gone.yaml").write_text(file.read_text().replace("original.pgm", "gone.pgm"))
    for name in ("bad.yaml", "cut.yaml", "gone.yaml", "bad.map", "none.yaml", "proof.json", "."):
        code, said = run_script(tmp_path / name, good)
        assert (code, said[:9]) == (2, "not read:"), said
        assert name in said
    assert run_script(file)[0] == 2


@pytest.mark.parametrize("preset", ["shortest", "octile"])
def test_proofs_of_ends_on_the_edge_of_a_turned_map_are_accepted(preset):
    rng = np.random.default_rng(3)
    count = 0
    for n in range(30):
        blocked = (rng.random((8, 9)) < 0.15).astype(np.float32)
        blocked[0], blocked[:, 0] = 0, 0
        frame = hn.Frame(0.05, origin_m=(3.1 + n, -20.4), yaw_rad=0.3)
        grid = hn.OccupancyGrid(blocked, frame, robot_radius_m=0)
        ends = frame.points_of_grid([(int(rng.integers(8)), 0), (0, int(rng.integers(1, 9)))])
        result = hn.HybridPlanner(map_of(grid), preset=preset).plan(*ends)
        if result.solved:  # else rounding laid an end outside of the map
            count += 1
            assert is_accepted(grid, json.loads(json.dumps(hn.prove(result))))
    assert count > 15


def test_no_proof_is_made_of_what_has_none():
    grid = grid_of(np.ones((5, 5), int), corner_cutting=True)
    pair = grid.frame.points_of([[0, 0], [4, 4]])
    with pytest.raises(PlanError, match="corners may be cut"):
        hn.prove(hn.HybridPlanner(map_of(grid), preset="octile").plan(*pair))
    grid = grid_of(np.ones((5, 5), int))
    planner = hn.HybridPlanner(map_of(grid))
    with pytest.raises(PlanError, match="no proof is known of 'start outside the map'"):
        hn.prove(planner.plan((0, 0), pair[1]))
    copied = pickle.loads(pickle.dumps(planner.plan(*pair)))  # noqa: S301 - our own
    with pytest.raises(PlanError, match="copies of a result have no proof"):
        hn.prove(copied)
    layer = hn.CostLayer(np.full((5, 5), 2.0))
    with pytest.raises(PlanError, match="costs of the kind 'array'"):
        hn.prove(hn.HybridPlanner(map_of(grid), preset="grid-astar", costs=layer).plan(*pair))


@pytest.mark.parametrize(
    ("key", "value", "why"),
    [
        ("radius_m", 1e9, "a radius of too many cells"),
        ("radius_m", float("nan"), "or none"),
        ("radius_m", -0.1, "or none"),
        ("costs", {"multiplier": -1}, "a factor is not from 1 to 1000"),
        ("costs", {"multiplier": float("nan")}, "a factor is not from 1 to 1000"),
        ("costs", {"inflation_radius_m": 1e9}, "costs that reach too far"),
        ("bound", float("nan"), "above the cost"),
        ("bound", 1e300, "above the cost"),
        ("bound", -1.0, "above the cost"),
        ("cost", float("nan"), "the path costs"),
        ("kind", "line of sight", "another kind"),
        ("goal", [1e9, 1e9], "ends outside"),
        ("goal", [2.0], "this is no proof"),
        ("start", [float("nan"), 0.5], "ends outside"),
        ("box", [0, 0, 10**9, 10**9], "this is no proof"),
        ("box", [-1, 0, 3, 3], "."),
        ("tree", "", "this is no proof"),
        ("path", [[0, 0], "89"], "this is no proof"),
        ("path", [[0, 0], "0" * 10**6], "leaves the map"),
        ("path", [[0, 0], "04" * 10**6], "other ends|not start|too many"),
        ("tree", base64.b85encode(zlib.compress(bytes(10**8))).decode(), "this is no proof"),
        ("closed", [[0, 10**12]], "a closed cell is outside the map"),
        ("closed", [[0, 5], [0, 5]], "closed twice"),
    ],
)
def test_hostile_values_are_rejected(key, value, why):
    grid = hn.example_map("figure1")
    planner = hn.HybridPlanner(
        map_of(grid), preset="grid-astar", costs=hn.CostLayer.clearance(grid)
    )
    proof = hn.prove(planner.plan((0.5, 0.5), (2.0, 2.5)))
    said = check_proof.check(grid.measured, frame_of(grid), {**proof, "allow_unexplored": 1})
    assert "unexplored" not in said  # as only `true` lets paths through them
    value = proof["costs"] | value if key == "costs" else value
    with np.errstate(all="ignore"), pytest.raises(check_proof.Rejected, match=why):
        check_proof.check(grid.measured, frame_of(grid), {**proof, key: value})


@pytest.mark.parametrize("text", ["{}", "[]", "3", '{"kind": "cells"}', "null"])
def test_any_other_json_is_rejected_in_one_line(text):
    grid = hn.example_map("figure1")
    with pytest.raises(check_proof.Rejected, match="this is no proof"):
        check_proof.check(grid.measured, frame_of(grid), json.loads(text))


def test_the_proof_of_robot_is_as_good_as_its_bound():
    grid = hn.example_map("office", robot_radius_m=0.25)
    result = hn.HybridPlanner(map_of(grid), preset="robot").plan((1.0, 13.2), (40.6, 19.4))
    proof = hn.prove(result)
    assert is_accepted(grid, proof)
    assert proof["bound"] >= result.lower_bound > 48


def test_no_bound_of_a_line_by_costs_is_above_the_cheapest_path_by_brute_force():
    rng = np.random.default_rng(3)
    gaps = []
    for _ in range(12):
        grid = random_grid(rng, (9, 10))
        planner = planner_of(grid, "robot")
        oracle = SidePoints(grid.enterable(), planner.costs.factors)
        for pair in points_in(grid, rng, 3):
            result = planner.plan(*pair)
            if not result.solved:
                continue
            start, goal = map(tuple, grid.frame.positions_of(pair).tolist())
            cheapest = oracle.cost(start, goal) * grid.resolution_m
            gaps.append(cheapest / hn.prove(result)["bound"] - 1)
    assert len(gaps) > 10
    assert min(gaps) > -1e-6
    assert np.median(gaps) < 0.4  # factors of 1 to 3 side by side, and ends that are no corners
