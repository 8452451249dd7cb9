"""The wheel in an empty environment: what it pulls in, and the first commands of a new user.

Builds the wheel, installs it with what it needs into a new environment for each interpreter, and
runs it in an empty folder with an empty home: the version, a first plan, a first picture, every
preset, and two plans at once on an empty cache. Exits with 1 where a command fails.
"""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from importlib.metadata import distributions
from pathlib import Path

from benchmarks.common import OFFICE, ROOT
from benchmarks.options import option

ENDS = "--start", "1.0,13.2", "--goal", "40.6,19.4"
LARGEST = 12


class Environment:
    """A new environment with the wheel, and a folder and home that hold nothing else."""

    def __init__(self, python: str, wheel: Path, folder: Path) -> None:
        self.folder, self.home = folder / "work", folder / "home"
        self.folder.mkdir(parents=True)
        self.home.mkdir()
        shutil.copytree(OFFICE.parent, self.folder / "office")
        self.venv = folder / "venv"
        subprocess.run([python, "-m", "venv", self.venv], check=True)
        began = time.perf_counter()
        pip = [str(self.venv / "bin/python"), "-m", "pip", "install", "--quiet"]
        subprocess.run([*pip, "--disable-pip-version-check", str(wheel)], check=True)
        self.seconds = time.perf_counter() - began

    def start(self, *words: str, cache: Path | None = None) -> subprocess.Popen[str]:
        """Start `hybridnav` with these words."""
        kept = {"PATH": os.environ["PATH"], "HOME": str(self.home), "MPLBACKEND": "Agg"}
        if cache is not None:
            kept["NUMBA_CACHE_DIR"] = str(cache)
        command = [str(self.venv / "bin/hybridnav"), *words]
        piped = subprocess.PIPE
        return subprocess.Popen(
            command, cwd=self.folder, env=kept, text=True, stdout=piped, stderr=piped
        )

    def run(self, *words: str) -> tuple[float, bool]:
        """Return the seconds that a command takes, and whether it succeeds."""
        began = time.perf_counter()
        process = self.start(*words)
        said = process.communicate()
        if process.returncode:
            print("  ".join(said), file=sys.stderr)
        return time.perf_counter() - began, process.returncode == 0

    def two_at_once(self) -> tuple[float, bool]:
        """Return the same of two plans that fill one empty cache."""
        cache = self.folder / "cache"
        began = time.perf_counter()
        both = [self.start("plan", "office/office.yaml", *ENDS, cache=cache) for _ in range(2)]
        said = [process.communicate()[0] for process in both]
        lengths = {line for out in said for line in out.splitlines() if line.startswith("length")}
        is_fine = not any(process.returncode for process in both) and len(lengths) == 1
        return time.perf_counter() - began, is_fine

    def megabytes(self) -> list[tuple[int, str]]:
        """Return what each package takes on disk without bytecode, the largest first."""
        (packages,) = self.venv.glob("lib/python*/site-packages")
        sizes = []
        for one in distributions(path=[str(packages)]):
            files = [Path(str(each.locate())) for each in one.files or ()]
            bare = (file for file in files if file.suffix != ".pyc" and file.is_file())
            size = sum(file.stat().st_size for file in bare)
            sizes.append((round(size / 1e6), one.metadata["Name"]))
        return sorted(sizes, reverse=True)


def measure(python: str, wheel: Path, folder: Path) -> bool:
    """Print the table of one interpreter; return whether every command succeeded."""
    made = Environment(python, wheel, folder)
    sizes = made.megabytes()
    total = sum(size for size, _ in sizes)
    print(f"\n{python}: installed in {made.seconds:.0f} s, {total} MB without bytecode")
    print("  " + ", ".join(f"{name} {size}" for size, name in sizes[:LARGEST]))
    plan = "plan", "office/office.yaml", *ENDS
    jobs = [
        ("version", ("--version",)),
        ("first plan", plan),
        ("second plan", plan),
        ("first picture", (*plan, "--plot", "plan.png")),
    ]
    listed = subprocess.run(
        [made.venv / "bin/hybridnav", "preset", "list"], check=True, text=True, capture_output=True
    )
    presets = [line.split()[0] for line in listed.stdout.splitlines() if line.strip()]
    jobs += [(f"preset {preset}", (*plan, "--preset", preset)) for preset in presets]
    done = []
    for name, words in jobs:
        seconds, is_done = made.run(*words)
        print(f"  {name:32s} {seconds:7.1f} s  {'' if is_done else 'FAILED'}")
        done.append(is_done)
    seconds, is_done = made.two_at_once()
    print(f"  {'two plans, one empty cache':32s} {seconds:7.1f} s  {'' if is_done else 'FAILED'}")
    return all([*done, is_done])


OPTIONS = [
    option("--python", nargs="+", default=[sys.executable]),
    option("--keep", type=Path, help="an empty folder for the environments"),
]


def main(given: Namespace) -> int:
    """Print the tables."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = given.keep or Path(scratch)
        build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps"]
        build += ["--no-build-isolation", "--wheel-dir", str(folder), str(ROOT)]
        subprocess.run(build, check=True)
        (wheel,) = folder.glob("*.whl")
        print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB")
        print(f"load {os.getloadavg()[0]:.1f}")
        pythons = enumerate(given.python)
        done = [measure(python, wheel, folder / str(i)) for i, python in pythons]
    return 0 if all(done) else 1
