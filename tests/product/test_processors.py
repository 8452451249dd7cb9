"""Answers do not depend on the processor."""

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import hybridnav
from tests.answers import features

SOURCE = Path(hybridnav.__file__).parent
ROOT = Path(__file__).parents[2]
_FEATURES_OFF = "NPY_DISABLE_CPU_FEATURES"
_OLD_LIBRARIES = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX512F,-AVX2,-AVX,-FMA,-FMA4",
    "OPENBLAS_CORETYPE": "Nehalem",
}


def older_processors() -> list[dict[str, str]]:
    """Return the settings by which this processor behaves like older ones, where it can."""
    there = features()
    levels = [[name for name in there if name != "X86_V3"], there]
    off = [{_FEATURES_OFF: " ".join(names)} for names in levels if names]
    return [*off[:-1], {**(off[-1] if off else {}), **_OLD_LIBRARIES}]


def answers(settings: dict[str, str], *options: str) -> dict[str, str]:
    command = [sys.executable, "-m", "tests.answers", *options]
    environment = {**os.environ, **settings}
    run = subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True)
    found = json.loads(run.stdout)
    assert found["features"] == [
        name for name in features() if name not in settings.get(_FEATURES_OFF, "").split()
    ]
    made: dict[str, str] = found["answers"]
    return made


@pytest.mark.parametrize("options", [(), pytest.param(("--whole",), marks=pytest.mark.full)])
def test_older_processors_answer_the_same(options: tuple[str, ...]) -> None:
    here = answers({}, *options)
    for settings in older_processors():
        assert answers(settings, *options) == here, settings


def test_sorting_keeps_the_order_of_equals() -> None:
    """Other sorts of numpy order equal keys otherwise on other processors."""
    loose = [
        f"{file.relative_to(SOURCE)}:{node.lineno}"
        for file in sorted(SOURCE.rglob("*.py"))
        if "kernels" not in {file.stem, file.parent.name}  # numba has one sort for all
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and getattr(node.func, "attr", "") == "argsort"
        if "kind='stable'" not in ast.unparse(node)
    ]
    assert loose == []


def test_no_length_comes_from_the_c_library() -> None:
    """Its `hypot` differs between x86-64 and aarch64; pictures and reports keep to the rule, too.

    `math.dist` has one value everywhere, but another than a kernel: a bound could exceed a cost.
    `check_proof.py` imports nothing of the package, and allows for rounding in what it compares.
    """
    loose = [
        f"{file.relative_to(SOURCE)}:{node.lineno}"
        for file in sorted(SOURCE.rglob("*.py"))
        if file.name != "check_proof.py"
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if (
            isinstance(node, ast.Attribute)
            and node.attr in {"hypot", "dist", "norm"}
            and isinstance(node.value, ast.Name | ast.Attribute)
            and ast.unparse(node.value) in {"math", "np", "numpy", "np.linalg", "numpy.linalg"}
        )
        or (
            isinstance(node, ast.ImportFrom)
            and node.module in {"math", "numpy", "numpy.linalg"}
            and {one.name for one in node.names} & {"hypot", "dist", "norm"}
        )
    ]
    assert loose == []


def test_kernels_are_compiled_without_fast_math() -> None:
    loose = [file for file in SOURCE.rglob("*.py") if "fastmath" in file.read_text("utf-8")]
    assert loose == []
