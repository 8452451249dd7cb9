"""Everything that the package answers, as digests: what a change of the house must leave as it is.

Without --write the answers are compared with `tests/product/answers.json`, line by line, and the
exit code is 1 if one differs. Parts: `plans` (28 public maps, each preset, 16 pairs), `pyramids`
(all levels), `rooms`, `files` (every export and model of the maps of the project), `commands` (the
JSON of the commands). Times are left out, and so are paths of this machine.
"""

import contextlib
import fnmatch
import hashlib
import io
import json
import re
import tempfile
from argparse import Namespace
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import shapely

import hybridnav as hn
from benchmarks.common import OFFICE, ROOT
from benchmarks.options import DATA, option
from benchmarks.subjects._study_maps import StudyMap, maps_of
from hybridnav.cli.app import run

ANSWERS = ROOT / "tests" / "product" / "answers.json"
EXPLORED = ROOT / "maps" / "office-explored" / "office-explored.yaml"
BUILDING = ROOT / "maps" / "building" / "building.yaml"
PRESETS = ("shortest", "octile", "grid-astar", "paper", "robot", "ompl-rrtconnect")
BY_SECONDS = ("ompl-bitstar", "ompl-informed-rrtstar", "ompl-rrtstar")
"""Planners that stop by a clock; they are asked for 200 rounds instead, on few maps. PRM* grows its
roadmap in threads, so that no two answers are equal."""
OF_OMPL = {
    "ompl-rrtconnect": "RRTConnect",
    "ompl-bitstar": "BITstar",
    "ompl-informed-rrtstar": "InformedRRTstar",
    "ompl-rrtstar": "RRTstar",
}
"""The planner of the preset `ompl` for each line; the lines keep the names of the first freeze."""
N_PAIRS = 16
N_CLOSED = 4
"""Of these pairs are planned again with a disc closed on the way."""
_UNSTABLE = ("seconds", "settings", "offset")

PARTS = ("plans", "pyramids", "rooms", "files", "commands")

Answers = dict[str, Any]


def digest(*parts: bytes | str) -> str:
    """Return twelve hexadecimal digits of some bytes."""
    made = hashlib.sha256()
    for part in parts:
        made.update(part.encode() if isinstance(part, str) else part)
    return made.hexdigest()[:12]


def of_array(values: Any) -> str:
    """Return a digest of an array's shape and values, whatever its type of integer."""
    array = np.asarray(values)
    array = array.astype(np.int64) if array.dtype.kind in "iub" else array
    return digest(str(array.shape), np.ascontiguousarray(array).tobytes())


def steady(value: Any) -> Any:
    """Return plain values without times."""
    if isinstance(value, dict):
        return {
            k: steady(v) for k, v in value.items() if k not in _UNSTABLE and not k.endswith("_s")
        }
    return [steady(item) for item in value] if isinstance(value, list) else value


def of_plan(result: hn.PlanResult) -> list[Any]:
    """Return status or cost of a result, and a digest of all of it."""
    text = json.dumps(steady(result.to_dict()), sort_keys=True)
    return [repr(result.cost) if result.solved else str(result.status), digest(text)]


def pairs_on(grid: hn.OccupancyGrid) -> Any:
    """Draw pairs of centres of enterable cells, float64 (16, 2, 2)."""
    free = np.argwhere(grid.enterable())
    cells = free[np.random.default_rng(38).integers(len(free), size=2 * N_PAIRS)]
    return grid.frame.points_of(cells).reshape(-1, 2, 2)


def map_answers(one: StudyMap, name: str) -> Answers:
    """Return the answers of one map: its pyramid, its rooms, all plans."""
    game = one.kind == "MovingAI"
    grid = hn.load_map(one.path, robot_radius_m=0.0 if game else 0.25)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=40.0 if game else 4.0)
    topology = hn.TopologicalMap(pyramid)
    answers: Answers = {f"pyramids {name}": levels_of(pyramid)}
    pairs = pairs_on(grid)
    few = name.endswith(("depot.yaml", "tb3_sandbox.yaml"))
    for preset in PRESETS + (BY_SECONDS if few else ()):
        over = ["planner.ompl.budget_s=100"] if preset.startswith("ompl") else []
        over += ["planner.ompl.iterations=200"] if preset in BY_SECONDS else []
        of_ompl = preset in OF_OMPL
        over += [f"planner.ompl.planner={OF_OMPL[preset]}"] if of_ompl else []
        chosen = hn.load_preset("ompl" if of_ompl else preset, overrides=over)
        planner = hn.HybridPlanner(topology, preset=chosen)
        count = N_PAIRS if not preset.startswith("ompl") else 4
        with contextlib.closing(planner):
            answers |= plans_by(planner, pairs[:count], f"plans {name} {preset}")
    if not game:
        answers[f"rooms {name}"] = rooms_of(grid)
    return answers


