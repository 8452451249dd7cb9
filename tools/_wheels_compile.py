"""Compile listed kernels for a level of processors: `python _wheels_compile.py LIST FOLDER`.

Runs in the environment of each Python, with `NUMBA_CPU_NAME` set to the level.
"""

import os
import pickle
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import walk_packages

import hybridnav
from hybridnav._base import shipped


def main(listed: Path, folder: Path) -> None:
    """Compile the kernels of a list into a folder, in the places where a wheel has them."""
    shipped.SHIPPED = folder
    shipped.LEVELS.clear()  # what another level has does not count
    level = os.environ["NUMBA_CPU_NAME"]
    for each in walk_packages(hybridnav.__path__, "hybridnav."):
        if ".kernels." in each.name:  # some say what stands for a function of another module
            import_module(each.name)
    kernels = pickle.loads(listed.read_bytes())  # noqa: S301 - our own
    for (module, name), signatures in kernels.items():
        kernel = getattr(import_module(module), name)
        cache = kernel._cache  # noqa: SLF001 - numba has no other access
        cache._cache_file = cache._shipped(level)  # noqa: SLF001
        Path(cache._cache_file._cache_path).mkdir(parents=True, exist_ok=True)  # noqa: SLF001
        for signature in signatures:
            kernel.compile(signature)


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
