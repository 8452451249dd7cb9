"""Run a subject: `python -m benchmarks NAME [options]`; without a name, list all of them."""

import argparse
import ast
import os
import sys
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from benchmarks.options import NEEDED_DATA, Refused
from hybridnav.errors import HybridNavError

ROOT = Path(__file__).parents[1]
SUBJECTS = {
    file.stem: file
    for folder in ("benchmarks/subjects", "research", "tools")
    for file in sorted((ROOT / folder).glob("[!_]*.py"))
}
"""Measurements, then what trains and judges the finding of rooms, then what makes releases."""


def about(file: Path) -> str:
    """Return the first line of a subject's docstring, without importing what it needs."""
    return str(ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")))).splitlines()[0]


def main(words: Sequence[str] | None = None) -> int:
    """Run the subject that the first word names, with the options behind it."""
    name, *rest = (sys.argv[1:] if words is None else words) or ["--help"]
    if name not in SUBJECTS:
        is_asked = name in {"-h", "--help"}
        out = sys.stdout if is_asked else sys.stderr
        out.write(f"{__doc__}\n\n" if is_asked else f"no subject is called {name}; there are\n")
        out.writelines(f"  {key:18}{about(file)}\n" for key, file in SUBJECTS.items())
        return 0 if is_asked else 2
    try:
        return run(name, rest)
    except HybridNavError as error:  # as of a planner of others without its package
        sys.stderr.write(f"{name}: {error}\n")
        return 2
    except ModuleNotFoundError as error:
        package = str(error.name).partition(".")[0]
        if package in {"hybridnav", "benchmarks"}:
            raise
        how = "python -m pip install '.[bench,dev]'"
        sys.stderr.write(f"{name} needs {package}, which is not installed: {how}\n")
        return 2


def run(name: str, rest: Sequence[str]) -> int:
    """Run a subject with its options; return its exit code."""
    home = SUBJECTS[name].relative_to(ROOT).with_suffix("")
    subject = import_module(".".join(home.parts))
    parser = argparse.ArgumentParser(
        prog=f"python -m benchmarks {name}",
        description=subject.__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    for names, settings in subject.OPTIONS:
        parser.add_argument(*names, **settings)
    folder = os.environ.get("HYBRIDNAV_DATA")
    parser.set_defaults(data=Path(folder) if folder else None)
    given = parser.parse_args(rest)
    if given.data is None and any(one is NEEDED_DATA for one in subject.OPTIONS):
        sys.stderr.write(f"{name} needs the reference data: --data FOLDER or HYBRIDNAV_DATA\n")
        return 2
    try:
        return int(subject.main(given) or 0)
    except Refused as error:
        sys.stderr.write(f"{error}\n")
        return 2


if __name__ == "__main__":
    sys.exit(main())
