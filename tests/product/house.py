"""The size of the house, counted: `python -m tests.product.house` prints the table.

Code is a line that is not blank, no comment and no docstring (a text that stands alone).
"""

import ast
import json
import os
import re
import subprocess
import sys
import tokenize
from collections import Counter
from dataclasses import dataclass
from functools import cache
from io import StringIO
from pathlib import Path

import networkx as nx

ROOT = Path(__file__).parents[2]
SRC = ROOT / "src" / "hybridnav"
WING = "ext"
"""Top-level package that nothing else imports."""
_NO_CODE = {
    tokenize.COMMENT, tokenize.NL, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT,
    tokenize.ENDMARKER,
}  # fmt: skip


@cache
def _nodes(path: Path) -> list[ast.AST]:
    """Read a file once for all that is counted; its module comes first."""
    return [*ast.walk(ast.parse(path.read_text()))]


@dataclass(frozen=True)
class Source:
    """One file, read once."""

    path: Path
    """Relative to the package."""
    lines: int
    code: int
    import_lines: int
    imports: frozenset[str]
    """Top-level packages and modules of hybridnav that it imports, also for type checkers."""

    @property
    def package(self) -> str:
        """The top-level package or module that it belongs to."""
        return self.path.parts[0].removesuffix(".pyi").removesuffix(".py")


def read(path: Path, root: Path = SRC) -> Source:
    text = path.read_text()
    prose: set[int] = set()
    importing: set[int] = set()
    names: set[str] = set()
    for node in _nodes(path):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            prose |= _span(node) if isinstance(node.value.value, str) else set()
        elif isinstance(node, ast.Import | ast.ImportFrom):
            importing |= _span(node)
            names |= set(_packages(node))
    code: set[int] = set()
    for token in tokenize.generate_tokens(StringIO(text).readline):
        if token.type not in _NO_CODE:
            code |= set(range(token.start[0], token.end[0] + 1))
    code -= prose
    relative = path.relative_to(root)
    return Source(relative, text.count("\n"), len(code), len(importing & code), frozenset(names))


def _span(node: ast.stmt) -> set[int]:
    return set(range(node.lineno, (node.end_lineno or node.lineno) + 1))


def _packages(node: ast.Import | ast.ImportFrom):
    if isinstance(node, ast.Import):
        modules = [one.name for one in node.names]
    elif node.module == "hybridnav":
        modules = [f"hybridnav.{one.name}" for one in node.names]
    else:
        modules = [node.module or ""]
    for module in modules:
        parts = module.split(".")
        if parts[0] == "hybridnav" and len(parts) > 1:
            yield parts[1]


def sources(root: Path = SRC) -> list[Source]:
    """Read all files below a folder."""
    return [read(path, root) for path in sorted(root.rglob("*.py"))]


_VISITED = """
import json, sys
from pathlib import Path
import hybridnav as hn
files = set()
def see(frame, event, arg):
    files.add(frame.f_code.co_filename)
def plan():
    grid = hn.load_map(sys.argv[1], robot_radius_m=0.0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    return hn.HybridPlanner(topology, preset="paper").plan((0.5, 0.5), (2.0, 2.5))
plan().route  # imports
sys.setprofile(see)
plan().route
sys.setprofile(None)
print(json.dumps(sorted(name for name in files if Path(name).is_relative_to(hn.__path__[0]))))
"""
_LOADED = """
import json, sys
import hybridnav as hn
from hybridnav.viz import plot_plan, save_figure
topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.load_map(sys.argv[1])))
planner = hn.HybridPlanner(topology)
save_figure(plot_plan(topology, planner.plan((0.5, 0.5), (2.0, 2.5))), sys.argv[2])
print(json.dumps(sorted(name for name in sys.modules if name.split(".")[0] == "hybridnav")))
"""
FIGURE1 = ROOT / "maps" / "figure1" / "figure1.yaml"


def _told(script: str, *arguments: str, **environment: str) -> list[str]:
    done = subprocess.run(
        [sys.executable, "-c", script, str(FIGURE1), *arguments],
        check=True, capture_output=True, text=True, env=os.environ | environment,
    )  # fmt: skip
    names: list[str] = json.loads(done.stdout.splitlines()[-1])
    return names


@cache
def visited_by_paper() -> list[Path]:
    """Return the files in which a function runs from a map's file to a path by `paper`.

    Kernels run as plain Python for it, so that their files are among them.
    """
    return [Path(name) for name in _told(_VISITED, NUMBA_DISABLE_JIT="1")]


def loaded_by_a_picture(target: Path) -> list[str]:
    """Return the modules that one plan and one picture of it import."""
    return _told(_LOADED, str(target))


def bare_kernels() -> list[str]:
    """Return the kernels of more than 40 lines of code with less than a comment in ten of these."""
    found = []
    for path in [*SRC.rglob("kernels/*.py"), *SRC.rglob("kernels.py")]:
        text = path.read_text()
        tokens = list(tokenize.generate_tokens(StringIO(text).readline))
        comments = {one.start[0] for one in tokens if one.type == tokenize.COMMENT}
        written = {one.start[0] for one in tokens if one.type not in _NO_CODE}
        for node in _nodes(path):
            if isinstance(node, ast.FunctionDef) and node.end_lineno is not None:
                first = node.body[0].end_lineno if ast.get_docstring(node) else node.lineno
                body = set(range((first or 0) + 1, node.end_lineno + 1))
                if len(body & written) > max(40, 10 * len(body & comments)):
                    found.append(f"{path.relative_to(SRC)}: {node.name}")
    return found