def plans_by(planner: hn.HybridPlanner, pairs: Any, name: str) -> Answers:
    """Return the plans of a planner: before and after `prepare`, with closures, in arrays."""
    found = [of_plan(planner.plan(*pair)) for pair in pairs[:2]]
    planner.prepare()
    results = [planner.plan(*pair) for pair in pairs]
    found += [of_plan(result) for result in results]
    answers: Answers = {name: found}
    blocked: list[Any] = []
    for pair, result in zip(pairs, results, strict=True):
        if len(blocked) < N_CLOSED and result.path is not None and len(result.path.points) > 1:
            middle = result.path.points[len(result.path.points) // 2]
            around = shapely.Point(middle[0], middle[1]).buffer(0.4, quad_segs=2)
            blocked.append(of_plan(planner.plan(*pair, blocked=around)))
    answers[f"{name} closed"] = blocked
    if "ompl" not in name:
        batch = planner.plan_many(pairs[:, 0], pairs[:, 1])
        answers[f"{name} many"] = [of_array(batch.cost), of_array(batch.lower_bound)]
    return answers


def levels_of(pyramid: hn.DualGraphPyramid) -> list[str]:
    """Return a digest of each level: the place of each cell, and the arcs."""
    found = []
    for one in pyramid:
        parts = (one.field_of, one.cells, one.arcs, one.sigma, one.protected, one.max_distance_m)
        found.append(digest(*map(of_array, parts)))
    return found


def rooms_of(grid: hn.OccupancyGrid) -> list[str]:
    """Return digests of the rooms of each cell, and of the doors."""
    labels = hn.find_rooms(grid)
    rooms = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels)).rooms
    found = rooms.doors if rooms else ()
    doors = [(d.number, d.rooms, d.width_m, d.position, d.passage_m) for d in found]
    return [of_array(labels.label_of), digest(repr(labels.names)), digest(repr(doors))]


def file_answers() -> Answers:
    """Return digests of the files that are written of the maps of the project."""
    answers: Answers = {}
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in FILES.items():
            target = Path(folder) / name
            written = [part.replace("{out}", str(target)) for part in arguments]
            _run(written if written != arguments else [*arguments, "-o", str(target)])
            answers[f"files {name}"] = digest(_lasting(target))
    return answers


def _lasting(path: Path) -> bytes:
    """Return the bytes of a file without times; of a model its header, which has a checksum of
    each array."""
    data = path.read_bytes()
    if path.suffix == ".hnm":
        begin = data.index(b'{"hybridnav"')
        header, _ = json.JSONDecoder().raw_decode(
            data[begin : begin + 10_000_000].decode("latin-1")
        )
        return json.dumps(steady(header), sort_keys=True).encode()
    return re.sub(rb'"exportTimestamp": *"[^"]*"', b"", data)


def command_answers() -> Answers:
    """Return digests of the JSON of commands."""
    answers: Answers = {}
    for name, arguments in COMMANDS.items():
        with tempfile.TemporaryDirectory() as folder:
            told = _run([part.replace("{tmp}", folder) for part in arguments]).replace(folder, "")
        printed = json.loads(told)
        text = json.dumps(steady(printed), sort_keys=True).replace(str(ROOT), "")
        answers[f"commands {name}"] = digest(text)
    return answers


def _run(arguments: list[str]) -> str:
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        code = run(arguments)
    if code:
        raise SystemExit(f"hybridnav {' '.join(arguments)} ended with {code}")
    return out.getvalue()


