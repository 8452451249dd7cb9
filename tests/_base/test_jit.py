"""Compiled kernels: callable from Python and from each other, and compiled once."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from numba.core import event

from hybridnav._base.jit import njit
from hybridnav._base.shipped import LEVELS, levels

SOURCE = Path(__file__).parents[2] / "src"

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="nothing is compiled"
)


class _Compiled(event.Listener):
    """Names of the functions that were compiled."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def on_start(self, event: Any) -> None:
        self.names.append(event.data["dispatcher"].__name__)

    def on_end(self, event: Any) -> None:
        pass


@contextmanager
def compiled() -> Iterator[list[str]]:
    """Take down what is compiled."""
    listener = _Compiled()
    with event.install_listener("numba:compile", listener):
        yield listener.names


@njit(nogil=True)
def _times(values, k, is_halved):
    total = values[k] * k
    return total / 2 if is_halved else total


@njit(nogil=True)
def _sum_of_times(values):
    """Call another kernel with several whole numbers and truths."""
    return (
        _times(values, 1, True) + _times(values, 2, False) + _times(values, len(values) - 1, True)
    )


def test_a_kernel_is_compiled_once_for_all_whole_numbers_it_is_called_with() -> None:
    values = np.arange(5.0)
    with compiled() as names:
        found = _sum_of_times(values)
    assert found == 0.5 + 4 + 8
    assert names.count("_times") == 1


def test_a_kernel_that_kernels_call_is_called_from_python_too() -> None:
    values = np.arange(5.0)
    assert _sum_of_times(values) == 12.5
    assert _times(values, 3, True) == 4.5
    assert _times(values, k=3, is_halved=False) == 9
    assert _sum_of_times(values) == 12.5


def fresh(code: str, folder: Path) -> str:
    """Run code in a process that keeps kernels in a folder; return what it prints."""
    command = [sys.executable, "-c", code, str(folder)]
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")}
    return subprocess.run(
        command, env=environment, capture_output=True, text=True, check=True
    ).stdout


_STALE = """
import sys
from collections import namedtuple
import numpy as np
sys.path.insert(0, sys.argv[1])
import kernels_of_both
from {module} import State
print(kernels_of_both.outer(State(np.arange(3.0))))
"""


def test_kept_code_that_names_a_module_that_is_gone_is_compiled_anew(tmp_path: Path) -> None:
    """As after an upgrade that moved a named tuple: numba reads the index before its date."""
    tuples = "from typing import Any, NamedTuple\nclass State(NamedTuple):\n    values: Any\n"
    (tmp_path / "kernels_of_both.py").write_text(
        "from hybridnav._base.jit import njit\n"
        "@njit(cache=True)\ndef inner(state):\n    return state.values.sum()\n"
        "@njit(cache=True)\ndef outer(state):\n    return inner(state) + 1.0\n"
    )
    for module, other in (("before", "after"), ("after", "before")):
        (tmp_path / f"{module}.py").write_text(tuples)
        (tmp_path / f"{other}.py").unlink(missing_ok=True)
        assert fresh(_STALE.format(module=module), tmp_path) == "4.0\n"


_CALLS = """
import logging, sys
sys.path.insert(0, sys.argv[1])
logging.basicConfig(level=logging.INFO, stream=sys.stdout, format="%(message).14s")
from kept.callers import outer
print(outer(1.0))
"""


def test_kept_code_is_compiled_anew_when_a_module_that_it_imports_changes(tmp_path: Path) -> None:
    """As after an upgrade in place: a module that did not change calls one that did."""
    package = tmp_path / "kept"
    package.mkdir()
    (package / "sizes.py").write_text("STEP = 2.0\n")
    (package / "within.py").write_text(
        "from hybridnav._base.jit import njit\nfrom kept import sizes\n"
        "from kept.sizes import STEP\n"
        "@njit(cache=True)\ndef inner(x):\n    return x + STEP\n"
    )
    (package / "callers.py").write_text(
        "from hybridnav._base.jit import njit\nfrom kept.within import (\n    inner,\n)\n"
        "@njit(cache=True)\ndef middle(x):\n    return inner(x)\n"
        "@njit(cache=True)\ndef outer(x):\n    return 10.0 * middle(x)\n"
    )

    assert fresh(_CALLS, tmp_path) == "compiled outer\n30.0\n"
    assert fresh(_CALLS, tmp_path) == "30.0\n"
    within = package / "within.py"
    # Of another size: Python knows a changed module by that and the second of the change.
    within.write_text(within.read_text().replace("x + STEP", "-STEP + x"))
    assert fresh(_CALLS, tmp_path) == "compiled outer\n-10.0\n"
    (package / "sizes.py").write_text("STEP = 3.0\n")
    assert fresh(_CALLS, tmp_path) == "compiled outer\n-20.0\n"
    assert fresh(_CALLS, tmp_path) == "-20.0\n"


_SHIPS = """
import logging, os, sys
from pathlib import Path
import numpy as np
from hybridnav._base import shipped
logging.basicConfig(level=logging.INFO, stream=sys.stdout, format="%(message).14s")
shipped.SHIPPED = Path(sys.argv[1])
from hybridnav._base.kernels import arrays
if sys.argv[2:]:
    shipped.LEVELS.clear()
    cache = arrays.push._cache
    cache._cache_file = cache._shipped(os.environ["NUMBA_CPU_NAME"])
    Path(cache._cache_file._cache_path).mkdir(parents=True)
keys = np.full((4, 2), 7)
arrays.push(keys, 0, 3, 5)
print(keys[0].tolist(), shipped.is_for_another_numba(), arrays.push.is_warm(), end=" ")
print("scipy.linalg" in sys.modules)
"""


def test_code_that_a_wheel_brings_is_taken_and_only_by_its_numba(tmp_path: Path) -> None:
    def run(*words: str, **settings: str) -> str:
        settings["NUMBA_CACHE_DIR"] = str(tmp_path / "cache")
        done = subprocess.run(
            [sys.executable, "-c", _SHIPS, str(tmp_path / "compiled"), *words],
            env={"PATH": os.environ["PATH"], "PYTHONPATH": str(SOURCE)} | settings,
            capture_output=True,
            text=True,
            check=False,
        )
        assert (done.returncode, done.stderr) == (0, "")
        return done.stdout

    compiled, told = "compiled push \n", "[3, 5] False True False\n"
    shipped = [level for level in LEVELS if level in levels()]
    for level in shipped:
        filled = run("fill", NUMBA_CPU_NAME=level, NUMBA_CPU_FEATURES="")
        assert filled == compiled + told
    version = tmp_path / "compiled" / numba.__version__
    for level in shipped:  # the next one serves where the best is not there
        assert run() == told
        (version / level).rename(tmp_path / level)
    assert not list((tmp_path / "cache").rglob("push*.nbi"))
    (tmp_path / level).rename(version / level)
    version.rename(tmp_path / "compiled" / "0.0")
    another = told.replace("False", "True", 1)
    assert run() == compiled + another
    assert run() == another  # kept in the user's folder
