"""Build wheels that bring compiled kernels, one for each Python, and try them: `make wheels`.

For each Python `EXERCISE` runs with a wheel in an environment of its own. What it compiles is
compiled for the levels of x86-64 in `hybridnav._base.shipped.LEVELS` and packed, until it compiles
nothing; the next Python begins with the kernels of the one before, the first one with those of a
checkout of this commit whose tests have run, if `--known` names one. Then, in a home that cannot be
written, the answers of `tests.answers` must be those of a run that compiles for this processor, bit
for bit, with nothing compiled. Exits with 1 where one fails.
"""

import json
import os
import pickle
import platform
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from pathlib import Path
from typing import Any

from benchmarks.common import PLAN, ROOT
from benchmarks.options import Refused, option
from hybridnav._base.shipped import LEVELS

EXERCISE = (
    *("tests/product/test_readme.py", "tests/product/test_notebooks.py"),
    *("tests/planning/test_named_plans.py", "tests/cli/test_commands.py", "tests/cli/test_live.py"),
    *("tests/cli/test_export.py", "tests/cli/test_check.py", "tests/cli/test_evaluate.py"),
    *("tests/ext/page/test_answers.py", "tests/ext/page/test_edits.py", "tests/ext/agent"),
)
"""Tests that run every command, all presets, the page, and what pages and notebooks promise."""
PACKAGES = ("hypothesis", "pytest", "nbclient", "nbformat", "ipykernel", "rosbags", "playwright")
"""What they need beside extras."""
TIMED = ("shortest", "paper", "robot", "ompl")
"""Presets whose first plan is timed."""
ROUNDS = 3
"""Times that what was compiled is packed: the first wheel has nothing, the second should do."""
TAG = f"manylinux_2_28_{platform.machine()}"
"""llvmlite's own wheels need as much."""
COUNTED = """
import sys
from numba.core import event
compiled = []
class Listener(event.Listener):
    def on_start(self, event): compiled.append(event.data["dispatcher"].__name__)
    def on_end(self, event): pass
event.register("numba:compile", Listener())
import runpy
sys.argv = sys.argv[1:]
try:
    runpy.run_module(sys.argv[0], run_name="__main__", alter_sys=True)
finally:
    sys.stderr.write(f"compiled {compiled}\\n")
"""
WARM = """
from hybridnav.cli import warm
for job in (*(warm.SEARCH + method for method in warm.SEARCHES), *warm.PRESETS, warm.ROOMS):
    warm.compile_job(job)
"""
"""What `python -m hybridnav.cli.warm` compiles, in one process."""

Kernels = dict[tuple[str, str], list[Any]]
"""Signatures by module and name."""


def run(*words: Any, **settings: Any) -> str:
    """Run a command and return what it prints."""
    command = list(map(str, words))
    done = subprocess.run(command, check=False, text=True, stdout=subprocess.PIPE, **settings)
    if done.returncode:
        raise Refused(f"{' '.join(command)}: exit code {done.returncode}\n{done.stdout}")
    return str(done.stdout)


def take_kernels(tree: Path, kernels: Kernels) -> list[str]:
    """Take module, name and signatures of the kernels in the caches below a folder; return the
    names of the new ones."""
    new = []
    for index in sorted(tree.rglob("__pycache__/*.nbi")):
        stem, _, _ = index.name.rpartition("-")
        module, _, name = stem.partition(".")
        if name.endswith("_inner"):  # linked into the others
            continue
        with index.open("rb") as file:
            pickle.load(file)  # noqa: S301 - numba's version, as all of its files
            _, entries = pickle.loads(file.read())  # noqa: S301
        parts = index.parents[1].relative_to(tree).parts
        key = ".".join(parts if module == "__init__" else (*parts, module)), name
        known = kernels.setdefault(key, [])
        signatures: list[Any] = sorted({key[0] for key in entries}, key=str)
        if any(each not in known for each in signatures):
            new.append(".".join(key))
        known += [each for each in signatures if each not in known]
    return new


class Environment:
    """A virtual environment of one Python."""

    def __init__(self, python: str, folder: Path) -> None:
        self.folder = folder
        run(python, "-m", "venv", folder)
        self.python = folder / "bin" / "python"
        self.name = run(self.python, "-c", "import sys; print('cp%d%d' % sys.version_info[:2])")
        self.name = self.name.strip()
        (self.packages,) = folder.glob("lib/python*/site-packages")

    def install(self, *words: Any) -> None:
        """Install packages."""
        run(self.python, "-m", "pip", "install", "--quiet", "--no-compile", *words)


def compile_for(environment: Environment, listed: Path, folder: Path) -> None:
    """Compile the listed kernels into a folder, a process for each level."""
    script = Path(__file__).with_name("_wheels_compile.py")
    at_work = []
    for level in LEVELS:
        settings = {"NUMBA_CPU_NAME": level, "NUMBA_CPU_FEATURES": ""}
        settings["NUMBA_CACHE_DIR"] = str(environment.folder / level)
        command = [str(environment.python), str(script), str(listed), str(folder)]
        at_work.append(subprocess.Popen(command, env=os.environ | settings))
    codes = [process.wait() for process in at_work]
    if any(codes):
        raise Refused(f"{environment.name}: a kernel does not compile")


def build(environment: Environment, tree: Path, listed: Path) -> Path:
    """Build the wheel of one Python in a clean tree, and install it."""
    compile_for(environment, listed, tree / "src" / "hybridnav" / "compiled")
    dist = tree / "dist"
    shutil.rmtree(dist, ignore_errors=True)
    run(environment.python, "-m", "hatchling", "build", "-t", "wheel", "-d", dist, cwd=tree)
    (plain,) = dist.glob("*-none-any.whl")
    tags = [f"--python-tag={environment.name}", f"--abi-tag={environment.name}"]
    run(environment.python, "-m", "wheel", "tags", *tags, f"--platform-tag={TAG}", plain)
    (made,) = dist.glob(f"*-{environment.name}-*.whl")
    shutil.rmtree(environment.packages / "hybridnav")
    environment.install("--no-deps", "--force-reinstall", made)
    return made