_OFFICE, _BUILDING = [str(OFFICE)], [str(BUILDING)]
_AB = ["--start", "1.0,13.2", "--goal", "40.6,19.4"]
_FAR = ["--start", "1:1.0,13.2", "--goal", "2:6,17.2"]
FILES = {
    "nav2.geojson": ["export", *_OFFICE],
    "nav2-lanes.geojson": ["export", *_OFFICE, "--lanes", "0.6"],
    "rmf.building.yaml": ["export", *_OFFICE, "--format", "rmf"],
    "office.osm": ["export", *_OFFICE, "--format", "osm", "--anchor", "50.1,8.6,12"],
    "office.lif.json": ["export", *_OFFICE, "--format", "lif", "--vehicle", "acme.one"],
    "rooms.geojson": ["export", *_OFFICE, "--format", "rooms"],
    "rooms.csv": ["export", *_OFFICE, "--format", "rooms"],
    "places.geojson": ["export", *_OFFICE, "--format", "places"],
    "places.csv": ["export", *_OFFICE, "--format", "places"],
    "tower.building.yaml": ["export", *_BUILDING, "--format", "rmf"],
    "tower.osm": ["export", *_BUILDING, "--format", "osm", "--anchor", "50.1,8.6"],
    "tower.lif.json": ["export", *_BUILDING, "--format", "lif", "--vehicle", "acme.one"],
    "rooms.yaml": ["rooms", *_OFFICE],
    "explored-rooms.yaml": ["rooms", str(EXPLORED)],
    "path.csv": ["plan", *_OFFICE, *_AB, "--poses", "{out}"],
    "robot.csv": ["plan", *_OFFICE, *_AB, "--preset", "robot", "--poses", "{out}"],
    "path.json": ["plan", *_OFFICE, *_AB, "--poses", "{out}"],
    "path.geojson": ["plan", *_OFFICE, *_AB, "--poses", "{out}"],
    "shortest.hnm": ["build", *_OFFICE, "--find-rooms"],
    "octile.hnm": ["build", *_OFFICE, "--preset", "octile"],
    "robot.hnm": ["build", *_OFFICE, "--preset", "robot"],
}
"""Name of each file -> the command that writes it."""
COMMANDS = {
    "plan": ["plan", *_OFFICE, *_AB, "--json"],
    "plan paper": ["plan", *_OFFICE, *_AB, "--preset", "paper", "--json"],
    "plan via": ["plan", *_OFFICE, *_AB, "--via", "6,17.2", "--language", "de", "--json"],
    "plan costs": [
        "plan",
        *_OFFICE,
        *_AB,
        "--costs",
        "clearance",
        "--preset",
        "grid-astar",
        "--json",
    ],
    "plan alternatives": ["plan", *_OFFICE, *_AB, "--alternatives", "3", "--json"],
    "plan building": ["plan", *_BUILDING, *_FAR, "--json"],
    "rooms": ["rooms", *_OFFICE, "--json"],
    "rooms all": ["rooms", *_OFFICE, "--all", "--json"],
    "export": ["export", *_OFFICE, "--report", "50", "-o", "{tmp}/a.geojson", "--json"],
}
"""Name of each question -> the command that answers it."""


def _of_map(one: StudyMap, data: Path) -> Answers:
    return map_answers(one, one.path.relative_to(data).as_posix())


def all_answers(data: Path | None, glob: str, parts: list[str], workers: int) -> Answers:
    """Return the answers of all parts."""
    answers: Answers = {}
    own: dict[str, Callable[[], Answers]] = {"files": file_answers, "commands": command_answers}
    for name, part in own.items():
        if name in parts:
            answers |= part()
    if data is not None and not set(parts).isdisjoint({"plans", "pyramids", "rooms"}):
        maps = [one for one in maps_of(data) if fnmatch.fnmatch(one.path.as_posix(), f"*{glob}*")]
        with ProcessPoolExecutor(workers) as pool:
            for found in pool.map(_of_map, maps, [data] * len(maps)):
                answers |= found
    return answers


def differences(answers: Answers, expected: Answers) -> Iterator[str]:
    """Yield a line for each answer that differs."""
    for name, found in answers.items():
        if name not in expected:
            yield f"new: {name}"
        elif found != expected[name]:
            yield f"differs: {name}\n  was {expected[name]}\n  is  {found}"


OPTIONS = [
    DATA,
    option("--map", default="", help="part of a map's path"),
    option("--part", action="append", choices=PARTS),
    option("--workers", type=int, default=2),
    option("--write", action="store_true"),
]


def main(given: Namespace) -> int:
    """Run from the command line."""
    answers = all_answers(given.data, given.map, given.part or list(PARTS), given.workers)
    expected = json.loads(ANSWERS.read_text()) if ANSWERS.exists() else {}
    if given.write:
        merged = dict(sorted((expected | answers).items()))
        lines = [f"{json.dumps(name)}: {json.dumps(found)}" for name, found in merged.items()]
        ANSWERS.write_text("{\n" + ",\n".join(lines) + "\n}\n")
        print(f"{len(answers)} answers written")
        return 0
    lines = list(differences(answers, expected))
    print(*lines, f"{len(answers)} answers, {len(lines)} differ", sep="\n")
    return 1 if lines else 0
