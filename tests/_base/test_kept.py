"""Kept kernels without numba: their types' names, and that what is unknown is left to numba."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numba
import numpy as np
import pytest
from hypothesis import strategies as st

from hybridnav._base.kept import UnknownError, name_of
from tests.strategies import tried

ROOT = Path(__file__).parents[2]
OFFICE = ROOT / "maps" / "office" / "office.yaml"
PLAN = ("plan", str(OFFICE), "--start", "1.0,13.2", "--goal", "40.6,19.4")

pytestmark = pytest.mark.skipif(
    os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="nothing is compiled"
)


class Two(NamedTuple):
    a: Any
    b: Any


class Three(NamedTuple):
    a: Any
    b: Any
    c: Any


DTYPES = ("bool", "int8", "uint8", "int16", "uint32", "int64", "uint64", "float32", "float64")


@st.composite
def arrays(draw: st.DrawFn) -> np.ndarray:
    """Arrays that differ in all that numba's types distinguish."""
    shape = draw(st.lists(st.integers(0, 3), min_size=1, max_size=3))
    order: Literal["C", "F"] = draw(st.sampled_from(("C", "F")))
    array = np.zeros(shape, draw(st.sampled_from(DTYPES)), order)
    if draw(st.booleans()):
        array = array[..., ::2] if draw(st.booleans()) else array.T
    if draw(st.booleans()):
        data = np.zeros(array.itemsize * 4 + 1, np.uint8)[1:]
        array = data.view(array.dtype)
    array.flags.writeable = draw(st.booleans())
    return array


leaves = st.one_of(
    arrays(),
    st.none(),
    st.booleans(),
    st.integers(-(2**62), 2**62),
    st.floats(),
    st.sampled_from(DTYPES).map(lambda name: np.dtype(name).type(1)),
)
values = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.lists(inner, max_size=3).map(tuple),
        st.tuples(inner, inner).map(Two._make),
        st.tuples(inner, inner, inner).map(Three._make),
    ),
    max_leaves=5,
)


@tried(100, values)
def test_types_have_the_names_that_numba_gives_them(value: object) -> None:
    assert name_of(value) == str(numba.typeof(value))


@pytest.mark.parametrize(
    "value", [np.zeros(1, ">i8"), np.zeros(1, "M8[s]"), np.zeros(1, "i4,f4"), "text", [1], {1}, 1j]
)
def test_other_types_are_unknown(value: object) -> None:
    with pytest.raises(UnknownError):
        name_of(value)


_KERNELS = """
from typing import Any, Literal, NamedTuple
import numpy as np
from hybridnav._base.jit import guarded, njit
STEP = 2.0
class State(NamedTuple):
    values: Any
    n: Any
@njit(cache=True)
def inner(x):
    return x + STEP
@guarded
@njit(cache=True)
def outer(state, factor):
    if state.n < 0:
        raise ValueError("below zero")
    found = np.empty(state.n)
    for k in range(state.n):
        found[k] = inner(state.values[k]) * factor
    return found, state.n, None if state.n > 2 else factor
"""
_CALL = """
import sys
import numpy as np
sys.path.insert(0, sys.argv[1])
from hybridnav._base import jit, kept
jit.run_kept()
from of_kept import State, outer
{before}
print(outer(State(np.arange(3, dtype="{dtype}"), 3), {factor}))
try:
    outer(State(np.arange(3, dtype="{dtype}"), -1), {factor})
except ValueError as error:
    print(error)
print("numba" in sys.modules, kept.Kernel._n_calls)
"""


def called(folder: Path, dtype: str = "i8", factor: object = 2.0, before: str = "", **how: str):
    """Call a kernel in a process of its own; return its answer, and whether numba was loaded."""
    code = _CALL.format(dtype=dtype, factor=factor, before=before)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(folder / "cache")} | how
    command = [sys.executable, "-c", code, str(folder)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    *answer, last = done.stdout.splitlines()
    return answer, last.split()[0] == "True"


def test_kept_code_runs_without_numba_and_what_is_not_kept_with_it(tmp_path: Path) -> None:
    module = tmp_path / "of_kept.py"
    module.write_text(_KERNELS)
    right = ["(array([4., 6., 8.]), 3, None)", "below zero"]
    assert called(tmp_path) == (right, True)
    assert called(tmp_path) == (right, False)
    assert called(tmp_path, "f4") == (right, True)
    assert called(tmp_path, "f4") == (right, False)
    assert called(tmp_path, factor=2) == (right, True)
    assert called(tmp_path, NUMBA_OPT="1") == (right, True)
    assert called(tmp_path, before="import numba") == (right, True)
    named = "outer(State(np.arange(3), 3), factor=2.0)"
    assert called(tmp_path, before=named) == (right, True)
    assert called(tmp_path, before="kept._MANY = 1") == (right, True)
    assert called(tmp_path, before="kept._home = lambda: kept.Path('none')") == (right, True)
    missing = "import llvmlite.binding as llvm; llvm.address_of_symbol = lambda _: None"
    assert called(tmp_path, before=missing) == (right, True)
    module.write_text(_KERNELS.replace("STEP = 2.0", "STEP = 3.0"))
    changed = ["(array([ 6.,  8., 10.]), 3, None)", "below zero"]
    assert called(tmp_path) == (changed, True)
    assert called(tmp_path) == (changed, False)


_COMMAND = (
    "import atexit, sys\n"
    "atexit.register(lambda: sys.stderr.write(f\"{'numba' in sys.modules}\"))\n"
    "from hybridnav.cli import main\nmain()\n"
)


@pytest.mark.parametrize(
    "words",
    [
        *((*PLAN, "--preset", preset) for preset in ("shortest", "octile", "paper")),
        ("show", str(OFFICE)),
    ],
)
def test_a_command_whose_kernels_are_kept_loads_no_numba(words: tuple[str, ...]) -> None:
    command = [sys.executable, "-c", _COMMAND, *words, "--json"] if words[0] == "plan" else []
    command = command or [sys.executable, "-c", _COMMAND, *words]
    for _ in range(2):  # the first may compile
        done = subprocess.run(command, check=True, capture_output=True, text=True)
    assert done.stderr.endswith("False")