def parts() -> list[Path]:
    """Return the packages of the house, those of the wing one by one."""
    return sorted(
        path.parent
        for path in (*SRC.glob("*/__init__.py"), *SRC.glob(f"{WING}/*/__init__.py"))
        if path.parent.name != WING
    )


def lines_of(package: Path) -> int:
    return sum(path.read_text().count("\n") for path in package.rglob("*.py"))


def floors_of(package: Path) -> int:
    """Return the longest chain of modules inside a package, each of which imports the next one.

    Names that a package hands on lead to the file that its stub names.
    """
    graph: nx.DiGraph[Path] = nx.DiGraph()
    for path in package.rglob("*.py"):
        for node in _nodes(path):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("hybridnav."):
                for alias in node.names:
                    other = _home(node.module or "", alias.name)
                    if other != path and other.is_relative_to(package):
                        graph.add_edge(path, other)
    whole = nx.condensation(graph)
    return int(nx.dag_longest_path_length(whole)) + 1


def _home(module: str, name: str) -> Path:
    place = SRC.parent / module.replace(".", "/")
    if (place / f"{name}.py").exists():
        return place / f"{name}.py"
    stub = place / "__init__.pyi"
    if stub.exists():
        for node in _nodes(stub):
            if isinstance(node, ast.ImportFrom) and any(one.name == name for one in node.names):
                return _home(".".join([module, *filter(None, [node.module])]), name)
    return place / "__init__.py" if place.is_dir() else place.with_suffix(".py")


def unnamed() -> list[str]:
    """Return the public names that the head of their file neither names nor speaks of: none of the
    words in a name begins a word there."""
    missing = []
    for stub in SRC.rglob("*.pyi"):
        for node in _nodes(stub):
            if not isinstance(node, ast.ImportFrom) or node.level != 1 or not node.module:
                continue
            path = stub.parent / f"{node.module.replace('.', '/')}.py"
            if path.exists():
                head = (ast.get_docstring(ast.parse(path.read_text())) or "").partition("\n\n")[0]
                missing += [
                    f"{path.relative_to(SRC)}: {alias.name}"
                    for alias in node.names
                    if not _is_named(alias.name, head)
                ]
    return missing


def _is_named(name: str, head: str) -> bool:
    words = re.findall(r"[A-Z]?[a-z0-9]{2,}|[A-Z]{3,}", name)
    begins = (word.lower().rstrip("s")[:5] for word in words if len(word) > 2)
    return name in head or any(begin in head.lower() for begin in begins)


@cache
def _names_of_functions() -> Counter[str]:
    """Count the functions that name a value or a parameter so, those inside them apart."""
    count: Counter[str] = Counter()
    for path in SRC.rglob("*.py"):
        for function in filter(_is_function, _nodes(path)):
            waiting = [*ast.iter_child_nodes(function)]
            names = set()
            for node in waiting:
                if not _is_function(node):
                    names.add(getattr(node, "id", getattr(node, "arg", None)))
                    waiting += ast.iter_child_nodes(node)
            count.update(filter(None, names))
    return count


def _is_function(node: ast.AST) -> bool:
    return isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)


def figures(target: Path) -> dict[str, float]:
    files = sources()
    names = {one.package for one in files if len(one.path.parts) > 1}
    arrows = {(one.package, to) for one in files for to in one.imports if to != one.package}
    between = {(a, b) for a, b in arrows if a in names and b in names}
    visited = visited_by_paper()
    code = sum(one.code for one in files)
    sizes = [one.lines for one in files]
    by_package: Counter[str] = Counter()
    for one in files:
        by_package[one.package] += one.code
    return {
        "code": code,
        "lines": sum(sizes),
        "files": len(files),
        "code outside ext": code - by_package[WING],
        "lines of a file, most": max(sizes),
        "packages": len(names),
        "arrows between packages": len(between),
        "arrows, with single modules": len(arrows),
        "files visited by paper": len(visited),
        "lines visited by paper": sum(path.read_text().count("\n") for path in visited),
        "modules of a plan and a picture": len(loaded_by_a_picture(target)),
        "imports, % of the code": round(100 * sum(one.import_lines for one in files) / code, 1),
        "long kernels without headings": len(bare_kernels()),
        "names at the root": len(re.findall(r" as \w+", (SRC / "__init__.pyi").read_text())) - 2,
        "parameters of commands, shared ones once": sum(
            len(re.findall(r"\b(?:Option|Argument|option)\(", path.read_text()))
            for path in SRC.rglob("*.py")
        ),
        "functions with a value called found": _names_of_functions()["found"],
        "functions with a value called known": _names_of_functions()["known"],
        "lines of tests": lines_of(ROOT / "tests"),
        "lines of benchmarks": lines_of(ROOT / "benchmarks"),
    }


if __name__ == "__main__":
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        for name, value in figures(Path(folder) / "plan.png").items():
            print(f"{name:42s} {value:10,}")  # noqa: T201
