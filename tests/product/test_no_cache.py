"""The package where nothing can be written: installed read-only, for a user without a home."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WARNING = "no folder can be written in which numba could keep compiled code"


@pytest.fixture(scope="module")
def locked(tmp_path_factory):
    """A copy of the package beside whose modules nothing can be kept, whoever asks."""
    folder = tmp_path_factory.mktemp("site")
    unwanted = shutil.ignore_patterns("__pycache__")
    shutil.copytree(ROOT / "src" / "hybridnav", folder / "hybridnav", ignore=unwanted)
    shutil.copytree(ROOT / "planners", folder / "hybridnav" / "presets")
    for inside in [folder / "hybridnav", *(folder / "hybridnav").rglob("*/")]:
        # A file in the place of the folder stops the super-user too, whom permissions do not.
        (inside / "__pycache__").touch()
    return folder


def _python(folder, *arguments, **environment):
    """Run this Python without a home, with the package of a folder."""
    unset = ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME", "NUMBA_DISABLE_JIT", "PYTHONWARNINGS")
    inherited = {key: value for key, value in os.environ.items() if key not in unset}
    return subprocess.run(
        [sys.executable, "-P", *map(str, arguments)],
        encoding="utf-8",
        capture_output=True,
        timeout=900,
        check=False,
        env=inherited
        | {"HOME": "/dev/null", "PYTHONPATH": str(folder), "PYTHONDONTWRITEBYTECODE": "1"}
        | environment,
    )


KERNELS = """
import importlib, pathlib, hybridnav
root = pathlib.Path(hybridnav.__file__).parent
assert root.is_relative_to({folder!r})
for path in sorted([*root.rglob("kernels/[!_]*.py"), *root.rglob("kernels.py")]):
    importlib.import_module(".".join(("hybridnav", *path.relative_to(root).with_suffix("").parts)))
from hybridnav.refine.kernels.curves import _wrapped
print(round(float(_wrapped(7.0)), 6))
"""


def test_every_kernel_imports_and_compiles_with_one_warning(locked):
    done = _python(locked, "-c", KERNELS.format(folder=str(locked)))
    assert done.returncode == 0, done.stderr
    assert done.stdout == "0.716815\n"
    assert done.stderr.count(WARNING) == 1
    assert "NUMBA_CACHE_DIR" in done.stderr


def test_a_folder_that_is_set_takes_what_was_compiled(locked, tmp_path):
    code = KERNELS.format(folder=str(locked))
    done = _python(locked, "-c", code, NUMBA_CACHE_DIR=str(tmp_path / "cache"))
    assert (done.returncode, done.stdout, done.stderr) == (0, "0.716815\n", "")
    assert list((tmp_path / "cache").rglob("*_wrapped*.nbi"))


@pytest.mark.full  # compiles every kernel that it needs
def test_the_command_works_and_says_so_in_one_line(locked):
    figure = ROOT / "maps" / "figure1" / "figure1.yaml"
    query = ("--start", "0.5,1.5", "--goal", "3.5,1.5", "--robot-radius", "0")
    settings = ("--set", "planner.allow_unexplored=true", "--preset", "ompl")
    done = _python(locked, "-m", "hybridnav", "plan", figure, *query, *settings)
    assert done.returncode == 0, done.stderr
    assert "solved" in done.stdout
    assert done.stderr.startswith(f"hybridnav: warning: {WARNING}")
    assert done.stderr.count("\n") == 1
