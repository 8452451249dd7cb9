"""No tuple longer than four crosses the border of a kernel without names, and none is chosen by its
length.

A long tuple is made somewhere, and taken apart somewhere: both are looked for in the text, because
numba knows the types of a kernel only where it has been called.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.product.house import SRC

MOST = 4
ARRAYS = {"moments", "place"}
"""Arguments with numbers of one kind, which are arrays: `axes_of`, and the motions of a robot."""


def _kernels(tree: ast.Module) -> Iterator[tuple[ast.FunctionDef, str]]:
    """The functions that numba compiles, by `njit`, or asks which one to compile, by `overload`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            by = {ast.unparse(one).split("(")[0] for one in node.decorator_list}
            yield from ((node, name) for name in by & {"njit", "overload"})


def _is_long(node: ast.AST | None) -> bool:
    """Whether an expression is a tuple of more than four, or of nobody knows how many."""
    return isinstance(node, ast.Tuple) and (
        len(node.elts) > MOST or any(isinstance(one, ast.Starred) for one in node.elts)
    )


def _is_number(node: ast.expr | None) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, int)


def _takes_apart(node: ast.AST, arguments: set[str]) -> bool:
    """Whether a step unpacks more than four of an argument, or takes a part or one behind them."""
    if isinstance(node, ast.Assign) and isinstance(node.value, ast.Name):
        return node.value.id in arguments and any(map(_is_long, node.targets))
    if not isinstance(node, ast.Subscript) or not isinstance(node.ctx, ast.Load):
        return False
    if getattr(node.value, "id", "") not in arguments:
        return False
    index = node.slice
    if isinstance(index, ast.Slice):
        return index.step is None and all(
            bound is None or _is_number(bound) for bound in (index.lower, index.upper)
        )
    return isinstance(index, ast.Constant) and _is_number(index) and int(str(index.value)) >= MOST


def _hands_on(node: ast.AST, held: set[str]) -> bool:
    """Whether a step returns or passes a long tuple, or one of some names of such."""
    if isinstance(node, ast.Return):
        return _is_long(node.value) or getattr(node.value, "id", "") in held
    if not isinstance(node, ast.Call):
        return False
    given = [*node.args, *(one.value for one in node.keywords)]
    return any(_is_long(one) or getattr(one, "id", "") in held for one in given)


def nameless(text: str) -> list[str]:
    """Where kernels of a file make, take apart or look at the length of tuples without names."""
    found = []
    for kernel, how in _kernels(ast.parse(text)):
        steps = list(ast.walk(kernel))
        arguments = {one.arg for one in kernel.args.args} - ARRAYS
        held = {
            target.id
            for node in steps if isinstance(node, ast.Assign) and _is_long(node.value)
            for target in node.targets if isinstance(target, ast.Name)
        }  # fmt: skip
        for node in steps:
            asks = how == "overload" and isinstance(node, ast.Call)
            is_by_length = asks and ast.unparse(node).startswith(("len(", "isinstance("))
            if is_by_length or _takes_apart(node, arguments) or _hands_on(node, held):
                found.append(f"{kernel.name}: {ast.unparse(node)[:70]}")
    return found


def test_no_long_tuple_without_names_crosses_the_border_of_a_kernel() -> None:
    found = [
        f"{path.relative_to(SRC)}: {where}"
        for path in sorted(SRC.rglob("*.py"))
        for where in nameless(path.read_text())
    ]
    assert not found, "\n".join(found)


LONG = (
    "a, b, c, d, e = given|return given[4]|return given[1:]|return 1, 2, 3, 4, 5|return *given, 5"
)


@pytest.mark.parametrize(
    "body", [*LONG.split("|"), "other((1, 2, 3, 4, 5))", "five = (1, 2, 3, 4, 5)\n    other(five)"]
)
def test_long_tuples_are_found(body: str) -> None:
    assert len(nameless(f"@guarded\n@njit(cache=True)\ndef kernel(given):\n    {body}\n")) == 1
    assert not nameless(f"def no_kernel(given):\n    {body}\n")


def test_a_choice_by_the_length_of_a_tuple_is_found() -> None:
    by_length = "@overload(stub)\ndef choice(given):\n    return one if len(given) == 6 else two\n"
    assert len(nameless(by_length)) == 1


def test_kernels_return_no_named_tuples_to_python() -> None:
    """Numba makes the object of a named tuple by a call, and if a signal's handler has raised while
    the kernel ran, the process ends there."""
    trees = {path: ast.parse(path.read_text()) for path in sorted(SRC.rglob("*.py"))}
    kernels = [(path, node) for path, tree in trees.items() for node, _ in _kernels(tree)]
    named = {
        kernel.name
        for _, kernel in kernels
        for node in ast.walk(kernel)
        if isinstance(node, ast.Return) and _is_made(node.value)
    }
    inside = {id(step) for _, kernel in kernels for step in ast.walk(kernel)}
    called = [
        f"{path.relative_to(SRC)}: {ast.unparse(node.func)}"
        for path, tree in trees.items()
        for node in ast.walk(tree)
        if isinstance(node, ast.Call)
        and id(node) not in inside
        and ast.unparse(node.func).rpartition(".")[2] in named
    ]
    assert named == {"view_room", "_backward"}  # kernels call them
    assert called == []


def _is_made(value: ast.expr | None) -> bool:
    return isinstance(value, ast.Call) and ast.unparse(value.func).rpartition(".")[2][0].isupper()


def uncounted(kernels: list[ast.FunctionDef]) -> list[str]:
    """What makes an array, which is never freed, or returns one, in kernels without counts."""
    plain = {"min", "max", "abs", "range", "len", "np.int32", "np.int64"}
    plain |= {f"np.uint{bits}" for bits in (8, 16, 32, 64)}
    of = {one for one in kernels if "_nrt=False" in ast.unparse(one.decorator_list[-1])}
    may = plain | {one.name for one in of} - {one.name for one in kernels if one not in of}
    found = []
    for kernel in of:
        steps = [step for part in kernel.body for step in ast.walk(part)]
        arrays = {ast.unparse(one.value) for one in steps if isinstance(one, ast.Subscript)}
        called = {ast.unparse(one.func) for one in steps if isinstance(one, ast.Call)}
        returned = {ast.unparse(one.value or one) for one in steps if isinstance(one, ast.Return)}
        found += [f"{kernel.name}: {what}" for what in called - may | returned & arrays]
    return found


def test_kernels_without_counts_of_references_make_and_return_no_array() -> None:
    trees = map(ast.parse, map(Path.read_text, SRC.rglob("*.py")))
    assert not uncounted([node for tree in trees for node, how in _kernels(tree) if how == "njit"])


@pytest.mark.parametrize("step", ["x = np.empty(3)", "x = other(a)", "a[0] = 1\n    return a"])
def test_counts_are_found(step: str) -> None:
    [(kernel, _)] = _kernels(ast.parse(f"@njit(_nrt=False)\ndef kernel(a):\n    {step}\n"))
    assert len(uncounted([kernel])) == 1