def exercise(environment: Environment, tree: Path) -> None:
    """Run the tests with an installed wheel, in one process: two may lose what they keep."""
    clean = {key: text for key, text in os.environ.items() if key != "NUMBA_CACHE_DIR"}
    clean |= {"PYTHONPATH": str(tree), "HYBRIDNAV_DATA": ""}
    clean["PATH"] = f"{environment.python.parent}{os.pathsep}{clean['PATH']}"
    run(environment.python, "-c", WARM, cwd=tree, env=clean)
    run(environment.python, "-m", "tests.answers", cwd=tree, env=clean)
    tests = "pytest", "-q", "-m", "not full", *EXERCISE
    run(environment.python, "-m", *tests, cwd=tree, env=clean)


def answers(python: Path, folder: Path, **settings: str) -> tuple[dict[str, Any], str]:
    """Return the answers of a Python in a home that cannot be written, and what it compiled."""
    command = [str(python), "-c", COUNTED, "tests.answers"]
    clean = {"PATH": os.environ["PATH"], "HOME": "/dev/null", "PYTHONPATH": str(folder)}
    done = subprocess.run(
        command, cwd=folder, env=clean | settings, check=True, text=True, capture_output=True
    )
    return json.loads(done.stdout)["answers"], done.stderr.strip().splitlines()[-1]


def seconds(environment: Environment, *words: str) -> tuple[float, float]:
    """Return the seconds that a command takes in an empty home, and those of processors, least of
    three each."""
    found = []
    for _ in range(3):
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        command = environment.python.with_name("hybridnav")
        run(command, *words, env={"PATH": os.environ["PATH"], "HOME": os.devnull})
        took = time.perf_counter() - began
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        found.append((took, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime))
    wall, cpu = map(min, zip(*found, strict=True))
    return wall, cpu


def judge(environment: Environment, tree: Path, folder: Path) -> bool:
    """Print whether an installed wheel answers as compiled code does, in a home of no use."""
    packages = environment.packages
    for words in (("--help",), *((*PLAN, "--preset", preset) for preset in TIMED)):
        wall, cpu = seconds(environment, *words)
        print(f"  {wall:.2f} s, {cpu:.2f} s of processors: {' '.join(words)}", flush=True)
    for part in ("tests", "benchmarks", "maps"):
        shutil.copytree(tree / part, folder / part)
    for place in (packages / "hybridnav").rglob("__pycache__"):
        shutil.rmtree(place)
    for place in [packages / "hybridnav", *(packages / "hybridnav").rglob("*/")]:
        (place / "__pycache__").touch()  # stops the super-user too, as permissions do not
    best, compiled = answers(environment.python, folder)
    compiled_folder = packages / "hybridnav" / "compiled"
    (version,) = (place for place in compiled_folder.iterdir() if place.is_dir())
    (version / "x86-64-v3").rename(version / "kept")
    plain, compiled_plain = answers(environment.python, folder)
    compiled_folder.rename(compiled_folder.with_name("kept"))
    own, compiled_own = answers(environment.python, folder, NUMBA_CACHE_DIR=str(folder / "cache"))
    is_equal = best == plain == own
    print(f"  {len(own)} answers, equal: {is_equal}; AVX2 {compiled}, plain {compiled_plain}")
    nothing = "compiled []"
    return is_equal and compiled == compiled_plain == nothing != compiled_own


OPTIONS = [
    option("--python", nargs="+", default=[sys.executable]),
    option("--known", type=Path, help="a checkout of this commit whose tests have run"),
    option("--out", type=Path, default=ROOT / "out" / "wheels"),
]


def main(given: Namespace) -> int:
    """Build and try the wheels."""
    if run("git", "status", "--porcelain", cwd=ROOT):
        raise Refused("the tree is not clean: commit first, kernels are built from commits")
    given.out.mkdir(parents=True, exist_ok=True)
    kernels: Kernels = {}
    if given.known is not None:
        take_kernels(given.known / "src", kernels)
    is_fine = []
    for python in given.python:
        with tempfile.TemporaryDirectory() as scratch:
            is_fine.append(make(python, Path(scratch), kernels, given.out))
    return 0 if all(is_fine) else 1


def make(python: str, folder: Path, kernels: Kernels, out: Path) -> bool:
    """Build and try the wheel of one Python; return whether it is fine."""
    tree, listed = folder / "tree", folder / "kernels.pickle"
    run("git", "clone", "--quiet", ROOT, tree)
    environment = Environment(python, folder / "environment")
    environment.install("hatchling", "wheel", *PACKAGES, f"{tree}[agent,cluster,study,view]")
    for _ in range(ROUNDS):
        listed.write_bytes(pickle.dumps(kernels))
        made = build(environment, tree, listed)
        exercise(environment, tree)
        missing = take_kernels(environment.packages, kernels)
        n_signatures = sum(map(len, pickle.loads(listed.read_bytes()).values()))  # noqa: S301
        print(
            f"{made.name}: {made.stat().st_size / 1e6:.1f} MB, {n_signatures} versions of kernels"
        )
        print(f"  the exercise compiled {', '.join(missing) or 'nothing'}", flush=True)
        if not missing:
            shutil.copy(made, out)
            return judge(environment, tree, folder / "elsewhere")
    return False
