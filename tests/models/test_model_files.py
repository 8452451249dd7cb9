"""Files of models: altered, cut off, foreign, crafted; and a save that is killed."""

import json
import os
import random
import struct
import subprocess
import sys
import zipfile
import zlib
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.worlds import figure1_world
from hybridnav.models import container

PRESETS = ("shortest", "octile")
START, GOAL = (0.55, 0.55), (2.55, 2.85)
HEAD = struct.Struct("<8sIIQ")


@cache
def planners() -> list[hn.HybridPlanner]:
    grid = figure1_world().grid(robot_radius_m=0.05)
    label_of = np.zeros(grid.shape, np.int32)
    rooms = hn.RoomLabels(("all",), label_of, {"dock": START})
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=1.0, rooms=rooms)
    topology = hn.TopologicalMap(pyramid)
    made = [hn.HybridPlanner(topology, preset=name) for name in PRESETS]
    for planner in made:
        planner.prepare()
    return made


@pytest.fixture(scope="module", params=[False, True], ids=["mapped", "compressed"])
def content(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> bytes:
    path = tmp_path_factory.mktemp("models") / "m.hnm"
    hn.save(planners(), path, compress=request.param)
    return path.read_bytes()


def prepared_planners(path: Path) -> list[hn.HybridPlanner]:
    model = hn.load(path)
    return [model.planner(name) for name in PRESETS]


def read_all(path: Path) -> list[float]:
    """Everything that a file holds, and what it answers."""
    model = hn.load(path)
    assert len(model.presets) == len(PRESETS)
    return [model.planner(name).plan(START, GOAL).cost for name in PRESETS]


def refusal(path: Path) -> str:
    """The line with which a file is refused."""
    with pytest.raises(hn.errors.ModelError) as raised:
        read_all(path)
    text = str(raised.value)
    assert text.isprintable()
    assert text.startswith("model ")
    assert len(text) < 500
    return text


def test_a_model_with_portals_is_to_be_built_anew(tmp_path: Path) -> None:
    path = tmp_path / "m.hnm"
    hn.save(planners(), path)
    found = [filed.read() for filed in container.read_parts(path)]
    old = container.Part("portals", 2, {}, {}, {})
    container.write_parts(path, [*found, old], compress=False)
    assert "no planner uses portals any more: build the model anew" in refusal(path)


def test_a_model_with_settings_that_are_gone_is_to_be_built_anew(content, tmp_path):
    path = tmp_path / "m.hnm"
    old = {"coarse": "jumps", "refine": "none"}
    path.write_bytes(altered(content, put("preset", "values", "planner", to=old)))
    assert "coarse is gone" in refusal(path)


def test_the_files_of_these_tests_are_sound(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "m.hnm"
    path.write_bytes(content)
    assert read_all(path) == [planner.plan(START, GOAL).cost for planner in planners()]


def in_use(content: bytes) -> np.ndarray[Any, Any]:
    """Which bytes of a file mean anything: all but the filling between arrays."""
    used = np.zeros(len(content), np.bool_)
    length = HEAD.unpack_from(content)[3]
    used[: HEAD.size + length] = True
    begin = -(-(HEAD.size + length) // 64) * 64
    for part in json.loads(content[HEAD.size : HEAD.size + length])["parts"]:
        for at in part["arrays"].values():
            used[begin + at["offset"] : begin + at["offset"] + at["size"]] = True
    return used


@pytest.mark.parametrize("seed", range(3))
def test_a_flipped_bit_anywhere_is_found(content: bytes, seed: int, tmp_path: Path) -> None:
    chance, path = random.Random(seed), tmp_path / "m.hnm"
    places = np.flatnonzero(in_use(content)).tolist()
    for _ in range(15):
        altered = bytearray(content)
        altered[chance.choice(places)] ^= 1 << chance.randrange(8)
        path.write_bytes(altered)
        refusal(path)


def test_a_file_that_was_cut_off_or_grew_is_refused(content: bytes, tmp_path: Path) -> None:
    chance, path = random.Random(0), tmp_path / "m.hnm"
    lengths = {0, 1, 7, 8, 23, 24, 25, len(content) - 64, len(content) - 1}
    for length in sorted(lengths | {chance.randrange(len(content)) for _ in range(12)}):
        path.write_bytes(content[:length])
        refusal(path)
    path.write_bytes(content + bytes(64))
    assert "expected" in refusal(path)


def altered(content: bytes, change: Callable[[dict[str, Any]], Any]) -> bytes:
    """The file with another header, whose checksum is right."""
    length = HEAD.unpack_from(content)[3]
    tree = json.loads(content[HEAD.size : HEAD.size + length])
    body = content[-(-(HEAD.size + length) // 64) * 64 :]
    result = change(tree)
    header = result if isinstance(result, bytes) else json.dumps(tree).encode()
    head = HEAD.pack(b"\x89HNM\r\n\x1a\n", container.FORMAT, zlib.crc32(header), len(header))
    return head + header + bytes(-(len(head) + len(header)) % 64) + body


def part(tree: dict[str, Any], kind: str) -> dict[str, Any]:
    found: dict[str, Any] = next(each for each in tree["parts"] if each["kind"] == kind)
    return found


def put(kind: str, *keys: str, to: Any) -> Callable[[dict[str, Any]], None]:
    def change(tree: dict[str, Any]) -> None:
        at = part(tree, kind)
        for key in keys[:-1]:
            at = at[key]
        at[keys[-1]] = to

    return change


def drop(kind: str, *keys: str) -> Callable[[dict[str, Any]], None]:
    def change(tree: dict[str, Any]) -> None:
        at = part(tree, kind)
        for key in keys[:-1]:
            at = at[key]
        del at[keys[-1]]

    return change


def lose(kind: str) -> Callable[[dict[str, Any]], None]:
    return lambda tree: tree["parts"].remove(part(tree, kind))


CRAFTED: dict[str, tuple[Callable[[dict[str, Any]], Any], str]] = {
    "no json": (lambda _: b"{", "no description"),
    "no object": (lambda _: b"[]", "no description"),
    "nan": (lambda _: b'{"hybridnav": NaN, "parts": []}', "NaN"),
    "huge number": (lambda _: b'{"hybridnav": "1", "parts": 1e999}', "no description"),
    "long integer": (lambda _: b'{"parts": ' + b"9" * 5000 + b"}", "no description"),
    "deep": (lambda _: b"[" * 100_000, "no description"),
    "no text": (lambda _: b"\xff\xfe", "no description"),
    "no grid": (lose("grid"), "0 parts grid"),
    "two pyramids": (lambda tree: tree["parts"].append(part(tree, "pyramid")), "overlaps"),
    "no jump graph": (lose("jump graph"), "bytes of arrays"),
    "no edges": (lose("corner edges"), "edges are missing"),
    "unknown part": (put("mesh", "kind", to="web"), "newer hybridnav"),
    "newer part": (put("mesh", "version", to=9), "a newer hybridnav"),
    "older part": (put("mesh", "version", to=0), "an older hybridnav"),
    "unknown key": (put("mesh", "more", to=1), "more"),
    "missing key": (drop("mesh", "sizes"), "sizes"),
    "missing array": (drop("mesh", "arrays", "twins"), "mesh"),
    "another array": (put("corner hierarchy", "kind", to="jump graph"), "2 parts"),
    "missing size": (drop("mesh", "sizes", "slots"), "its sizes are"),
    "missing value": (drop("grid", "values", "yaw_rad"), "yaw_rad"),
    "wrong value": (put("grid", "values", "resolution_m", to=-1.0), "resolution"),
    "text as value": (put("mesh", "values", "expanded", to="many"), "expanded"),
    "wrong levels": (put("pyramid", "values", "tops", to=[500, 501]), "tops"),
    "wrong preset": (put("preset", "values", "planner", to={"method": "x"}), "Input tag 'x'"),
    "wrong name": (put("rooms", "values", "names", to=["1,2"]), "point"),
    "wrong type": (put("mesh", "arrays", "kinds", "dtype", to="int8"), "kinds is int8"),
    "object type": (put("mesh", "arrays", "kinds", "dtype", to="object"), "dtype"),
    "other shape": (put("mesh", "sizes", "blocks", to=0), "block_head"),
    "negative shape": (put("mesh", "arrays", "kinds", "shape", to=[-1]), "shape"),
    "absurd shape": (put("mesh", "arrays", "kinds", "shape", to=[1 << 61]), "kinds"),
    "absurd size": (put("mesh", "sizes", "corners", to=1 << 40), "at most"),
    "absurd map": (put("grid", "sizes", "rows", to=1 << 40), "a grid holds at most"),
    "no rows": (put("grid", "sizes", "rows", to=0), "rows or cols"),
    "other map": (put("grid", "sizes", "rows", to=2), "grid"),
    "misplaced": (put("mesh", "arrays", "kinds", "offset", to=3), "overlaps"),
    "overlapping": (put("mesh", "arrays", "kinds", "offset", to=0), "overlaps"),
    "outside": (put("mesh", "arrays", "kinds", "offset", to=1 << 40), "behind the file"),
    "other frame": (put("jump graph", "values", "origin", to=[-9, 0]), "frame"),
    "other width": (put("jump graph", "values", "shape", to=[9, 0]), "frame"),
    "other height": (put("jump graph", "values", "shape", to=[2, 9]), "frame"),
}


@pytest.mark.parametrize("name", CRAFTED)
def test_a_header_that_cannot_be_is_refused(name: str, content: bytes, tmp_path: Path) -> None:
    change, words = CRAFTED[name]
    path = tmp_path / "m.hnm"
    path.write_bytes(altered(content, change))
    with pytest.raises(hn.errors.MapError) as raised:
        read_all(path)
    text = str(raised.value)
    assert text.isprintable()
    assert len(text) < 500
    assert words in text


INDICES = [
    ("pyramid", "vertex_parent"),
    ("mesh", "begins"),
    ("mesh", "twins"),
    ("mesh", "polygon_at"),
    ("mesh", "block_up"),
    ("corner edges", "heads"),
    ("corner edges", "first"),
    ("corner hierarchy", "middles"),
    ("corner hierarchy", "first"),
    ("jump graph", "index"),
    ("jump graph", "first"),
    ("rooms", "label_of"),
]


@pytest.mark.parametrize("value", [-2, 1 << 30])
@pytest.mark.parametrize(("kind", "name"), INDICES)
def test_an_index_out_of_range_is_found_though_its_checksum_is_right(kind, name, value, tmp_path):
    path = tmp_path / "m.hnm"
    hn.save(planners(), path)
    found = [filed.read() for filed in container.read_parts(path)]
    array = next(each for each in found if each.kind == kind).arrays[name]
    array.flat[array.size // 2] = value
    container.write_parts(path, found, compress=False)
    assert kind in refusal(path)


def _rolled(name: str) -> Callable[[Any], None]:
    """Give each valid index to the next place that has one."""

    def change(arrays: Any) -> None:
        valid = np.flatnonzero(arrays[name] >= 0)
        arrays[name][valid] = np.roll(arrays[name][valid], 1)

    return change


def _less_deep(arrays: Any) -> None:
    arrays["depth"][np.argmax(arrays["depth"])] -= 1


def _one_sided(arrays: Any) -> None:
    heads = arrays["heads"]
    heads[0] = heads[0] + 1 if heads[0] == 0 else heads[0] - 1


def _free_of_cost(arrays: Any) -> None:
    arrays["arcs"][0, 0] = 0


def _standing_for_itself(arrays: Any) -> None:
    """Make the first arc a shortcut that consists of itself, twice."""
    tail = int(np.flatnonzero(np.diff(arrays["first"]))[0])
    arrays["middles"][0] = tail << 32


def _going_round(arrays: Any) -> None:
    """Let two vertices go into each other."""
    gone = np.flatnonzero(arrays["vertex_parent"] >= 0)[:2]
    arrays["vertex_parent"][gone] = gone[::-1]


def _out_of_the_map(arrays: Any) -> None:
    arrays["edge_end"][-1] = 3


CONTRADICTIONS = [
    ("mesh", _rolled("twins"), "twins"),
    ("mesh", _rolled("polygon_of"), "polygon_of"),
    ("mesh", _less_deep, "depth"),
    ("corner edges", _one_sided, "no reverse"),
    ("corner hierarchy", _free_of_cost, "cost nothing"),
    ("corner hierarchy", _standing_for_itself, "the two that they stand for"),
    ("jump graph", _free_of_cost, "cost nothing"),
    ("pyramid", _going_round, "do not outlive them"),
    ("pyramid", _out_of_the_map, "out of the map"),
]
"""Values in range, on which a walk would have no end, or lead out of its arrays."""


@pytest.mark.parametrize(("kind", "change", "message"), CONTRADICTIONS)
def test_values_that_contradict_each_other_are_found_though_their_checksum_is_right(
    kind: str, change: Callable[[Any], None], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "m.hnm"
    hn.save(planners(), path)
    found = [filed.read() for filed in container.read_parts(path)]
    arrays = next(each for each in found if each.kind == kind).arrays
    arrays.update({name: array.copy() for name, array in arrays.items()})
    change(arrays)
    container.write_parts(path, found, compress=False)
    with pytest.raises(hn.errors.ModelError, match=f"{kind}: .*{message}"):
        prepared_planners(path)


def test_other_files_are_no_models(tmp_path: Path) -> None:
    path = tmp_path / "m.hnm"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("bomb", bytes(50_000_000))
    assert "no model of hybridnav" in refusal(path)
    np.save(tmp_path / "m.npy", np.arange(9))
    for foreign in (b"", b"\x80\x04\x95", b"image: a.pgm\n", (tmp_path / "m.npy").read_bytes()):
        path.write_bytes(foreign)
        assert "no model of hybridnav" in refusal(path)
    path.unlink()
    os.mkfifo(path)
    assert "no file" in refusal(path)
    path.unlink()
    path.mkdir()
    assert "no file" in refusal(path)
    path.rmdir()
    with pytest.raises(hn.errors.MapNotFoundError, match="no such file"):
        hn.load(path)


def test_a_newer_format_is_named(content: bytes, tmp_path: Path) -> None:
    path = tmp_path / "m.hnm"
    for version, age in ((container.FORMAT + 1, "newer"), (0, "older")):
        path.write_bytes(content[:8] + struct.pack("<I", version) + content[12:])
        assert age in refusal(path)


_LIMITED = """
import sys
import hybridnav as hn
from tests.memory import peak_kb
hn.load(sys.argv[1]).topology
before = peak_kb()
for path in sys.argv[2:]:
    try:
        hn.load(path).topology
    except hn.errors.MapError as error:
        print(error)
print(peak_kb() - before)
"""
"""Opens files, and prints why each is refused, and by how many kB memory grew."""
_BOMB = 80_000_000


def bomb(content: bytes, claimed: int, rows: int) -> bytes:
    """A file with an array of classes that is deflated a thousandfold."""
    length = HEAD.unpack_from(content)[3]
    begin = -(-(HEAD.size + length) // 64) * 64
    packed = zlib.compress(bytes(_BOMB), 1)

    def change(tree: dict[str, Any]) -> None:
        grid = part(tree, "grid")
        grid["sizes"]["rows"] = rows
        grid["arrays"]["classes"] |= {
            "offset": len(content) - begin,
            "size": len(packed),
            "deflated": True,
            "crc32": zlib.crc32(packed),
            "shape": [claimed, grid["sizes"]["cols"]],
        }

    return altered(content, change) + packed + bytes(-len(packed) % 64)


def test_bombs_take_no_memory(tmp_path: Path) -> None:
    sound = tmp_path / "m.hnm"
    hn.save(planners()[0].topology, sound)
    rows, cols = planners()[0].topology.grid.shape
    paths = [sound]
    for claimed, stated in ((rows, rows), (_BOMB // cols, rows), (_BOMB // cols, _BOMB // cols)):
        paths.append(tmp_path / f"{claimed}-{stated}.hnm")
        paths[-1].write_bytes(bomb(sound.read_bytes(), claimed, stated))
    done = subprocess.run(
        [sys.executable, "-c", _LIMITED, *map(str, paths)],
        capture_output=True,
        text=True,
        check=True,
    )
    *told, grown = done.stdout.splitlines()
    assert [
        words in line
        for words, line in zip(("not inflate", "expected", "--max-cells"), told, strict=True)
    ] == [True] * 3
    assert int(grown) < _BOMB / 1000 / 10


_SAVING = """
import os, pathlib, signal, sys
import hybridnav as hn
source, target, kills = sys.argv[1], pathlib.Path(sys.argv[2]), int(sys.argv[3])
model, old = hn.load(source), target.read_bytes()
calls, last = 0, 0

def counted(of):
    def call(*arguments, **options):
        global calls
        calls += 1
        if calls == last:
            os.kill(os.getpid(), signal.SIGKILL)
        return of(*arguments, **options)
    return call

class InPieces:
    def __init__(self, file):
        self.file = file
    def __enter__(self):
        return self
    def __exit__(self, *what):
        self.file.close()
    def __getattr__(self, name):
        return getattr(self.file, name)
    def write(self, content):
        for at in range(0, len(content), 1 << 10):
            counted(self.file.write)(content[at : at + (1 << 10)])
            self.file.flush()

opened = pathlib.Path.open
def open_in_pieces(path, mode="r", *rest, **options):
    file = opened(path, mode, *rest, **options)
    return InPieces(file) if "w" in mode else file
pathlib.Path.open = open_in_pieces
os.fsync, pathlib.Path.replace = counted(os.fsync), counted(pathlib.Path.replace)
hn.save(model, target)
writes, new = calls, target.read_bytes()
killed = 0
for number in range(kills):
    target.write_bytes(old)
    last = 1 + round(number * (writes - 1) / max(kills - 1, 1))
    child = os.fork()
    if not child:
        calls = 0
        hn.save(model, target)
        os._exit(0)
    killed += os.waitpid(child, 0)[1] == signal.SIGKILL
    assert target.read_bytes() == old, last
print(writes, killed, new == pathlib.Path(source).read_bytes())
"""
"""Saves a model over another one in processes that are killed before each of their writes."""


def _killed(tmp_path: Path, kills: int) -> None:
    hn.save(planners(), tmp_path / "new.hnm")
    hn.save(planners()[0].topology.grid, tmp_path / "m.hnm")
    done = subprocess.run(
        [sys.executable, "-c", _SAVING, tmp_path / "new.hnm", tmp_path / "m.hnm", str(kills)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    writes, killed, is_new = done.stdout.split()
    assert (int(killed), is_new) == (kills, "True")
    assert int(writes) >= kills / 2
    hn.load(tmp_path / "m.hnm")


def test_a_save_that_is_killed_leaves_the_old_file(tmp_path: Path) -> None:
    _killed(tmp_path, 12)


@pytest.mark.full
def test_a_save_that_is_killed_two_hundred_times_leaves_the_old_file(tmp_path: Path) -> None:
    _killed(tmp_path, 200)


@pytest.mark.full
def test_three_hundred_altered_files_are_refused(content: bytes, tmp_path: Path) -> None:
    chance, path = random.Random(7), tmp_path / "m.hnm"
    places = np.flatnonzero(in_use(content)).tolist()
    for number in range(300):
        changed = bytearray(content)
        if number % 3 == 0:
            del changed[chance.randrange(len(changed)) :]
        for _ in range(1 + number % 5):
            at = chance.choice(places)
            if at < len(changed):
                changed[at] ^= 1 << chance.randrange(8)
        if changed != content:
            path.write_bytes(changed)
            refusal(path)
