"""The package from outside: as a program of its own, as an installation, as a wheel."""

import io
import json
import os
import resource
import shutil
import struct
import subprocess
import sys
import zipfile
import zlib
from importlib.metadata import distribution
from pathlib import Path

import pytest
import yaml
from PIL import Image

import hybridnav as hn
from hybridnav.cli import main

ROOT = Path(__file__).parents[2]
FIGURE = ROOT / "maps" / "figure1" / "figure1.yaml"
PLANNERS = sorted(path.name for path in (ROOT / "planners").glob("*.yaml"))
KEYS = "resolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
SHOW = ("-m", "hybridnav", "show")


def _python(*arguments, **options):
    """Run Python on these arguments; text in and out, two minutes at most."""
    command = [sys.executable, *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE} | options
    return subprocess.run(command, encoding="utf-8", timeout=120, check=False, **pipes)


# --- the program --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("endpoints", "code"),
    [(("0.5,1.5", "3.5,1.5"), 0), (("-0.5,1.5", "3.5,1.5"), 1), (("one,two", "3.5,1.5"), 2)],
)
def test_exit_codes_of_the_program(endpoints, code):
    start, goal = endpoints
    settings = ("--robot-radius", 0, "--set", "planner.allow_unexplored=true", "--json")
    done = _python("-m", "hybridnav", "plan", FIGURE, "--start", start, "--goal", goal, *settings)
    assert done.returncode == code
    if code == 2:
        assert done.stderr.count("\n") == 1
        return
    assert done.stderr == ""
    length_m = json.loads(done.stdout)["length_m"]
    assert length_m is None if code else 3 <= length_m < 3.5


SLOW = {"PIL", "matplotlib", "networkx", "numba", "numpy", "ompl", "scipy", "shapely", "yaml"}
"""What help and wrong usage can do without, and would wait for."""
CHECKED = {"pydantic"}
"""What Typer itself loads to check the options of a command."""


@pytest.mark.parametrize(
    ("arguments", "code", "unused"),
    [
        ((), 2, SLOW | CHECKED),
        (("--help",), 0, SLOW | CHECKED),
        (("--version",), 0, SLOW | CHECKED),
        (("plon",), 2, SLOW | CHECKED),
        (("plan", "--help"), 0, SLOW),
        (("build", "--help"), 0, SLOW),
        (("show", "--help"), 0, SLOW),
        (("rooms", "--help"), 0, SLOW),
        (("evaluate", "--help"), 0, SLOW),
        (("compare", "--help"), 0, SLOW),
        (("preset", "--help"), 0, SLOW),
        (("preset", "check", "--help"), 0, SLOW),
        (("plan", "map.yaml", "--start", "here"), 2, SLOW),
        (("preset", "list"), 0, SLOW - {"yaml"}),
    ],
)
def test_a_command_loads_nothing_that_it_does_not_use(arguments, code, unused):
    script = (
        "import sys\nfrom hybridnav.cli import main\n"
        "try:\n    main()\nfinally:\n"
        f"    loaded = {unused} & sys.modules.keys()\n"
        "    assert not loaded, loaded\n"
    )
    done = _python("-c", script, *arguments)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("preset", "others"),
    [
        ("shortest", {"hybridnav.search.octile.jumps", "hybridnav.search.lattice.lattice"}),
        ("octile", {"hybridnav.search.lattice.lattice", "hybridnav.refine.motions"}),
    ],
)
def test_a_plan_loads_nothing_of_other_presets(preset, others):
    office = ROOT / "maps" / "office" / "office.yaml"
    unused = others | {"matplotlib", "networkx", "ompl", "shapely"}
    unused |= {f"scipy.{part}" for part in ("linalg", "ndimage", "sparse")}
    script = (
        "import sys\nfrom hybridnav.cli import main\n"
        "try:\n    main()\nfinally:\n"
        f"    loaded = {unused} & sys.modules.keys()\n"
        "    assert not loaded, loaded\n"
    )
    endpoints = ("--start", "1.0,13.2", "--goal", "40.6,19.4")
    done = _python("-c", script, "plan", office, *endpoints, "--preset", preset)
    assert "Traceback" not in done.stderr, done.stderr
    assert done.returncode == 0


def test_an_unknown_command_is_refused_with_what_may_have_been_meant():
    done = _python("-m", "hybridnav", "plon", "map.yaml")
    assert (done.returncode, done.stdout) == (2, "")
    meant = "no such command 'plon'. Did you mean 'plan'?; see hybridnav --help"
    assert done.stderr == f"hybridnav: {meant}\n"


