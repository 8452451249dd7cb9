"""The tests themselves: where they stand, and that they use what users use."""

import ast
from pathlib import Path

import hybridnav

SOURCE = Path(hybridnav.__file__).parent
TESTS = Path(__file__).parents[1]
PACKAGES = {file.parent.relative_to(SOURCE) for file in SOURCE.rglob("__init__.py")}
OTHERS = {Path("benchmarks"), Path("product")}
"""Folders of tests that mirror no package."""
FILES = sorted(TESTS.rglob("*.py"))


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def in_private(module: str) -> bool:
    *packages, name = module.split(".")
    return is_private(name) or "kernels" in {name, *packages[-1:]}


def home_of(private: str) -> Path:
    """Return where the tests of a private module stand, relative to the folder of tests.

    That is the folder of its package, and for a module beside the packages a file of its name.
    """
    _, *packages, module = private.replace(".kernels.", ".").split(".")
    return Path(*packages) if packages else Path(f"test_{module.lstrip('_')}.py")


def listed(file: Path) -> set[str]:
    """Return the names in `__all__` of a module."""
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return {str(ast.literal_eval(name)) for name in getattr(node.value, "elts", [])}
    return set()


def public_names(private: str) -> set[str]:
    folder = SOURCE.joinpath(*private.replace(".kernels.", ".").split(".")[1:-1])
    return {
        name for file in folder.glob("*.py") if not is_private(file.stem) for name in listed(file)
    }


def private_uses(tree: ast.Module) -> list[tuple[str, str]]:
    """Return `(module, name)` of what a test takes from private modules, or by private names."""
    found, aliases = [], {}
    for node in ast.walk(tree):
        if not isinstance(node, ast.ImportFrom) or (node.module or "").split(".")[0] != "hybridnav":
            continue
        for alias in node.names:
            whole = f"{node.module}.{alias.name}"
            if (SOURCE.parent / whole.replace(".", "/")).with_suffix(".py").is_file():
                if in_private(whole):
                    aliases[alias.asname or alias.name] = whole
            elif in_private(str(node.module)) or is_private(alias.name):
                found.append((str(node.module), alias.name))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            module = aliases.get(node.value.id)
            found += [(module, node.attr)] if module else []
    return found


def test_tests_stand_in_folders_named_after_packages() -> None:
    folders = {file.parent.relative_to(TESTS) for file in FILES if file.stem.startswith("test_")}
    assert sorted(folders - PACKAGES - OTHERS) == []


def test_private_modules_are_imported_by_their_own_tests_only() -> None:
    wrong = []
    for file in FILES:
        here = file.relative_to(TESTS)
        for module, name in private_uses(ast.parse(file.read_text(encoding="utf-8"))):
            if not in_private(module):
                wrong.append(f"{here}: {name} is private to {module}")
            elif home_of(module) not in {here, here.parent}:
                wrong.append(f"{here}: {module} is tested in {home_of(module)}")
            elif name in public_names(module):
                wrong.append(f"{here}: {name} of {module} has a public face beside it")
    assert wrong == []
