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
    """Return the answers of a process with these settings."""
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