def test_help_is_complete():
    # Nothing is taken for markup.
    options = {"env": os.environ | {"COLUMNS": "100"}}
    done = _python("-m", "hybridnav", "plan", "--help", **options)
    assert (done.returncode, done.stderr) == (0, "")
    for words in (
        "--start X,Y[,YAW] ",
        "--goal X,Y[,YAW] ",
        "--preset NAME|FILE ",
        "--set KEY=VALUE ",
        "--robot-radius R ",
        "--seed N ",
        "--compare ",
        "--plot FILE ",
        "--json ",
        "in metres",
        "[default: (shortest)]",
        "Exits with 0 when it is solved",
    ):
        assert words in " ".join(done.stdout.split()) + " "


@pytest.mark.parametrize("arguments", [("show", FIGURE), ("preset", "show", "paper"), ("--help",)])
def test_a_reader_that_leaves_early_is_no_error(arguments):
    reader, writer = os.pipe()
    os.close(reader)
    done = _python("-m", "hybridnav", *arguments, stdout=writer)
    os.close(writer)
    assert done.stderr == ""


def test_a_result_that_cannot_be_written_is_one_line():
    with Path("/dev/full").open("wb") as full:
        done = _python("-m", "hybridnav", "preset", "list", stdout=full)
    assert done.returncode == 2
    assert done.stderr.startswith("hybridnav: cannot write the result: ")
    assert done.stderr.count("\n") == 1


def test_ctrl_c_during_the_work():
    script = (
        "import os, signal, time, hybridnav.maps.files.formats\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "def load_map(*_, **__):\n"
        "    os.kill(os.getpid(), signal.SIGINT)\n"
        "    time.sleep(60)\n"
        "hybridnav.maps.files.formats.load_map = load_map\n"
        "from hybridnav.cli import main\n"
        "main()\n"
    )
    done = _python("-c", script, "show", FIGURE)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "")


def test_names_that_the_terminal_cannot_write(tmp_path):
    (tmp_path / "m.pgm").write_bytes(b"P5\n2 1\n255\n\xff\0")
    path = tmp_path / "büro.yaml"
    path.write_text(f"image: m.pgm\n{KEYS}", encoding="utf-8")
    done = _python(*SHOW, path, env=os.environ | {"PYTHONIOENCODING": "ascii"})
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith("map        b\\xfcro, 2 x 1 cells")


# --- hostile maps -------------------------------------------------------------------------------

MEMORY = 2**30
"""Bytes of address space, shared libraries included, in which every bad file must be refused."""


def _png(width, height, content=b""):
    """A PNG whose header may promise more than its content holds."""

    def chunk(name, data):
        crc = struct.pack(">I", zlib.crc32(name + data))
        return struct.pack(">I", len(data)) + name + data + crc

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
    return (
        b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(content)) + chunk(b"IEND", b"")
    )


def _truncated():
    stream = io.BytesIO()
    Image.effect_noise((300, 300), 80).save(stream, "PNG")
    return stream.getvalue()[:20_000]


BOMB = "a: &a [x, x, x, x]\n" + "".join(
    f"{b}: &{b} [*{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}, *{a}]\n"
    for a, b in zip("abcdefghij", "bcdefghijk", strict=True)
)


@pytest.mark.parametrize(
    ("image", "text", "words"),
    [
        (_truncated(), KEYS, "truncated"),
        (None, KEYS, "no such file"),
        (_png(0, 0), KEYS, "0 pixels"),
        (_png(20_000, 15_000), KEYS, "too large"),
        (b"P5\n20000 15000\n255\n" + bytes(1000), KEYS, "too large"),
        (b"P2\n13000 13000\n255\n" + bytes(1000), KEYS, "truncated"),
        (b"", KEYS.replace("0.05", ".nan"), "resolution"),
        (b"", KEYS.replace("0.65", "0.1"), "free_thresh"),
        (b"", BOMB, "anchors"),
        (b"", "x: " + "[" * 1_000_000, "nested"),
    ],
)
def test_a_hostile_map_costs_little_memory_and_time(tmp_path, image, text, words):
    if image is not None:
        (tmp_path / "i.pgm").write_bytes(image)
    path = tmp_path / "a.yaml"
    path.write_text(f"image: i.pgm\n{text}")

    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CPU, (10, 10))

    done = _python(*SHOW, path, preexec_fn=limit, env=os.environ | {"OPENBLAS_NUM_THREADS": "1"})
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr.startswith(f"hybridnav: map {path}")
    assert words in done.stderr
    assert done.stderr.count("\n") == 1


# --- installation and wheel ---------------------------------------------------------------------


