"""The oldest and the newest Python and numpy: tests of what plans, in environments of their own.

Installs the package with its dependencies into an environment of the first and of the last Python,
the first with the oldest numpy that is allowed, and runs there the tests of `TESTS`: the kernels,
every preset, pyramids and rooms, the saved models, the commands, maps, the files of graphs, and
that answers depend on no processor. Exits with 1 where one fails.
"""

import os
import subprocess
import sys
import tempfile
from argparse import Namespace
from pathlib import Path

from benchmarks.common import ROOT
from benchmarks.options import option
from tools.wheels import Environment

OLDEST = "numpy==1.26.*"
TESTS = (
    *("tests/_base", "tests/planning/test_named_plans.py", "tests/planning/test_results.py"),
    *("tests/pyramid/test_invariants.py", "tests/search/test_search.py", "tests/topology"),
    *("tests/cli/test_commands.py", "tests/cli/test_export.py", "tests/maps"),
    "tests/graphs/test_bundle.py",
)
PACKAGES = ("hypothesis", "pytest", "h11")
VERSIONS = "import sys, numpy, numba; print(sys.version.split()[0], numpy.__version__)"

OPTIONS = [option("--python", nargs="+", default=[sys.executable], help="the oldest first")]


def main(given: Namespace) -> int:
    """Run the tests in both environments."""
    codes = []
    with tempfile.TemporaryDirectory() as scratch:
        for at, python in enumerate(dict.fromkeys((given.python[0], given.python[-1]))):
            environment = Environment(python, Path(scratch) / str(at))
            oldest = () if at else (OLDEST,)
            environment.install(*PACKAGES, *oldest, "--editable", f"{ROOT}")
            paths = {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(Path(scratch) / "cache")}
            print("Python and numpy:", flush=True)
            subprocess.run([str(environment.python), "-c", VERSIONS], check=True)
            command = [str(environment.python), "-m", "pytest", "-q", "-m", "not full", *TESTS]
            codes.append(subprocess.run(command, cwd=ROOT, env=os.environ | paths, check=False))
    return int(any(done.returncode for done in codes))
