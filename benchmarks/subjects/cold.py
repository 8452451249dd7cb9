"""The first start: what a command takes with an empty cache of compiled kernels, and then.

Prints the seconds on the clock and of processors, with children, for the plan of the README by each
preset, first with an empty cache and then with what that left there.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from pathlib import Path

from benchmarks.common import OFFICE, option

PLAINLY = {key: text for key, text in os.environ.items() if key != "PYTHONDONTWRITEBYTECODE"}
"""The environment in which Python keeps the bytecode of modules, as it does for users."""
PLAN = ("plan", str(OFFICE), "--start", "1.0,13.2", "--goal", "40.6,19.4")


def seconds_of(cache: Path, *arguments: str) -> tuple[float, float]:
    """Return the seconds of a command with a cache folder: on the clock, of all processors."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "hybridnav", *arguments],
        check=True,
        capture_output=True,
        env=PLAINLY | {"NUMBA_CACHE_DIR": str(cache)},
    )
    passed, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    busy = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return passed, busy


def measure(*arguments: str) -> dict[str, float]:
    """Return figures of the first and the second run of a command with an empty cache."""
    with tempfile.TemporaryDirectory() as folder:
        first, first_busy = seconds_of(Path(folder), *arguments)
        kernels = sum(1 for _ in Path(folder).rglob("*.nbi"))
        second, _ = seconds_of(Path(folder), *arguments)
    return {"first_s": first, "first_cpu_s": first_busy, "kernels": kernels, "second_s": second}


OPTIONS = [option("presets", nargs="*", default=["shortest"], metavar="PRESET")]


def main(given: Namespace) -> None:
    """Print a line for each preset that is named."""
    print("preset            first s  CPU s  kernels  second s")
    for preset in given.presets:
        figures = measure(*PLAN, "--preset", preset)
        print(
            f"{preset:<16} {figures['first_s']:8.1f} {figures['first_cpu_s']:6.1f}"
            f" {figures['kernels']:8.0f} {figures['second_s']:9.2f}"
        )