def test_the_installation_finds_its_presets_from_anywhere(tmp_path):
    done = _python("-m", "hybridnav", "preset", "list", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert [f"{line.split()[0]}.yaml" for line in done.stdout.splitlines()] == PLANNERS


def test_the_installation_has_the_command():
    scripts = distribution("hybridnav").entry_points.select(group="console_scripts")
    assert scripts["hybridnav"].load() is main
    assert distribution("hybridnav").version == hn.__version__


def _build(root, target, folder):
    done = _python("-m", "hatchling", "build", "-t", target, "-d", folder, cwd=root)
    assert done.returncode == 0, done.stderr
    (built,) = folder.iterdir()
    return built


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return _build(ROOT, "wheel", tmp_path_factory.mktemp("wheel"))


def test_the_wheel_holds_the_package_and_nothing_else(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = archive.namelist()
    source = ROOT / "src"
    modules = {path.relative_to(source).as_posix() for path in source.rglob("*.py")}
    # What type checkers read, and what the names of packages are loaded by.
    stubs = {path.relative_to(source).as_posix() for path in source.rglob("*.pyi")}
    presets = {f"hybridnav/presets/{name}" for name in PLANNERS}
    content = {name for name in names if ".dist-info/" not in name}
    pages = {"hybridnav/harness/report.html.j2", "hybridnav/ext/fleet/check.html.j2"} | {
        f"hybridnav/graphs/bundle_{name}.j2"
        for name in ("mask.yaml", "nav2_params.yaml", "poses.yaml", "README.md", "room_names.yaml")
    }
    assets = source / "hybridnav" / "ext" / "page" / "assets"
    pages |= {path.relative_to(source).as_posix() for path in assets.iterdir()}
    maps = {
        f"hybridnav/example_maps/{n}/{n}.{end}"
        for n in ("figure1", "office")
        for end in ("pgm", "yaml")
    }
    others = {"hybridnav/py.typed", "hybridnav/rooms/room_judge.npz", *pages}
    assert "hybridnav/__init__.pyi" in stubs
    assert content == modules | stubs | presets | maps | others
    assert len(names) == len(set(names))
    assert any(name.endswith("licenses/LICENSE") for name in names)


def test_the_unpacked_wheel_finds_its_presets_and_maps(wheel, tmp_path):
    shutil.unpack_archive(wheel, tmp_path / "site", "zip")
    script = "import hybridnav, sys; from hybridnav.cli import main; main()"
    options = {"cwd": tmp_path, "env": os.environ | {"PYTHONPATH": str(tmp_path / "site")}}
    where = _python("-c", "import hybridnav; print(hybridnav.__file__)", **options)
    assert Path(where.stdout).is_relative_to(tmp_path)
    done = _python("-c", script, "preset", "list", **options)
    assert [f"{line.split()[0]}.yaml" for line in done.stdout.splitlines()] == PLANNERS
    shown = _python("-c", script, "preset", "show", "paper", **options).stdout
    assert yaml.safe_load(shown) == yaml.safe_load(hn.load_preset("paper").to_yaml())
    script = "import hybridnav as hn; print(hn.example_map('figure1'), hn.example_map())"
    maps = _python("-c", script, **options)
    assert (maps.stdout, maps.stderr) == (f"{hn.example_map('figure1')} {hn.example_map()}\n", "")


def test_a_wheel_made_from_the_source_distribution_is_the_same(wheel, tmp_path):
    source = _build(ROOT, "sdist", tmp_path / "sdist")
    shutil.unpack_archive(source, tmp_path)
    (folder,) = (path.parent for path in tmp_path.glob("*/pyproject.toml"))
    again = _build(folder, "wheel", tmp_path / "wheel")
    with zipfile.ZipFile(wheel) as first, zipfile.ZipFile(again) as second:
        crcs = [{info.filename: info.CRC for info in z.infolist()} for z in (first, second)]
    assert crcs[0] == crcs[1]
    assert (folder / "tests" / "product" / "test_packaging.py").is_file()
    assert (folder / "maps" / "office" / "office.pgm").is_file()


@pytest.mark.full  # compiles all kernels three times, and installs packages
def test_a_wheel_with_kernels_compiles_nothing_and_answers_as_compiled_code_does(tmp_path):
    tree = tmp_path / "tree"
    subprocess.run(["git", "clone", "--quiet", ROOT, tree], check=True)
    command = [sys.executable, "-m", "benchmarks", "wheels", "--out", tmp_path / "out"]
    environment = os.environ | {"PYTHONPATH": f"{tree / 'src'}{os.pathsep}{tree}"}
    done = subprocess.run(command, cwd=tree, env=environment, check=False, capture_output=True)
    assert done.returncode == 0, done
    assert b"equal: True; AVX2 compiled [], plain compiled []" in done.stdout
