"""Code of kernels in files: what wheels bring, for which processors, and when it is out of date."""

from __future__ import annotations

import hashlib
import re
import sys
from functools import cache
from pathlib import Path
from typing import Any

SHIPPED = Path(__file__).parents[1] / "compiled"
"""Folder of compiled kernels that a wheel brings, in one folder for each version of numba."""
LEVELS: dict[str, tuple[str, ...]] = {
    "x86-64-v3": ("avx2", "bmi", "bmi2", "f16c", "fma", "lzcnt", "movbe"),
    "x86-64": (),
}
"""Processors that a wheel brings kernels for, as LLVM names them, and their features, best first.

A pyramid of the office grew as fast with code for AVX2 as with code for the processor that it was
measured on, and took 1.2 times as long with that for all processors."""
OVERLOADS: list[tuple[Any, Any]] = []
"""Functions and what kernels call in their place, until numba is loaded and informed."""


def cause_of(error: SystemError) -> BaseException:
    """Return the exception that another one is raised for, itself if there is none."""
    raised: BaseException = error
    while isinstance(raised, SystemError) and raised.__cause__ is not None:
        raised = raised.__cause__
    return raised


def is_for_another_numba() -> bool:
    """Return whether a wheel brought kernels that this version of numba cannot read."""
    import numba  # noqa: PLC0415 - a command may do without

    return SHIPPED.exists() and not (SHIPPED / numba.__version__).exists()


@cache
def levels() -> list[str]:
    """Return the levels of `LEVELS` that this processor has."""
    import llvmlite.binding as llvm  # noqa: PLC0415 - on demand

    has = llvm.get_host_cpu_features()
    return [level for level, features in LEVELS.items() if all(map(has.get, features))]


_IMPORT = re.compile(r"^from ([\w.]+) import (?:\(([^)]*)\)|(.*))", re.MULTILINE)


@cache
def _source(module: str) -> tuple[bytes, list[str]]:
    """Return the text of a module, and the modules that it may import from."""
    file = getattr(sys.modules.get(module), "__file__", None)
    text = b"" if file is None else Path(file).read_bytes()
    imported = []
    for of, *names in _IMPORT.findall(text.decode()):
        imported += [of, *(f"{of}.{name}" for name in re.findall(r"\w+", " ".join(names)))]
    return text, imported


@cache
def stamp_of(module: str) -> str:
    """Return a digest of a module and of what it imports of its own package, and so on.

    numba asks for the module alone, and would run kept code of kernels that others changed.
    """
    package, sources, to_see = module.partition(".")[0], dict[str, bytes](), [module]
    while to_see:
        name = to_see.pop()
        if name not in sources and name.partition(".")[0] == package:
            sources[name], imported = _source(name)
            to_see += imported
    return hashlib.sha256(b"".join(sources[name] for name in sorted(sources))).hexdigest()
